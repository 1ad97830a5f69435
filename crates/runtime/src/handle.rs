//! Handle of a running agent: its newest state, its metrics, its commands.
//!
//! Out: snapshots and numbers, without ever waiting for the agent. In: commands. Never here: the agent itself.

use super::cluster::Handover;
use super::events::AgentEvent;
use super::form_slot::FormSlot;
use super::histogram::Histogram;
use super::mailbox::{Command, Keyed, Mailbox, SendError};
use super::metrics::{AgentState, AgentStats, Metrics};
use super::probe::{Sample, Trace};
use super::removed_agent::REMOVED;
use super::ring::Ring;
use super::sleep::SleepRegistry;
use super::slot::LatestSlot;
use super::spawn::AgentSpawn;
use super::turns::Turn;
use metachron_contact::stepper::ClusterScene;
use metachron_core::{AgentId, Body, HASH_START, SimSpan, SimTime, Snapshot};
use metachron_geometry::CollisionShape;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

/// Data shared by an agent and its observers.
#[derive(Debug)]
pub(super) struct Shared {
    pub id: AgentId,
    /// Unset where nothing more is known than that it has left; a state that is read may tell later ([`super::archive`]).
    pub identity: OnceLock<Identity>,
    pub gauges: Metrics,
    /// Its contact shape; `None` where nothing can touch it.
    pub form: FormSlot,
    pub mail: Mailbox,
    pub streams: EventStreams,
    pub slot: Arc<LatestSlot<Snapshot>>,
    pub sleep: Arc<SleepRegistry>,
    /// Used by readers only: the agent never waits for this lock.
    pub ages: Mutex<Histogram>,
    /// Empty for most agents. Only the agent writes, so that it never waits during the run; readers read at the end.
    pub traces: Vec<Mutex<Trace>>,
}

/// Which agent has a number: it never changes.
#[derive(Debug)]
pub(super) struct Identity {
    pub name: Arc<str>,
    pub model: &'static str,
    pub wanted_hz: f64,
    /// Where its joints are, if there is one whose first body it is and that can have a motor.
    pub motored: Option<Arc<ClusterScene>>,
    /// Whether poses lead it ([`metachron_contact::Agent::takes_poses`]).
    pub takes_poses: bool,
    /// Whether the run began with it. Nothing outside can make such an agent again as it was, with its governor and its ties: where it leaves it
    /// keeps them and its model, and comes back with a state that is read.
    pub is_first: bool,
    /// Entry for agents that it is to lead, and the place to which it returns from a leader; `None` where no agent can be led.
    pub handover: Option<Handover>,
}

impl Identity {
    /// That of the agent that is to be started, whose name it takes.
    pub fn of(id: AgentId, spawn: &mut AgentSpawn, is_first: bool) -> Self {
        let is_motored = spawn.scene.joints_of(id).any(|(_, joint)| joint.takes_motor());
        Self {
            name: std::mem::take(&mut spawn.name).into(),
            model: spawn.agent.model(),
            wanted_hz: spawn.rate_hz,
            motored: is_motored.then(|| Arc::clone(&spawn.scene)),
            takes_poses: spawn.agent.takes_poses(),
            is_first,
            handover: spawn.agent.member().is_some().then(Handover::default),
        }
    }
}

impl Shared {
    pub fn name(&self) -> &str {
        self.identity.get().map_or("", |identity| &identity.name)
    }

    pub fn model(&self) -> &'static str {
        self.identity.get().map_or(REMOVED, |identity| identity.model)
    }

    /// Requested steps per simulated second.
    pub fn wanted_hz(&self) -> f64 {
        self.identity.get().map_or(1.0, |identity| identity.wanted_hz)
    }

    pub fn takes_poses(&self) -> bool {
        self.identity.get().is_some_and(|identity| identity.takes_poses)
    }

    /// Whether the run began with it.
    pub fn is_first(&self) -> bool {
        self.identity.get().is_some_and(|identity| identity.is_first)
    }

    fn has_motor(&self, joint: u32) -> bool {
        let scene = self.identity.get().and_then(|identity| identity.motored.as_ref());
        let mut joints = scene.into_iter().flat_map(|scene| scene.joints_of(self.id));
        joints.any(|(number, it)| number == joint && it.takes_motor())
    }

    pub fn handover(&self) -> Option<&Handover> {
        self.identity.get()?.handover.as_ref()
    }
}

