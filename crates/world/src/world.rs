//! A scene in play: agents that run, read and driven from any thread.
//!
//! In: a [`Scene`] and an executor. Out: each object's latest state, the world's time and its hash.
//! Never here: a file, a picture, a law of control.

use super::Scene;
use super::assemble;
use super::assemble::Govern;
use super::checkpoint::{Checkpoint, CheckpointError, SceneIdentity};
use super::kinds::ExecutorKind;
use metachron_core::{AgentId, Archive, ArchiveError, SimSpan, SimTime, Snapshot};
use metachron_runtime::{
    AgentHandle, AgentState, AgentStats, Command, Lockstep, Pool, Run, RunError, SendError, SystemClock, Threads,
    Timeline, TimelineCommand, state_hash, wait_until,
};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// An object of a world; valid for the world that named it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Object(AgentId);

impl Object {
    /// The number of its agent: its place in the scene.
    #[must_use]
    pub const fn id(self) -> AgentId {
        self.0
    }
}

/// Why a world could not be started, or has no such object.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WorldError {
    /// A model rejected its object.
    #[error("object \"{name}\": {reason}")]
    Build {
        /// The object's name.
        name: String,
        /// The model's message.
        reason: String,
    },
    /// The agents could not be started.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The world has no moving object of that name.
    #[error("the world has no moving object \"{name}\"; its moving objects are {known}")]
    NoObject {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: String,
    },
}

/// A running world. Clones are the same world; every method takes `&self`.
///
/// Its time stands until [`World::advance`] or [`World::drive`] lets it pass.
#[derive(Clone)]
pub struct World {
    shared: Arc<Shared>,
}

struct Shared {
    state: Mutex<State>,
    agents: Vec<AgentHandle>,
    executor: ExecutorKind,
    /// By what checkpoints of its scene are known again.
    identity: SceneIdentity,
    /// The clock of executors in real time.
    clock: Arc<SystemClock>,
}

/// What makes agents step, or where its time stood when it ended.
enum State {
    Running(Box<dyn Run>),
    Stopped { now: Duration, time: SimTime, timeline: Timeline },
}

/// How often a real-time world looks whether all agents have arrived.
const POLL_INTERVAL: Duration = Duration::from_micros(500);

impl World {
    /// Starts the agents of `scene` on `executor`, each with the step and the resolution that the scene gives it.
    ///
    /// # Errors
    /// [`WorldError::Build`] and [`WorldError::Run`]; nothing runs then.
    pub fn start(scene: &Scene, executor: ExecutorKind) -> Result<Self, WorldError> {
        Self::start_governed(scene, executor, &mut |_| None)
    }

    /// As [`World::start`], with governors that choose steps and resolutions while the world runs.
    ///
    /// # Errors
    /// [`WorldError::Build`] and [`WorldError::Run`]; nothing runs then.
    pub fn start_governed(scene: &Scene, executor: ExecutorKind, govern: Govern<'_>) -> Result<Self, WorldError> {
        let executor = assemble::executor(executor, scene.agents.len());
        let spawns = assemble::spawns(scene, executor, govern)?;
        let clock = Arc::new(SystemClock::new());
        let priority = assemble::priority(scene);
        let mut run: Box<dyn Run> = match executor {
            ExecutorKind::Threads => Box::new(Threads::start(spawns, clock.clone(), priority)?),
            ExecutorKind::Auto | ExecutorKind::Pool => Box::new(Pool::start(spawns, clock.clone(), priority)?),
            ExecutorKind::Lockstep => Box::new(Lockstep::start(spawns, assemble::machine(scene))?),
        };
        if executor != ExecutorKind::Lockstep {
            run.drive(TimelineCommand::Pause);
        }
        let (agents, identity) = (run.agents().to_vec(), SceneIdentity::of(scene));
        Ok(Self {
            shared: Arc::new(Shared { state: Mutex::new(State::Running(run)), agents, executor, identity, clock }),
        })
    }

    /// Starts `scene` and puts it into the state of `checkpoint`: it goes on as the world did that was saved, to the bit.
    ///
    /// # Errors
    /// Those of [`World::start`] and [`World::restore`].
    pub fn open(scene: &Scene, executor: ExecutorKind, checkpoint: &Checkpoint) -> Result<Self, CheckpointError> {
        Self::open_governed(scene, executor, &mut |_| None, checkpoint)
    }

