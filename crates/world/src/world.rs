//! A scene in play: agents that run, read and driven from any thread.
//!
//! In: a [`Scene`] and an executor. Out: each object's latest state, the world's time and its hash.
//! Never here: a file, a picture, a law of control.

use super::Scene;
use super::error::{Waited, WorldError};
use crate::control::call_lock::{CallGuard, CallLock};
use crate::description::kinds::ExecutorKind;
use crate::history::checkpoint::SceneIdentity;
use crate::history::log::{Log, Mode, logged};
use crate::history::recording::{Entry, RecordError};
use crate::reading::events::{EventFilter, Events};
use crate::reading::frames::{Frame, Frames};
use crate::reading::object::{Object, Touched, WorldTag};
use crate::reading::sensors::Instruments;
use crate::start::assemble;
use crate::start::assemble::Govern;
use crate::start::joined::JoinedTable;
use glam::DVec3;
use metachron_contact::detect::ClusterScene;
use metachron_core::{AgentId, SimTime, Snapshot};
use metachron_runtime::{
    AgentHandle, AgentState, AgentStats, Agents, Lockstep, Pool, Run, STALLED_FOR_GOOD, SystemClock, Threads, Timeline,
    TimelineCommand, state_hash, wait_until,
};
use std::convert::Infallible;
use std::sync::atomic::{
    AtomicBool, AtomicU64,
    Ordering::{Acquire, Release},
};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A running world. Clones are the same world; every method takes `&self`.
///
/// Its time stands until [`World::advance`] or [`World::drive`] lets it pass.
#[derive(Clone)]
pub struct World {
    pub(super) shared: Arc<Shared>,
}

pub(super) struct Shared {
    tag: WorldTag,
    state: CallLock<State>,
    agents: Agents,
    /// How many agents the scene has, and the parts that joined since, in the order of their numbers.
    pub of_scene: usize,
    pub joined: Arc<JoinedTable>,
    /// Gravity, m/s²: also of objects that join it.
    pub gravity: DVec3,
    /// The static solids and joints.
    pub surroundings: Arc<ClusterScene>,
    instruments: Instruments,
    /// Where its time stood when it was last let pass or had passed.
    seen: Mutex<Present>,
    /// It was stopped while a step in lockstep did not end: the next caller that has it ends it.
    is_ending: AtomicBool,
    executor: ExecutorKind,
    /// The identity by which checkpoints of its scene are known again.
    pub identity: SceneIdentity,
    /// The clock of executors in real time.
    pub clock: Arc<SystemClock>,
    /// How often it was put back into the state of a checkpoint.
    pub put_back: AtomicU64,
    /// The record that is written of it, or followed.
    pub log: Arc<Log>,
}

impl std::fmt::Debug for World {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("World").field("tag", &self.shared.tag).finish_non_exhaustive()
    }
}

/// The run that makes agents step, or where its time stood when it ended.
pub(super) enum State {
    Running(Box<dyn Run>),
    Stopped(Stopped),
}

/// Where the time of a world stands.
#[derive(Clone, Copy)]
pub(super) struct Present {
    now: Duration,
    time: SimTime,
    timeline: Timeline,
}

impl Present {
    fn of(run: &dyn Run) -> Self {
        Self { now: run.now(), time: run.sim_now(), timeline: run.timeline() }
    }
}

/// So often a waiter finds that a step lasts too long before it gives up: a suspension of the whole machine counts as one look.
const LOOKS: u32 = 4;

/// Where the time of a world stood when it ended.
pub(super) struct Stopped {
    present: Present,
    /// The outcome of the recording that ended with it, until somebody asks; whether there was one.
    pub recorded: Option<Result<bool, RecordError>>,
}

impl State {
    /// That of a world whose `run` has ended.
    pub fn stopped(run: &dyn Run, recorded: Option<Result<bool, RecordError>>) -> Self {
        Self::Stopped(Stopped { present: Present::of(run), recorded })
    }
}

