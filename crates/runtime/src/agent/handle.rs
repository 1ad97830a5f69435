//! Handle of a running agent: its newest state, its metrics, its commands.
//!
//! Out: snapshots and numbers, without ever waiting for the agent. In: commands. Never here: the agent itself.

use super::agent_record::{AgentRecord, Live};
use super::form_slot::FormSlot;
use crate::commands::mailbox::{AwaitedMotion, Command, Keyed, Mailbox, SendError};
use crate::lock_free::ring::{Ring, RingEntry};
use crate::lock_free::sleep::SleepRegistry;
use crate::lock_free::slot::LatestSlot;
use crate::records::events::{AgentEvent, EventKind};
use crate::records::histogram::Histogram;
use crate::records::histogram::Percentiles;
use crate::records::metrics::{AgentState, AgentStats, Metrics, REMOVED};
use crate::records::probe::{Sample, Trace};
use crate::records::streams::{EventStreams, Rings, StreamReader};
use crate::records::turns::Turn;
use metachron_contact::detect::ClusterScene;
use metachron_contact::member::CallMark;
use metachron_contact::{Input, Inputs, Law};
use metachron_core::{AgentId, Body, HASH_START, SimSpan, SimTime, Snapshot};
use metachron_geometry::CollisionShape;
use std::any::Any;
use std::borrow::Cow;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Data shared by an agent and its observers.
#[derive(Debug)]
pub(crate) struct Shared {
    pub id: AgentId,
    pub identity: Identity,
    /// The laws of its pairs that are not [`Law::Cluster`], by rising numbers of the peers.
    pub laws: Box<[(AgentId, Law)]>,
    /// Whether code of its model runs.
    pub calls: CallMark,
    pub gauges: Metrics,
    /// Its contact shape; `None` where nothing can touch it.
    pub form: FormSlot,
    pub mail: Mailbox,
    pub streams: EventStreams,
    pub slot: Arc<LatestSlot<Snapshot>>,
    pub sleep: Arc<SleepRegistry>,
    /// Used by readers only: the agent never waits for this lock.
    pub ages: Mutex<Option<Box<Histogram>>>,
    /// Empty for most agents. Only the agent writes, so that it never waits during the run; readers read at the end.
    pub traces: Box<[Mutex<Trace>]>,
}

/// Which agent has a number: it never changes.
#[derive(Debug)]
pub(crate) struct Identity {
    pub name: Arc<str>,
    pub model: &'static str,
    pub wanted_hz: f64,
    /// No step of it is longer.
    pub dt_max: SimSpan,
    /// Where its joints are, if there is one whose first body it is and that can have a motor.
    pub motored: Option<Arc<ClusterScene>>,
    /// The kinds of users' inputs that it takes ([`metachron_contact::Agent::inputs`]).
    pub inputs: Inputs,
    /// Whether the run began with it. Nothing outside can make such an agent again as it was, with its governor and its ties: where it leaves it
    /// keeps them and its model, and comes back with a state that is read.
    pub is_first: bool,
    /// Entry for agents that it is to lead, and the place to which it returns from a leader, of a type that only clusters know
    /// ([`crate::cluster::Handover`]); `None` where no agent can be led.
    pub handover: Option<Box<dyn Any + Send + Sync>>,
}

impl Shared {
    pub fn name(&self) -> &str {
        &self.identity.name
    }