    /// As [`World::open`], with the governors of the world that was saved.
    ///
    /// # Errors
    /// Those of [`World::start_governed`] and [`World::restore`].
    pub fn open_governed(
        scene: &Scene,
        executor: ExecutorKind,
        govern: Govern<'_>,
        checkpoint: &Checkpoint,
    ) -> Result<Self, CheckpointError> {
        let world = Self::start_governed(scene, executor, govern)?;
        world.restore(checkpoint)?;
        Ok(world)
    }

    /// The state of the world now: all that the next bit of it needs. In lockstep only; samples of watched points and CPU times are not in it.
    ///
    /// # Errors
    /// [`CheckpointError::Refused`] on threads and in a pool, and where a model or a governor does not save its state;
    /// [`CheckpointError::Stopped`]. The world goes on as it was.
    pub fn checkpoint(&self) -> Result<Checkpoint, CheckpointError> {
        let mut state = self.state();
        let State::Running(run) = &mut *state else { return Err(CheckpointError::Stopped) };
        let mut archive = Archive::writer();
        run.archive(&mut archive).map_err(CheckpointError::Refused)?;
        let of = self.shared.identity.clone();
        Ok(Checkpoint { of, time: run.sim_now(), state: archive.into_bytes() })
    }

    /// Puts the world back into the state of `checkpoint`, of this world or of another of the same scene: what it would have done after, it does
    /// again, to the bit. Objects and agents stay valid.
    ///
    /// # Errors
    /// [`CheckpointError::OtherScene`], [`CheckpointError::Refused`] and [`CheckpointError::Stopped`] leave the world as it was. After
    /// [`CheckpointError::Unusable`] it is stopped.
    pub fn restore(&self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.shared.identity.check(&checkpoint.of)?;
        let mut state = self.state();
        let State::Running(run) = &mut *state else { return Err(CheckpointError::Stopped) };
        if self.executor() != ExecutorKind::Lockstep {
            return Err(CheckpointError::Refused(ArchiveError::Refused { what: "a world in real time".to_owned() }));
        }
        let Err(reason) = read_state(run.as_mut(), &checkpoint.state) else { return Ok(()) };
        let (now, time, timeline) = (run.now(), run.sim_now(), run.timeline());
        let broken = std::mem::replace(&mut *state, State::Stopped { now, time, timeline });
        // what it has become is not accounted for
        let _ = catch_unwind(AssertUnwindSafe(|| drop(broken)));
        Err(CheckpointError::Unusable { reason })
    }

    /// The object of that name.
    ///
    /// # Errors
    /// [`WorldError::NoObject`].
    pub fn object(&self, name: &str) -> Result<Object, WorldError> {
        let found = self.shared.agents.iter().find(|agent| agent.name() == name);
        found.map(|agent| Object(agent.id())).ok_or_else(|| {
            let known: Vec<_> = self.shared.agents.iter().take(20).map(AgentHandle::name).collect();
            WorldError::NoObject { name: name.to_owned(), known: known.join(", ") }
        })
    }

    /// The newest state of an object. Reading never blocks the object.
    ///
    /// # Panics
    /// For an object of another world whose number this one does not have.
    #[must_use]
    pub fn latest(&self, object: Object) -> Arc<Snapshot> {
        self.shared.agents[object.0.0 as usize].latest()
    }

    /// Simulated time now.
    #[must_use]
    pub fn time(&self) -> SimTime {
        match &*self.state() {
            State::Running(run) => run.sim_now(),
            State::Stopped { time, .. } => *time,
        }
    }

    /// Hash of the newest states of all objects: equal numbers mean bit-identical states.
    #[must_use]
    pub fn hash(&self) -> u64 {
        state_hash(&self.shared.agents)
    }