/// What an agent tells readers; there is nothing of it before the first of them.
#[derive(Debug, Default)]
pub(super) struct EventStreams(OnceLock<Box<Rings>>);

#[derive(Debug, Default)]
struct Rings {
    events: Ring<AgentEvent>,
    turns: Ring<Turn>,
}

impl EventStreams {
    fn rings(&self) -> &Rings {
        self.0.get_or_init(Box::default)
    }

    /// Tells of an event, from one thread at a time.
    pub fn event(&self, event: &AgentEvent) {
        self.0.get().into_iter().for_each(|rings| rings.events.push(event));
    }

    /// Tells of a turn, from one thread at a time.
    pub fn turn(&self, turn: impl FnOnce() -> Turn) {
        if let Some(rings) = self.0.get().filter(|rings| rings.turns.is_heard()) {
            rings.turns.push(&turn());
        }
    }
}

/// A running agent, seen from outside. Copies refer to the same agent; they outlive the run and then show its final state.
#[derive(Debug, Clone)]
pub struct AgentHandle {
    pub(super) shared: Arc<Shared>,
}

impl AgentHandle {
    /// Its number: its place in the list at the start.
    #[must_use]
    pub fn id(&self) -> AgentId {
        self.shared.id
    }

    /// Its name in the scene.
    #[must_use]
    pub fn name(&self) -> &str {
        self.shared.name()
    }

