//! A scene in play: agents that run, read and driven from any thread.
//!
//! In: a [`Scene`] and an executor. Out: each object's latest state, the world's time and its hash.
//! Never here: a file, a picture, a law of control.

use super::Scene;
use super::assemble;
use super::assemble::Govern;
use super::builder::{Part, SceneBuildError, member};
use super::checkpoint::{Checkpoint, CheckpointError, SceneIdentity};
use super::events::{EventFilter, Events};
use super::frames::{Frame, Frames};
use super::joined::Joined;
use super::kinds::ExecutorKind;
use super::log::{Log, Mode, logged};
use super::object::{Object, WorldTag};
use super::recording::{Entry, added};
use super::scene::Member;
use super::sensors::Instruments;
use glam::DVec3;
use metachron_contact::stepper::ClusterScene;
use metachron_core::{AgentId, Anchor, Archive, ArchiveError, Body, SimTime, Snapshot};
use metachron_runtime::{
    AgentHandle, AgentState, AgentStats, Agents, Command, Keyed, Lockstep, Pool, Run, RunError, SystemClock, Threads,
    Timeline, TimelineCommand, state_hash, wait_until,
};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::Duration;

/// Why a world could not be started, or refuses something.
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
    /// There is no agent of that number.
    #[error("the world has no agent {}", .0.0)]
    NoAgent(AgentId),
    /// The object is another world's.
    #[error("the object was named by another world")]
    Foreign,
    /// The object was removed.
    #[error("\"{name}\" has been removed from the world")]
    Gone {
        /// The name that it had.
        name: String,
    },
    /// An object of that name is in the world already.
    #[error("the world has an object \"{name}\" already")]
    SameName {
        /// The name.
        name: String,
    },
    /// A world that was stopped takes nothing up.
    #[error("the world has been stopped")]
    Stopped,
    /// An object cannot be built.
    #[error(transparent)]
    Part(#[from] SceneBuildError),
    /// The object has no such point.
    #[error("\"{name}\" has no point {anchor:?}: {wanted}")]
    NoPoint {
        /// The object's name.
        name: String,
        /// The point asked for.
        anchor: Anchor,
        /// Which points it has.
        wanted: String,
    },
    /// A command was refused.
    #[error("\"{name}\" takes no such command: {reason}")]
    Refused {
        /// The object's name.
        name: String,
        /// Why.
        reason: String,
    },
    /// The world has no joint of that name.
    #[error("the world has no joint \"{name}\"; its joints with names are [{known}]")]
    NoJoint {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// The world has no sensor of that name.
    #[error("the world has no sensor \"{name}\"; its sensors are [{known}]")]
    NoSensor {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// A pace that no machine keeps, or that is a pause.
    #[error("the factor of time is {factor}; expected 0.001 to 100")]
    BadPace {
        /// The factor.
        factor: f64,
    },
    /// A query that asks for nothing that can be found.
    #[error("{0}")]
    BadQuery(String),
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
    pub(super) shared: Arc<Shared>,
}

pub(super) struct Shared {
    tag: WorldTag,
    state: Mutex<State>,
    agents: Agents,
    /// How many agents the scene has, and those that joined since, in the order of their numbers.
    of_scene: usize,
    pub joined: Arc<Joined>,
    /// Gravity, m/s²: that of objects that join it.
    pub gravity: DVec3,
    /// The static solids and joints.
    pub surroundings: Arc<ClusterScene>,
    instruments: Instruments,
    /// The time when it was last let pass or had passed, nanoseconds.
    seen_ns: AtomicU64,
    executor: ExecutorKind,
    /// By what checkpoints of its scene are known again.
    pub identity: SceneIdentity,
    /// The clock of executors in real time.
    pub clock: Arc<SystemClock>,
    /// Whether its time waits for its objects ([`super::Pace::Free`]).
    pub is_free: AtomicBool,
    /// What is written down of it, or followed.
    pub log: Arc<Log>,
}

impl std::fmt::Debug for World {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("World").field("tag", &self.shared.tag).finish_non_exhaustive()
    }
}

impl WorldError {
    pub(super) fn bad_query(reason: &str) -> Self {
        Self::BadQuery(reason.to_owned())
    }
}

/// What makes agents step, or where its time stood when it ended.
pub(super) enum State {
    Running(Box<dyn Run>),
    Stopped { now: Duration, time: SimTime, timeline: Timeline },
}

/// What a world has besides its run.
pub(super) struct Setting {
    pub surroundings: Arc<ClusterScene>,
    pub clock: Arc<SystemClock>,
    pub log: Arc<Log>,
    pub joined: Arc<Joined>,
}

/// Why a replay refuses what is asked of it.
pub(super) const REPLAYED: &str = "a replay does what its recording says, and nothing else";

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
        let (executor, log) = (assemble::executor(executor, scene.agents.len()), Arc::<Log>::default());
        let surroundings = assemble::surroundings(scene)?;
        let spawns = assemble::spawns(scene, &surroundings, executor, &mut logged(govern, &log))?;
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
        Ok(Self::of_run(scene, executor, run, Setting { surroundings, clock, log, joined: Arc::default() }))
    }

    /// The world of a run of the agents of `scene`.
    pub(super) fn of_run(scene: &Scene, executor: ExecutorKind, run: Box<dyn Run>, setting: Setting) -> Self {
        let Setting { surroundings, clock, log, joined } = setting;
        let (agents, gravity, identity) = (run.agents().clone(), scene.gravity, SceneIdentity::of(scene));
        let (tag, state) = (WorldTag::new(), Mutex::new(State::Running(run)));
        let (joint_names, joints) = (scene.joint_names.clone(), Arc::clone(&scene.joints));
        let instruments = Instruments { joint_names, joints, sensors: scene.sensors.clone() };
        let seen_ns = AtomicU64::new(0);
        let shared = Shared {
            tag,
            state,
            agents,
            of_scene: scene.agents.len(),
            joined,
            gravity,
            surroundings,
            instruments,
            seen_ns,
            executor,
            identity,
            clock,
            is_free: AtomicBool::new(false),
            log,
        };
        Self { shared: Arc::new(shared) }
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

    /// The state of the world now: all that the next bit of it needs, but samples of watched points and CPU times. On threads and in a pool
    /// turns in progress end first, however long they take, and each object is saved at the end of its own step ([`Checkpoint::times`]): what it has given others is
    /// either in their states or still in its own. Any executor goes on from it.
    ///
    /// # Errors
    /// [`CheckpointError::Refused`] where a model or a governor does not save its state, [`CheckpointError::Stopped`]. The world goes on as it
    /// was.
    pub fn checkpoint(&self) -> Result<Checkpoint, CheckpointError> {
        let mut state = self.state();
        let State::Running(run) = &mut *state else { return Err(CheckpointError::Stopped) };
        self.cut(run.as_mut())
    }

    /// The state of its run now.
    pub(super) fn cut(&self, run: &mut dyn Run) -> Result<Checkpoint, CheckpointError> {
        let mut archive = Archive::writer();
        run.archive(&mut archive).map_err(CheckpointError::Refused)?;
        let of = self.shared.identity.now(&self.shared.agents);
        let times = self.shared.agents.iter().map(|agent| agent.latest().moment()).collect();
        Ok(Checkpoint { of, time: run.sim_now(), times, state: archive.into_bytes() })
    }

    /// Puts the world back into the state of `checkpoint`, of this world or of another of the same scene: what it would have done after, it does
    /// again, in lockstep to the bit. Objects and agents stay valid.
    ///
    /// # Errors
    /// [`CheckpointError::OtherScene`], also where objects have joined or left since, [`CheckpointError::Refused`] and [`CheckpointError::Stopped`] leave the world as it was. After
    /// [`CheckpointError::Unusable`] it is stopped.
    pub fn restore(&self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.shared.identity.now(&self.shared.agents).check(&checkpoint.of)?;
        let mut state = self.state();
        let State::Running(run) = &mut *state else { return Err(CheckpointError::Stopped) };
        if self.shared.log.is_replayed() {
            return Err(CheckpointError::Refused(ArchiveError::Refused { what: "a replay".to_owned() }));
        }
        // in real time the turns in progress end before it is read
        self.in_order(|| (), |log, ()| log.note(|| Entry::Restore(checkpoint.to_bytes())));
        let outcome = read_state(run.as_mut(), &checkpoint.state);
        self.see(run.as_ref());
        let Err(reason) = outcome else { return Ok(()) };
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
        let living = |agent: &&AgentHandle| agent.name() == name && agent.state() != AgentState::Gone;
        let found = self.shared.agents.iter().find(living);
        found.map(|agent| self.shared.tag.object(agent.id())).ok_or_else(|| {
            let known: Vec<_> = self.shared.agents.iter().take(20).map(AgentHandle::name).collect();
            WorldError::NoObject { name: name.to_owned(), known: known.join(", ") }
        })
    }

    /// The objects of these names.
    ///
    /// # Errors
    /// [`WorldError::NoObject`] for the first that there is not.
    pub fn objects<const N: usize>(&self, names: [&str; N]) -> Result<[Object; N], WorldError> {
        let all: Vec<_> = names.iter().map(|name| self.object(name)).collect::<Result<_, _>>()?;
        all.try_into().map_err(|_| WorldError::Foreign)
    }

    /// The object whose agent has this number: its place in the scene.
    ///
    /// # Errors
    /// [`WorldError::NoAgent`].
    pub fn object_of(&self, id: AgentId) -> Result<Object, WorldError> {
        let agent = self.shared.agents.of(id).ok_or(WorldError::NoAgent(id))?;
        Ok(self.shared.tag.object(agent.id()))
    }

    /// The newest state of an object. Reading never blocks the object.
    ///
    /// # Errors
    /// [`WorldError::Foreign`].
    pub fn latest(&self, object: Object) -> Result<Arc<Snapshot>, WorldError> {
        self.agent(object).map(AgentHandle::latest)
    }

    /// Sends a command to an object, which obeys at its next step.
    ///
    /// # Errors
    /// [`WorldError::Foreign`]; [`WorldError::NoPoint`] for a material point that it does not have; [`WorldError::Refused`] for numbers outside
    /// their range and for a joint that it cannot drive. Nothing was done then.
    pub fn command(&self, object: Object, command: Command) -> Result<(), WorldError> {
        let agent = self.agent(object)?;
        let refused = |reason: String| WorldError::Refused { name: agent.name().to_owned(), reason };
        let state = agent.latest();
        if agent.takes_poses() && matches!(command, Command::Force(_) | Command::Impulse(_) | Command::Spring(_)) {
            return Err(refused("it is kinematic: no force moves it; lead it by poses".to_owned()));
        }
        match command {
            Command::Force(Keyed { what: Some(force), .. }) | Command::Impulse(force) => {
                self.check_point(object, &state, force.anchor)?;
                if force.torque_n_m != DVec3::ZERO && matches!(state.body, Body::Soft(_)) {
                    return Err(refused("its vertices do not turn, so a torque has nothing to act on".to_owned()));
                }
            }
            Command::Spring(Keyed { what: Some(spring), .. }) => self.check_point(object, &state, spring.anchor)?,
            Command::Carve(_) if !agent.form().is_some_and(|form| form.has_cells()) => {
                return Err(refused("only solids and sheets have cells that can be removed".to_owned()));
            }
            _ => {}
        }
        if self.shared.log.is_replayed() {
            return Err(refused(REPLAYED.to_owned()));
        }
        let note = |log: &mut Mode, sent: &Result<(), String>| {
            if sent.is_ok() {
                log.note(|| Entry::Command(object.id(), command));
            }
        };
        let send = || agent.send(command).map_err(|error| error.to_string());
        self.shared.log.in_order(|| self.between_calls(), send, note).map_err(refused)
    }

    /// Takes up another object: it lives from its first step on, and touches what it meets. No other object waits for it.
    ///
    /// # Errors
    /// [`WorldError::SameName`], [`WorldError::Part`], [`WorldError::Build`], [`WorldError::Run`] and [`WorldError::Stopped`]; nothing was done
    /// then.
    pub fn add(&self, name: impl Into<String>, part: impl Into<Part>) -> Result<Object, WorldError> {
        let name = name.into();
        if self.object(&name).is_ok() {
            return Err(WorldError::SameName { name });
        }
        let (part, log) = (part.into(), &self.shared.log);
        if log.is_replayed() {
            return Err(WorldError::Refused { name, reason: REPLAYED.to_owned() });
        }
        let entry = added(&name, &part);
        let State::Running(run) = &mut *self.state() else { return Err(WorldError::Stopped) };
        if log.is_recorded() && entry.is_none() {
            let reason =
                "a recording has rigid bodies, tubes and soft bodies that join, and no agent of your own".to_owned();
            return Err(WorldError::Refused { name, reason });
        }
        let id = AgentId(self.shared.agents.len() as u32);
        let member = member(id, name, part, self.shared.gravity)?;
        let spawn = assemble::lone(&member, &self.shared.surroundings, self.executor())?;
        let note = |log: &mut Mode, joined: &Result<AgentHandle, RunError>| {
            let (Ok(joined), Some(entry)) = (joined, entry) else { return log.note_begun() };
            if self.executor() != ExecutorKind::Lockstep {
                log.note(|| Entry::Present(joined.latest().moment()));
            }
            log.note(|| entry);
        };
        // who sees the agent can ask for its member
        self.shared.joined.push(member);
        let joined = self.in_order(|| run.add(spawn), note).inspect_err(|_| self.shared.joined.pop())?;
        Ok(self.shared.tag.object(joined.id()))
    }

    /// Takes an object out: at its next step nothing of it is left, and what lay on it falls. Its name is free again; it itself is an error
    /// from then on.
    ///
    /// # Errors
    /// [`WorldError::Foreign`], [`WorldError::Gone`] and [`WorldError::Stopped`].
    pub fn remove(&self, object: Object) -> Result<(), WorldError> {
        let agent = self.agent(object)?;
        let refused = |reason: String| WorldError::Refused { name: agent.name().to_owned(), reason };
        let log = &self.shared.log;
        if log.is_replayed() {
            return Err(refused(REPLAYED.to_owned()));
        }
        let State::Running(run) = &mut *self.state() else { return Err(WorldError::Stopped) };
        let note = |log: &mut Mode, left: &Result<(), String>| {
            if left.is_ok() {
                log.note(|| Entry::Remove(object.id()));
            }
        };
        self.in_order(|| run.remove(object.id()).map_err(|error| error.to_string()), note).map_err(refused)
    }

    /// Events of its objects from now on.
    #[must_use]
    pub fn events(&self, filter: EventFilter) -> Events {
        Events::new(self.clone(), filter)
    }

    /// All objects at one moment, so many times a second from now on; time passes meanwhile.
    #[must_use]
    pub fn frames(&self, rate_hz: f64) -> Frames {
        Frames::new(self.clone(), rate_hz)
    }

    /// All objects now, at one moment.
    #[must_use]
    pub fn frame(&self) -> Frame {
        Frame::now(self.clone())
    }

    /// Simulated time now; in lockstep, while another thread lets it pass, that at which this began: it does not wait for it.
    #[must_use]
    pub fn time(&self) -> SimTime {
        let state = match self.shared.state.try_lock() {
            Ok(state) => state,
            Err(TryLockError::Poisoned(state)) => state.into_inner(),
            Err(TryLockError::WouldBlock) if self.executor() == ExecutorKind::Lockstep => {
                return SimTime::from_nanos(self.shared.seen_ns.load(Relaxed));
            }
            // in real time nobody keeps it for long
            Err(TryLockError::WouldBlock) => self.state(),
        };
        match &*state {
            State::Running(run) => run.sim_now(),
            State::Stopped { time, .. } => *time,
        }
    }

    /// Hash of the newest states of all objects: equal numbers mean bit-identical states.
    #[must_use]
    pub fn hash(&self) -> u64 {
        state_hash(&self.shared.agents)
    }

    /// The executor that runs the agents.
    #[must_use]
    pub fn executor(&self) -> ExecutorKind {
        self.shared.executor
    }

    /// All agents that have ever been in the world, in the order of their numbers.
    #[must_use]
    pub fn agents(&self) -> &Agents {
        &self.shared.agents
    }

    /// How many agents its scene has; those of higher numbers joined it since ([`World::joined`]).
    #[must_use]
    pub fn agents_of_scene(&self) -> usize {
        self.shared.of_scene
    }

    /// What an agent that joined since the start was built from, as a scene has it of its own; `None` of agents of the scene.
    #[must_use]
    pub fn joined(&self, id: AgentId) -> Option<Member> {
        let at = (id.0 as usize).checked_sub(self.shared.of_scene)?;
        self.shared.joined.get(at)
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
            ExecutorKind::Lockstep => self.with_run(|| Entry::Wait(until), |run| run.wait_until(until)),
            _ => wait_until(&*self.shared.clock, until),
        }
    }

    /// Lets a frame's own `work` pass: it occupies a core of the declared machine in lockstep, and has passed by itself elsewhere.
    pub fn spend(&self, work: Duration) {
        if self.executor() == ExecutorKind::Lockstep {
            self.with_run(|| Entry::Spend(work), |run| run.spend(work));
        }
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
        if self.executor() == ExecutorKind::Lockstep {
            return self.with_run(|| Entry::Drive(drive), |run| run.drive(drive));
        }
        let State::Running(run) = &mut *self.state() else { return };
        self.see(run.as_ref());
        let note = |log: &mut Mode, timeline: &Timeline| log.note(|| Entry::Timeline(*timeline));
        let act = || {
            run.drive(drive);
            run.timeline()
        };
        self.in_order(act, note);
        self.see(run.as_ref());
    }

    /// Ends the run for all clones: waits for the turns in progress (boundedly) and returns the metrics of every agent.
    /// Latest states stay readable.
    pub fn stop(&self) -> Vec<AgentStats> {
        // who wants to know whether it is complete has ended it before
        drop(self.end_recording());
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

    pub(super) fn tag(&self) -> WorldTag {
        self.shared.tag
    }

    pub(super) fn instruments(&self) -> &Instruments {
        &self.shared.instruments
    }

    pub(super) fn surroundings(&self) -> &ClusterScene {
        &self.shared.surroundings
    }

    /// The agent of an object.
    pub(super) fn agent(&self, object: Object) -> Result<&AgentHandle, WorldError> {
        let known = self.shared.agents.of(object.id()).filter(|_| object.is_of(self.shared.tag));
        let agent = known.ok_or(WorldError::Foreign)?;
        let left = agent.state() == AgentState::Gone;
        if left { Err(WorldError::Gone { name: agent.name().to_owned() }) } else { Ok(agent) }
    }

    fn check_point(&self, object: Object, state: &Snapshot, anchor: Anchor) -> Result<(), WorldError> {
        state.body.point(anchor).map(drop).ok_or_else(|| self.no_point(object, anchor))
    }

    /// Why an object has no such point.
    pub(super) fn no_point(&self, object: Object, anchor: Anchor) -> WorldError {
        let Ok(agent) = self.agent(object) else { return WorldError::Foreign };
        let wanted = match &agent.latest().body {
            Body::Nothing => "it has no matter".to_owned(),
            Body::Curve(curve) => {
                let length_m = curve.arc_m.last().copied().unwrap_or_default();
                format!("it has Arc of 0 to {length_m} m")
            }
            Body::Rigid(_) | Body::Tool(_) => "it has Local, metres from its centre of mass in its own axes".to_owned(),
            Body::Soft(soft) => format!("it has Vertex of 0 to {}", soft.positions.len().saturating_sub(1)),
        };
        WorldError::NoPoint { name: agent.name().to_owned(), anchor, wanted }
    }

    pub(super) fn has_stopped(&self) -> bool {
        matches!(*self.state(), State::Stopped { .. })
    }

    /// [`Log::in_order`] for who has the run.
    fn in_order<T>(&self, act: impl FnOnce() -> T, note: impl FnOnce(&mut Mode, &T)) -> T {
        self.shared.log.in_order(|| None::<()>, act, note)
    }

    /// Waits in lockstep until no call lets time pass: a recording there has the order of calls alone.
    pub(super) fn between_calls(&self) -> Option<MutexGuard<'_, State>> {
        (self.executor() == ExecutorKind::Lockstep).then(|| self.state())
    }

    /// Does something with a world in lockstep that runs; nothing with one that was stopped.
    fn with_run(&self, entry: impl FnOnce() -> Entry, act: impl FnOnce(&mut dyn Run)) {
        if let State::Running(run) = &mut *self.state() {
            self.shared.log.note(entry);
            self.see(run.as_ref());
            act(run.as_mut());
            self.see(run.as_ref());
        }
    }

    /// Notes the time for those that ask while it passes.
    fn see(&self, run: &dyn Run) {
        self.shared.seen_ns.store(run.sim_now().as_nanos(), Relaxed);
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.shared.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Reads the state of a run; a broken one may break any promise of those that read it.
pub(super) fn read_state(run: &mut dyn Run, state: &[u8]) -> Result<(), String> {
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