    /// Lets the world live for `span`, then stops its time.
    ///
    /// In lockstep every step that is due by then has been made. On threads and in the pool time passes in real time, and each object that
    /// neither rests nor has failed has lived to the end at least; one may be a step ahead.
    /// A world that was stopped stays as it is.
    pub fn advance(&self, span: SimSpan) {
        if self.executor() == ExecutorKind::Lockstep {
            return self.wait_until(self.now() + Duration::from_nanos(span.as_nanos()));
        }
        let end = self.time() + span;
        self.drive(TimelineCommand::Run);
        while !self.has_stopped() {
            let now = self.now();
            self.wait_until(now + POLL_INTERVAL);
            if self.time() >= end && self.shared.agents.iter().all(|agent| has_reached(agent, end)) {
                return self.drive(TimelineCommand::Pause);
            }
        }
    }

    /// The executor that runs the agents.
    #[must_use]
    pub fn executor(&self) -> ExecutorKind {
        self.shared.executor
    }

    /// The running agents, in the order of their numbers.
    #[must_use]
    pub fn agents(&self) -> &[AgentHandle] {
        &self.shared.agents
    }

    /// Wall time since the start; virtual in lockstep.
    #[must_use]
    pub fn now(&self) -> Duration {
        match &*self.state() {
            State::Running(run) => run.now(),
            State::Stopped { now, .. } => *now,
        }
    }

    /// Waits until the wall time `until`, while the agents run; returns at once if that has passed.
    pub fn wait_until(&self, until: Duration) {
        match self.executor() {
            ExecutorKind::Lockstep => self.with_run(|run| run.wait_until(until)),
            _ => wait_until(&*self.shared.clock, until),
        }
    }

    /// Lets a frame's own `work` pass: it occupies a core of the declared machine in lockstep, and has passed by itself elsewhere.
    pub fn spend(&self, work: Duration) {
        self.with_run(|run| run.spend(work));
    }

    /// The timeline in force.
    #[must_use]
    pub fn timeline(&self) -> Timeline {
        match &*self.state() {
            State::Running(run) => run.timeline(),
            State::Stopped { timeline, .. } => *timeline,
        }
    }

    /// Changes the flow of time: pause, run, speed, single step.
    pub fn drive(&self, drive: TimelineCommand) {
        self.with_run(|run| run.drive(drive));
    }

    /// Sends a command to an agent.
    ///
    /// # Errors
    /// [`SendError`]: nothing was delivered.
    pub fn send(&self, to: AgentId, command: Command) -> Result<(), SendError> {
        self.shared.agents.get(to.0 as usize).ok_or(SendError::NoAgent(to))?.send(command)
    }

    /// Ends the run for all clones: waits for the turns in progress (boundedly) and returns the metrics of every agent.
    /// Latest states stay readable.
    pub fn stop(&self) -> Vec<AgentStats> {
        let mut state = self.state();
        let ended = match &*state {
            State::Running(run) => State::Stopped { now: run.now(), time: run.sim_now(), timeline: run.timeline() },
            State::Stopped { .. } => return self.shared.agents.iter().map(AgentHandle::stats).collect(),
        };
        match std::mem::replace(&mut *state, ended) {
            State::Running(run) => run.shutdown(),
            State::Stopped { .. } => unreachable!("it ran a moment ago, and the lock is held"),
        }
    }

    fn has_stopped(&self) -> bool {
        matches!(*self.state(), State::Stopped { .. })
    }

    /// Does something with a world that runs; nothing with one that was stopped.
    fn with_run(&self, act: impl FnOnce(&mut dyn Run)) {
        if let State::Running(run) = &mut *self.state() {
            act(run.as_mut());
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.shared.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Reads the state of a run; a broken one may break any promise of those that read it.
fn read_state(run: &mut dyn Run, state: &[u8]) -> Result<(), String> {
    let read = catch_unwind(AssertUnwindSafe(|| {
        let mut archive = Archive::reader(state);
        run.archive(&mut archive)?;
        archive.finish()
    }));
    match read {
        Ok(outcome) => outcome.map_err(|error| error.to_string()),
        Err(_) => Err("its numbers do not fit together".to_owned()),
    }
}

/// Whether nothing more is to be waited for: the agent has reached `end`, rests, or has failed.
fn has_reached(agent: &AgentHandle, end: SimTime) -> bool {
    let newest = agent.latest();
    newest.at_rest || !matches!(agent.state(), AgentState::Running) || newest.moment() >= end
}