/// The parts of a world besides its run.
pub(super) struct Setting {
    pub surroundings: Arc<ClusterScene>,
    pub clock: Arc<SystemClock>,
    pub log: Arc<Log>,
    pub joined: Arc<JoinedTable>,
}

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
        let priority = scene.priority;
        let mut run: Box<dyn Run> = match executor {
            ExecutorKind::Threads => Box::new(Threads::start(spawns, clock.clone(), priority)?),
            ExecutorKind::Auto | ExecutorKind::Pool => Box::new(Pool::start(spawns, clock.clone(), priority)?),
            ExecutorKind::Lockstep => Box::new(Lockstep::start(spawns, assemble::machine(scene))?),
        };
        if executor != ExecutorKind::Lockstep {
            run.drive(TimelineCommand::Pause);
        }
        scene.stall_limit.into_iter().for_each(|limit| run.set_stall_limit(limit));
        Ok(Self::of_run(scene, executor, run, Setting { surroundings, clock, log, joined: Arc::default() }))
    }

    /// The world of a run of the agents of `scene`.
    pub(super) fn of_run(scene: &Scene, executor: ExecutorKind, run: Box<dyn Run>, setting: Setting) -> Self {
        let Setting { surroundings, clock, log, joined } = setting;
        let (agents, gravity, identity) = (run.agents().clone(), scene.gravity, SceneIdentity::of(scene));
        let seen = Mutex::new(Present::of(&*run));
        let (tag, state) = (WorldTag::new(), CallLock::new(State::Running(run)));
        let instruments = Instruments::of(scene);
        let shared = Shared {
            tag,
            state,
            agents,
            of_scene: scene.agents.len(),
            joined,
            gravity,
            surroundings,
            instruments,
            seen,
            is_ending: AtomicBool::new(false),
            executor,
            identity,
            clock,
            put_back: AtomicU64::new(0),
            log,
        };
        Self { shared: Arc::new(shared) }
    }

    /// The object of that name.
    ///
    /// # Errors
    /// [`WorldError::NoObject`].
    pub fn object(&self, name: impl AsRef<str>) -> Result<Object, WorldError> {
        let name = name.as_ref();
        let living = |agent: &&AgentHandle| agent.name() == name && agent.state() != AgentState::Gone;
        let found = self.shared.agents.iter().find(living);
        found
            .map(|agent| self.shared.tag.object(agent.id()))
            .ok_or_else(|| WorldError::NoObject { name: name.to_owned(), known: self.names() })
    }

    /// The names of its objects as a message lists them: the first twenty.
    fn names(&self) -> String {
        let mut names =
            self.shared.agents.iter().filter(|agent| agent.state() != AgentState::Gone).map(AgentHandle::name);
        let first: Vec<_> = names.by_ref().take(20).collect();
        let further = match names.count() {
            0 => String::new(),
            count => format!(" and {count} more"),
        };
        format!("{}{further}", first.join(", "))
    }

    /// The objects of these names.
    ///
    /// # Errors
    /// [`WorldError::NoObject`] for the first that there is not.
    pub fn objects<const N: usize>(&self, names: [impl AsRef<str>; N]) -> Result<[Object; N], WorldError> {
        let all: Vec<_> = names.iter().map(|name| self.object(name)).collect::<Result<_, _>>()?;
        all.try_into().map_err(|_| WorldError::Foreign)
    }

    /// All objects that are there, the scene's first, in the order in which they joined.
    pub fn all_objects(&self) -> impl Iterator<Item = Object> {
        let present = self.shared.agents.iter().filter(|agent| agent.state() != AgentState::Gone);
        present.map(|agent| self.shared.tag.object(agent.id()))
    }

    /// The name of an object, also of one that was removed, or of a fixed solid.
    ///
    /// # Errors
    /// [`WorldError::Foreign`].
    pub fn name(&self, of: impl Into<Touched>) -> Result<&str, WorldError> {
        match of.into() {
            Touched::Object(object) => self.known(object).map(AgentHandle::name),
            Touched::Fixed(number) => {
                let name = self.instruments().fixed_names.get(number as usize);
                name.map(|name| &**name).ok_or(WorldError::Foreign)
            }
        }
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
        let agent = self.known(object)?;
        agent.latest_present().ok_or_else(|| gone(agent))
    }

    /// Events of its objects from now on.
    #[must_use]
    pub fn events(&self, filter: EventFilter) -> Events {
        Events::new(self.clone(), filter)
    }

    /// All objects at one moment, so many times a second from now on; time passes meanwhile. Once a second where `rate_hz` is no number of frames a
    /// second: zero, negative, not finite, or above a thousand million.
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
        self.present().time
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

    /// Wall time since the start; virtual in lockstep, and there as [`World::time`] while another thread lets it pass.
    #[must_use]
    pub fn now(&self) -> Duration {
        self.present().now
    }

    /// Waits until the wall time `until`, while the agents run; returns at once if that has passed. In lockstep as [`World::advance`].
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

    /// The timeline in force; in lockstep as [`World::time`] while another thread lets it pass.
    #[must_use]
    pub fn timeline(&self) -> Timeline {
        self.present().timeline
    }

    /// Where its time stands; it does not wait for a call that lets it pass.
    fn present(&self) -> Present {
        let is_virtual = self.executor() == ExecutorKind::Lockstep;
        let state = if is_virtual { self.shared.state.try_lock() } else { self.state().ok() };
        match state.as_deref() {
            Some(State::Running(run)) => Present::of(&**run),
            Some(State::Stopped(stopped)) => stopped.present,
            None => *self.seen(),
        }
    }

    /// Changes the flow of time: pause, run, speed, single step.
    pub fn drive(&self, drive: TimelineCommand) {
        if self.executor() == ExecutorKind::Lockstep {
            return self.with_run(|| Entry::Drive(drive), |run| run.drive(drive));
        }
        let Some(mut state) = self.state_for_good() else { return };
        let State::Running(run) = &mut *state else { return };
        self.see(run.as_ref());
        let note = |log: &mut Mode, timeline: &Timeline| log.note(|| Entry::Timeline(*timeline));
        let act = || {
            run.drive(drive);
            run.timeline()
        };
        self.in_order(act, note);
        self.see(run.as_ref());
    }

    /// Ends the run for all clones: waits for the turns in progress (boundedly) and returns the metrics of every agent. A recording ends with
    /// these turns, in the states that are final; [`World::end_recording`] gives its outcome. Latest states stay
    /// readable. An object whose step does not end is parked; where that keeps another thread in lockstep, the
    /// recording ends where its step does.
    pub fn stop(&self) -> Vec<AgentStats> {
        loop {
            match self.state() {
                Ok(mut state) => return self.end(&mut state),
                Err(_) if self.agents().end_stalled() => {
                    self.shared.is_ending.store(true, Release);
                    return self.agents().iter().map(AgentHandle::stats).collect();
                }
                // it has ended meanwhile
                Err(_) => {}
            }
        }
    }

    fn end(&self, state: &mut State) -> Vec<AgentStats> {
        let State::Running(run) = state else {
            return self.shared.agents.iter().map(AgentHandle::stats).collect();
        };
        run.end_turns();
        let ended = State::stopped(run.as_ref(), Some(self.close_recording()));
        match std::mem::replace(state, ended) {
            State::Running(run) => run.shutdown(),
            State::Stopped(_) => unreachable!("it ran a moment ago, and the lock is held"),
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
        let agent = self.known(object)?;
        if agent.state() == AgentState::Gone { Err(gone(agent)) } else { Ok(agent) }
    }

    /// The agent of an object, there or not.
    fn known(&self, object: Object) -> Result<&AgentHandle, WorldError> {
        let known = self.shared.agents.of(object.id()).filter(|_| object.is_of(self.shared.tag));
        known.ok_or(WorldError::Foreign)
    }

    /// How often it was put back into the state of a checkpoint.
    pub(super) fn rewinds(&self) -> u64 {
        self.shared.put_back.load(Acquire)
    }

    pub(super) fn has_stopped(&self) -> bool {
        let is_stopped = |state: CallGuard<'_, State>| matches!(*state, State::Stopped(_));
        self.shared.is_ending.load(Acquire) || self.shared.state.try_lock().is_some_and(is_stopped)
    }

    /// [`Log::in_order`] for a caller that has the run.
    pub(super) fn in_order<T>(&self, act: impl FnOnce() -> T, note: impl FnOnce(&mut Mode, &T)) -> T {
        let Ok(done) = self.shared.log.in_order(|| Ok::<_, Infallible>(()), act, note);
        done
    }

    /// Waits in lockstep until no call lets time pass: a recording there has the order of calls alone.
    pub(super) fn between_calls(&self) -> Result<Option<CallGuard<'_, State>>, Waited> {
        (self.executor() == ExecutorKind::Lockstep).then(|| self.state()).transpose()
    }

    /// Does something with a world in lockstep that runs; nothing with one that was stopped.
    fn with_run(&self, entry: impl FnOnce() -> Entry, act: impl FnOnce(&mut dyn Run)) {
        if let Some(mut state) = self.state_for_good()
            && let State::Running(run) = &mut *state
        {
            self.let_pass(run.as_mut(), entry, act);
        }
    }

    /// The same for a caller that has the run.
    pub(super) fn let_pass(&self, run: &mut dyn Run, entry: impl FnOnce() -> Entry, act: impl FnOnce(&mut dyn Run)) {
        self.shared.log.note(entry);
        self.see(run);
        act(run);
        self.see(run);
    }

    /// Notes the time for callers that ask while it passes.
    pub(super) fn see(&self, run: &dyn Run) {
        *self.seen() = Present::of(run);
    }

    fn seen(&self) -> MutexGuard<'_, Present> {
        self.shared.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The run, once no other call has it. In lockstep a call is waited for as long as its turns end in time.
    ///
    /// # Errors
    /// The agent whose step has lasted too long.
    pub(super) fn state(&self) -> Result<CallGuard<'_, State>, Waited> {
        self.state_within(Duration::ZERO)
    }

    /// As [`Self::state`], for calls that can say nothing: they wait for a step as long as [`World::advance`] does on threads.
    pub(super) fn state_for_good(&self) -> Option<CallGuard<'_, State>> {
        self.state_within(STALLED_FOR_GOOD).ok()
    }

    fn state_within(&self, patience: Duration) -> Result<CallGuard<'_, State>, Waited> {
        let (agents, mut looks) = (self.agents(), 0);
        let waited = || {
            let agent = agents.stalled_on_caller().and_then(|id| agents.of(id));
            looks = if agent.is_some() { looks + 1 } else { 0 };
            let (agent, lasts) = agent.filter(|_| looks >= LOOKS).map(|agent| (agent, agent.stalled_for()))?;
            (lasts >= patience).then(|| Waited { name: agent.name().to_owned(), lasts })
        };
        let mut state = self.shared.state.lock(waited)?;
        if self.shared.is_ending.load(Acquire) {
            self.end(&mut state);
        }
        Ok(state)
    }
}

fn gone(agent: &AgentHandle) -> WorldError {
    WorldError::Gone { name: agent.name().to_owned() }
}