    pub const fn model(&self) -> &'static str {
        self.identity.model
    }

    /// Requested steps per simulated second.
    pub const fn wanted_hz(&self) -> f64 {
        self.identity.wanted_hz
    }

    pub const fn inputs(&self) -> Inputs {
        self.identity.inputs
    }

    /// Whether the run began with it.
    pub const fn is_first(&self) -> bool {
        self.identity.is_first
    }

    /// Whether it has left and nothing of it is kept: an agent that joined the run is made again where it comes back.
    pub fn is_forgotten(&self) -> bool {
        self.gauges.has_left() && !self.is_first()
    }

    /// The numbers of the joints that it drives.
    fn driven(&self) -> impl Iterator<Item = u32> + '_ {
        let joints = self.identity.motored.iter().flat_map(|scene| scene.joints_of(self.id));
        joints.filter(|(_, joint)| joint.takes_motor()).map(|(number, _)| number)
    }

    /// Checks that it takes these inputs, now.
    fn check_takes(&self, needs: Inputs) -> Result<(), SendError> {
        let Identity { name, model, inputs, .. } = &self.identity;
        if self.sleep.has_ended() {
            return Err(SendError::Ended(Arc::clone(name)));
        }
        match inputs.lacks(needs) {
            Some(lacks) => {
                let model = Cow::Borrowed(*model);
                Err(SendError::NotTaken { name: Arc::clone(name), model, lacks, takes: *inputs })
            }
            None => Ok(()),
        }
    }

    fn ages(&self) -> MutexGuard<'_, Option<Box<Histogram>>> {
        self.ages.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn stats(&self) -> AgentStats {
        let Self { gauges, identity, .. } = self;
        let newest = self.slot.latest();
        let span = |nanos: &std::sync::atomic::AtomicU64| SimSpan::from_nanos(nanos.load(Relaxed));
        AgentStats {
            id: self.id,
            name: Arc::clone(&identity.name),
            model: identity.model,
            steps: gauges.steps.load(Relaxed),
            rate_hz: if gauges.is_running() { gauges.rate_hz.get() } else { 0.0 },
            mean_hz: gauges.mean_hz.get(),
            wanted_hz: identity.wanted_hz,
            dt: span(&gauges.dt),
            resolution: newest.resolution,
            nodes: newest.nodes,
            work_s: gauges.work_s.get(),
            turn_s: gauges.turn_s.get(),
            work: gauges.work.get(),
            cpu_s: gauges.cpu_s(),
            age: self.ages().as_ref().map_or_else(Percentiles::default, |ages| ages.percentiles()),
            late: gauges.late(),
            misses: gauges.misses.load(Relaxed),
            lived: span(&gauges.stepped) + span(&gauges.rested),
            lengthened: gauges.lengthened.load(Relaxed),
            under_resolved: gauges.under_resolved.load(Relaxed),
            dropped: span(&gauges.dropped),
            rested: span(&gauges.rested),
            state: gauges.state(),
            energy_j: newest.energy_j,
            residual_m: newest.residual_m,
            drift_m: newest.drift_m,
            led_by: self.sleep.led_by(self.id),
        }
    }
}

/// A running agent, seen from outside. Copies refer to the same agent; they outlive the run and then show its final state.
#[derive(Debug, Clone)]
pub struct AgentHandle {
    pub(crate) record: Arc<AgentRecord>,
}

impl AgentHandle {
    /// That of an agent that begins.
    pub(crate) fn of(shared: &Arc<Shared>) -> Self {
        Self { record: Arc::new(AgentRecord::of(shared)) }
    }

    /// The agent; `None` of one that has left and is not kept.
    pub(crate) fn live(&self) -> Option<Live> {
        self.record.live()
    }

    /// Whether it has left.
    pub(crate) fn has_left(&self) -> bool {
        self.record.has_left()
    }

    /// Its number: its place in the list at the start.
    #[must_use]
    pub fn id(&self) -> AgentId {
        self.record.id
    }

    /// Its name in the scene.
    #[must_use]
    pub fn name(&self) -> &str {
        self.record.name()
    }