    /// Its model.
    #[must_use]
    pub fn model(&self) -> &'static str {
        self.shared.model()
    }

    /// Whether it is kinematic: poses lead it, and no force moves it.
    #[must_use]
    pub fn takes_poses(&self) -> bool {
        self.shared.takes_poses()
    }

    /// Its newest state. There is one from the start on.
    #[must_use]
    pub fn latest(&self) -> Arc<Snapshot> {
        self.shared.slot.latest()
    }

    /// Age of `snapshot` at the simulated time `now`, seconds, ≥ 0.
    ///
    /// Zero for a state that covers `now` (one that is on time does), and for the state of an agent at rest: it is still valid.
    #[must_use]
    pub fn age_s(&self, snapshot: &Snapshot, now: SimTime) -> f64 {
        if self.shared.gauges.is_resting() { 0.0 } else { now.since(snapshot.moment()).as_secs_f64() }
    }

    /// Counts the age of a state that was used, seconds ([`Self::age_s`]); invalid ages are ignored.
    pub fn record_age(&self, age_s: f64) {
        if let Ok(age) = Duration::try_from_secs_f64(age_s) {
            self.ages().record(age);
        }
    }

    /// Counts several ages.
    pub(super) fn record_ages(&self, ages: impl Iterator<Item = SimSpan>) {
        let mut counted = self.ages();
        ages.for_each(|age| counted.record(Duration::from_nanos(age.as_nanos())));
    }

    /// Counts a state that covered the present in so many frames.
    pub(super) fn record_no_age(&self, frames: usize) {
        self.ages().record_often(Duration::ZERO, u16::try_from(frames).unwrap_or(u16::MAX));
    }

    fn ages(&self) -> MutexGuard<'_, Histogram> {
        self.shared.ages.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The leader of the cluster in which it steps; `None` if it makes its own turns.
    #[must_use]
    pub fn led_by(&self) -> Option<AgentId> {
        Some(self.shared.sleep.leader(self.shared.id)).filter(|leader| *leader != self.shared.id)
    }

    /// Whether it was woken, and has not made a turn since.
    #[must_use]
    pub fn is_woken(&self) -> bool {
        self.shared.sleep.is_woken(self.shared.id)
    }

    /// Its newest contact shape; `None` where nothing can touch it. It is another one, with the same kind, traits and vertices, where matter was
    /// taken out of it ([`Command::Carve`]).
    #[must_use]
    pub fn form(&self) -> Option<Arc<CollisionShape>> {
        self.shared.form.latest()
    }

    /// State of its execution.
    #[must_use]
    pub fn state(&self) -> AgentState {
        self.shared.gauges.state()
    }

    /// Sends a command to the agent; it obeys at its next turn, and wakes for it.
    ///
    /// # Errors
    /// [`SendError`]: nothing was delivered.
    pub fn send(&self, command: Command) -> Result<(), SendError> {
        if let Command::Motor(Keyed { key: joint, .. }) = command
            && !self.shared.has_motor(joint)
        {
            return Err(SendError::NoMotor { agent: self.id(), joint });
        }
        if matches!(command, Command::Pose(_)) && !self.shared.takes_poses() {
            return Err(SendError::NotKinematic(self.id()));
        }
        self.shared.mail.send(command)?;
        self.shared.sleep.wake(self.shared.id);
        Ok(())
    }

    /// Lets it take another state before its next step, and wakes it; a state that does not fit changes nothing.
    pub fn set_state(&self, state: Body) {
        self.shared.mail.set_state(state);
        self.shared.sleep.wake(self.shared.id);
    }

    /// Lets it leave the run at its next turn.
    pub(super) fn leave(&self) {
        self.shared.mail.leave();
        self.shared.sleep.wake(self.shared.id);
    }

    /// Begins to keep its events for readers; the number of the next one.
    pub fn listen(&self) -> u64 {
        self.shared.streams.rings().events.listen()
    }

    /// Passes its events from number `next` on to `take`; returns the number of the next one, and how many were lost: an agent keeps the
    /// newest [`crate::EVENTS_KEPT`].
    pub fn events_from(&self, next: u64, take: impl FnMut(AgentEvent)) -> (u64, u64) {
        self.shared.streams.rings().events.read(next, take)
    }

    /// Begins to keep its turns for readers; the number of the next one.
    pub fn listen_to_turns(&self) -> u64 {
        self.shared.streams.rings().turns.listen()
    }

    /// Passes its turns from number `next` on to `take`; returns the number of the next one, and how many were lost: an agent keeps the
    /// newest [`crate::TURNS_KEPT`].
    pub fn turns_from(&self, next: u64, take: impl FnMut(Turn)) -> (u64, u64) {
        self.shared.streams.rings().turns.read(next, take)
    }

    /// CPU time of its turns so far, seconds; updated about twice a second on threads.
    #[must_use]
    pub fn cpu_s(&self) -> f64 {
        self.shared.gauges.cpu_nanos.load(Relaxed) as f64 * 1e-9
    }

    /// Samples of the point watched as number `watch`; empty if there is none. To be read when the run has ended: until then reading may
    /// block the agent.
    #[must_use]
    pub fn samples(&self, watch: usize) -> Vec<Sample> {
        let trace = self.shared.traces.get(watch).map(|trace| trace.lock().unwrap_or_else(PoisonError::into_inner));
        trace.map_or_else(Vec::new, |trace| trace.samples().to_vec())
    }

    /// Steps taken.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.shared.gauges.steps.load(Relaxed)
    }

    /// Its statistics so far. Reading the percentiles of its ages takes microseconds: for a table, not for every draw call.
    #[must_use]
    pub fn stats(&self) -> AgentStats {
        let Shared { gauges, .. } = &*self.shared;
        let newest = self.latest();
        let span = |nanos: &std::sync::atomic::AtomicU64| SimSpan::from_nanos(nanos.load(Relaxed));
        AgentStats {
            id: self.shared.id,
            name: self.shared.identity.get().map_or_else(|| "".into(), |identity| Arc::clone(&identity.name)),
            model: self.shared.model(),
            steps: gauges.steps.load(Relaxed),
            rate_hz: if gauges.is_running() { gauges.rate_hz.get() } else { 0.0 },
            mean_hz: gauges.mean_hz.get(),
            wanted_hz: self.shared.wanted_hz(),
            dt: span(&gauges.dt),
            resolution: newest.resolution,
            nodes: newest.nodes,
            work_s: gauges.work_s.get(),
            turn_s: gauges.turn_s.get(),
            work: gauges.work.get(),
            cpu_s: self.cpu_s(),
            age: self.ages().spread(),
            late: gauges.late(),
            misses: gauges.misses.load(Relaxed),
            dropped: span(&gauges.dropped),
            rested: span(&gauges.rested),
            state: gauges.state(),
            energy_j: newest.energy_j,
            residual_m: newest.residual_m,
            drift_m: newest.drift_m,
            led_by: self.led_by(),
        }
    }
}

/// Hash of the newest states of all `agents` that have not left, in their order: equal numbers mean bit-identical states.
#[must_use]
pub fn state_hash<'a>(agents: impl IntoIterator<Item = &'a AgentHandle>) -> u64 {
    let present = agents.into_iter().filter(|agent| !agent.shared.gauges.has_left());
    present.fold(HASH_START, |hash, agent| agent.latest().fold_hash(hash))
}