    /// Its model.
    #[must_use]
    pub fn model(&self) -> &'static str {
        self.live().map_or(REMOVED, |shared| shared.model())
    }

    /// The kinds of users' inputs that it takes; nothing once it has left.
    #[must_use]
    pub fn inputs(&self) -> Inputs {
        self.live().map_or(Inputs::NONE, |shared| shared.inputs())
    }

    /// Its newest state. There is one from the start on.
    #[must_use]
    pub fn latest(&self) -> Arc<Snapshot> {
        self.record.slot.latest()
    }

    /// The scene time up to which it has lived: that of its newest state, or of its last waking, if that is later.
    #[must_use]
    pub fn lived_to(&self) -> SimTime {
        let woken_at = self.live().map_or(0, |shared| shared.gauges.woken_at.load(Relaxed));
        self.latest().moment().max(SimTime::from_nanos(woken_at))
    }

    /// The simulated time that it has not lived, where time is at `now`: its dropped time and its lag. Zero of one that
    /// has failed or left.
    #[must_use]
    pub fn given_up(&self, now: SimTime) -> SimSpan {
        let Some(shared) = self.live() else { return SimSpan::ZERO };
        let dropped = SimSpan::from_nanos(shared.gauges.dropped.load(Relaxed));
        match shared.gauges.state() {
            AgentState::Running | AgentState::Stalled => dropped + now.since(self.lived_to()),
            AgentState::Resting => dropped,
            AgentState::Parked(_) | AgentState::Gone => SimSpan::ZERO,
        }
    }

    /// Its newest state; `None` where it has left.
    #[must_use]
    pub fn latest_present(&self) -> Option<Arc<Snapshot>> {
        (!self.has_left()).then(|| self.latest())
    }

    /// Age of `snapshot` at the simulated time `now`, seconds, ≥ 0.
    ///
    /// Zero for a state that covers `now` (one that is on time does), and for the state of an agent at rest: it is still valid.
    #[must_use]
    pub fn age_s(&self, snapshot: &Snapshot, now: SimTime) -> f64 {
        if self.live().is_some_and(|shared| shared.gauges.is_resting()) {
            0.0
        } else {
            now.since(snapshot.moment()).as_secs_f64()
        }
    }

    /// Counts the age of a state that was used, seconds ([`Self::age_s`]); invalid ages are ignored.
    pub fn record_age(&self, age_s: f64) {
        if let (Ok(age), Some(shared)) = (Duration::try_from_secs_f64(age_s), self.live()) {
            shared.ages().get_or_insert_default().record(age);
        }
    }

    /// Counts several ages.
    pub(super) fn record_ages(&self, ages: impl Iterator<Item = SimSpan>) {
        let Some(shared) = self.live() else { return };
        let mut ages_so_far = shared.ages();
        let counted = ages_so_far.get_or_insert_default();
        ages.for_each(|age| counted.record(Duration::from_nanos(age.as_nanos())));
    }

    /// Counts a state that covered the present in so many frames.
    pub(super) fn record_no_age(&self, frames: usize) {
        let Some(shared) = self.live() else { return };
        shared.ages().get_or_insert_default().record_often(Duration::ZERO, u16::try_from(frames).unwrap_or(u16::MAX));
    }

    /// The leader of the cluster in which it steps; `None` if it makes its own turns.
    #[must_use]
    pub fn led_by(&self) -> Option<AgentId> {
        self.live()?.sleep.led_by(self.id())
    }

    /// Whether it was woken, and has not made a turn since.
    #[must_use]
    pub fn is_woken(&self) -> bool {
        self.live().is_some_and(|shared| shared.sleep.is_woken(self.id()))
    }

    /// Its newest contact shape; `None` where nothing can touch it. It is another one, with the same kind, traits and vertices, where matter was
    /// taken out of it ([`Command::Carve`]).
    #[must_use]
    pub fn form(&self) -> Option<Arc<CollisionShape>> {
        self.live()?.form.latest()
    }

    /// State of its execution.
    #[must_use]
    pub fn state(&self) -> AgentState {
        self.judged().map_or(AgentState::Gone, |shared| shared.gauges.state())
    }

    /// The agent, once the turn in progress on a caller's thread is judged.
    fn judged(&self) -> Option<Live> {
        self.live().inspect(|shared| {
            shared.sleep.callers_turn.judge();
        })
    }

    /// How long its turn has lasted, wall time; zero where it is not stalled ([`AgentState::Stalled`]).
    #[must_use]
    pub fn stalled_for(&self) -> Duration {
        let stalled = self.judged().filter(|shared| shared.gauges.is_stalled());
        stalled.map_or(Duration::ZERO, |shared| shared.gauges.stalled_for())
    }

    /// The length of its steps, nanoseconds.
    pub(crate) fn dt_ns(&self) -> u64 {
        self.live().map_or(0, |shared| shared.gauges.dt.load(Relaxed))
    }

    /// Sends a command to the agent; it obeys at its next turn, and wakes for it.
    ///
    /// # Errors
    /// [`SendError`]: nothing was delivered.
    pub fn send(&self, command: Command) -> Result<(), SendError> {
        let shared = self.present()?;
        shared.check_takes(command.needs())?;
        if let Command::Motor(Keyed { key: joint, .. }) = command
            && !shared.driven().any(|driven| driven == joint)
        {
            let (name, drives) = (Arc::clone(&shared.identity.name), shared.driven().collect());
            return Err(SendError::NoMotor { name, joint, drives });
        }
        shared.mail.send(command)?;
        shared.sleep.wake(self.id());
        Ok(())
    }

    /// Lets it take another state before its next step, and wakes it; a state that does not fit changes nothing.
    ///
    /// # Errors
    /// The errors of [`Self::send`].
    pub fn set_state(&self, state: Body) -> Result<(), SendError> {
        let shared = self.present()?;
        shared.check_takes(Inputs::of(&[Input::State]))?;
        shared.mail.set_state(state)?;
        shared.sleep.wake(self.id());
        Ok(())
    }

    /// The state, place and motion that it takes before its next step.
    #[must_use]
    pub fn awaited_motion(&self) -> AwaitedMotion {
        self.live().map_or_else(AwaitedMotion::default, |shared| shared.mail.awaited_motion())
    }

    /// The agent, unless it has left.
    fn present(&self) -> Result<Live, SendError> {
        self.live().filter(|_| !self.has_left()).ok_or(SendError::NoAgent(self.id()))
    }

    /// Lets it leave the run at its next turn.
    pub(crate) fn leave(&self) {
        if let Some(shared) = self.live() {
            shared.mail.leave();
            shared.sleep.wake(self.id());
        }
    }

    /// Begins to keep its events for a reader.
    #[must_use]
    pub fn listen(&self) -> StreamReader {
        let stalls = self.live().map_or(0, |shared| shared.gauges.stalls.load(Relaxed));
        let mut reader = self.listen_to(|rings| &rings.events);
        reader.stalls = stalls;
        reader
    }

    /// Passes its events that a reader has not heard on to `take`; returns how many were lost: an agent keeps the newest
    /// [`crate::EVENTS_KEPT`].
    pub fn read_events(&self, reader: &mut StreamReader, mut take: impl FnMut(AgentEvent)) -> u64 {
        let lost = self.read(reader, |rings| &rings.events, &mut take);
        let stalls = self.judged().map_or(reader.stalls, |shared| shared.gauges.stalls.load(Relaxed));
        for _ in reader.stalls..stalls {
            take(AgentEvent { at: self.latest().time, kind: EventKind::Stalled });
        }
        reader.stalls = stalls;
        lost
    }

    /// Begins to keep its turns for a reader.
    #[must_use]
    pub fn listen_to_turns(&self) -> StreamReader {
        self.listen_to(|rings| &rings.turns)
    }

    /// Passes its turns that a reader has not heard on to `take`; returns how many were lost: an agent keeps the newest
    /// [`crate::TURNS_KEPT`].
    pub fn read_turns(&self, reader: &mut StreamReader, take: impl FnMut(Turn)) -> u64 {
        self.read(reader, |rings| &rings.turns, take)
    }

    fn listen_to<E: RingEntry>(&self, of: fn(&Rings) -> &Ring<E>) -> StreamReader {
        self.live().map_or_else(StreamReader::default, |shared| shared.streams.listen(of))
    }

    fn read<E: RingEntry>(&self, reader: &mut StreamReader, of: fn(&Rings) -> &Ring<E>, take: impl FnMut(E)) -> u64 {
        // looked up first: an agent that has left by then has pushed all its events before
        let live = self.live();
        reader.read(live.as_ref().map(|shared| &shared.streams), of, take)
    }

    /// CPU time of its turns so far, seconds; updated about twice a second on threads.
    #[must_use]
    pub fn cpu_s(&self) -> f64 {
        self.live().map_or(0.0, |shared| shared.gauges.cpu_s())
    }

    /// Samples of the point watched as number `watch`; empty if there is none. To be read when the run has ended: until then reading may
    /// block the agent.
    #[must_use]
    pub fn samples(&self, watch: usize) -> Vec<Sample> {
        let live = self.live();
        let trace = live.as_ref().and_then(|shared| shared.traces.get(watch));
        let trace = trace.map(|trace| trace.lock().unwrap_or_else(PoisonError::into_inner));
        trace.map_or_else(Vec::new, |trace| trace.samples().to_vec())
    }

    /// Steps taken.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.live().map_or(0, |shared| shared.gauges.steps.load(Relaxed))
    }

    /// Its statistics so far. Reading the percentiles of its ages takes microseconds: for a table, not for every draw call.
    #[must_use]
    pub fn stats(&self) -> AgentStats {
        self.judged().map_or_else(|| AgentStats::of_removed(self.id(), self.record.name()), |shared| shared.stats())
    }
}

/// Hash of the newest states of all `agents` that have not left, in their order: equal numbers mean bit-identical states.
#[must_use]
pub fn state_hash<'a>(agents: impl IntoIterator<Item = &'a AgentHandle>) -> u64 {
    let present = agents.into_iter().filter(|agent| !agent.has_left());
    present.fold(HASH_START, |hash, agent| agent.latest().fold_hash(hash))
}
