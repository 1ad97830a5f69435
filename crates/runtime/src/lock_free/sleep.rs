//! Sleep registry: which agents are at rest, and how they are woken.
//!
//! In: wakes and touches from any thread. Out: a flag per agent, and its thread unparked, or a wake-up of its pool.
//! An agent that is led has no turns of its own: waking it wakes its leader, and the leader rests for all agents it leads.
//! Never here: when an agent is due ([`crate::time::agent_clock`]), its commands ([`crate::commands::mailbox`]).
//!
//! Leaders have lower numbers than the agents they lead, so that the chain of leaders always ends.
//! No wake is lost: an agent that goes to rest raises `resting` first and reads `woken` and `touched` after; a caller that wakes it writes
//! these first and reads `resting` after. With a fence (SeqCst) between, at least one of the two sees the other.

use super::callers_turn::CallersTurnSlot;
use super::dirty_set::DirtySet;
use super::sync::Mutex;
use super::sync::atomic::{
    AtomicBool, AtomicU32, AtomicU64,
    Ordering::{AcqRel, Acquire, Relaxed, Release, SeqCst},
    fence,
};
use super::sync::thread::Thread;
use super::table::Table;
use super::worker_wakeup::WorkerWakeup;
use metachron_core::{AgentId, SimSpan, SimTime};
use std::sync::{OnceLock, PoisonError};
use std::time::Duration;

/// How long after the last touch an agent may not rest, simulated time: longer than the period of any touching agent above 10 Hz, so that
/// an agent does not go to rest between two touches.
const TOUCH_HOLD: SimSpan = SimSpan::from_nanos(100_000_000);

/// How long after an agent was far behind the others check for it, simulated time; and the least interval between two records of it.
const FAR_BEHIND_HOLD: SimSpan = SimSpan::from_nanos(2_000_000_000);
const FAR_BEHIND_NOTED: SimSpan = SimSpan::from_nanos(100_000_000);

/// How long the end of a run waits after the last thread that ended, and how many times that for a cluster, at most.
const END_PATIENCE: Duration = Duration::from_millis(400);
const END_PATIENCE_MAX: u32 = 25;

/// Why all turns are to end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Halt {
    /// The run ends: a step that does not is left behind.
    End,
    /// The run is cut, and goes on after it: each step in progress ends first.
    Cut,
}

/// The flags of one agent.
#[derive(Debug)]
struct Signal {
    resting: AtomicBool,
    woken: AtomicBool,
    /// Number of the agent that makes its turns; [`NO_AGENT`] if it makes them itself.
    leader: AtomicU32,
    /// It makes no more turns and accepts no agents to lead.
    closed: AtomicBool,
    /// Simulated nanoseconds of the last touch, plus one; zero for never.
    touched: AtomicU64,
    /// Changes only where a run goes on after a cut.
    thread: Mutex<Option<Thread>>,
}

/// Not the number of any agent.
const NO_AGENT: u32 = u32::MAX;

impl Default for Signal {
    fn default() -> Self {
        Self {
            resting: AtomicBool::new(false),
            woken: AtomicBool::new(false),
            leader: AtomicU32::new(NO_AGENT),
            closed: AtomicBool::new(false),
            touched: AtomicU64::new(0),
            thread: Mutex::new(None),
        }
    }
}

/// The flags of all agents of a run.
#[derive(Debug)]
pub(crate) struct SleepRegistry {
    /// Of every agent that has ever been in the run: more may join it.
    signals: Table<Signal>,
    /// An agent was notified: the lockstep loop serves it.
    notified: AtomicBool,
    stop: AtomicBool,
    ended: AtomicBool,
    /// Held while threads find that they are to end, and while that is taken back.
    gate: Mutex<()>,
    /// Simulated nanoseconds at which an agent near peers was last far behind, plus one; zero for never.
    far_behind: AtomicU64,
    /// Wake-up of the workers, where agents have no threads of their own.
    wakeup: OnceLock<WorkerWakeup>,
    pub callers_turn: CallersTurnSlot,
    /// Agents with new states, for the reader of the run.
    pub changed: DirtySet,
}

/// The state of a [`SleepRegistry`] between turns.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct SleepState {
    pub signals: Vec<SignalState>,
    notified: bool,
    far_behind: u64,
}

/// The flags of one agent, as [`Signal`] has them.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct SignalState {
    resting: bool,
    woken: bool,
    leader: u32,
    closed: bool,
    touched: u64,
}

impl SignalState {
    /// That of an agent that has left.
    const LEFT: Self = Self { resting: false, woken: false, leader: NO_AGENT, closed: true, touched: 0 };
}

impl SleepRegistry {
    pub fn new(agents: usize) -> Self {
        let registry = Self {
            signals: Table::of(agents),
            notified: AtomicBool::new(false),
            stop: AtomicBool::new(false),
            ended: AtomicBool::new(false),
            gate: Mutex::new(()),
            far_behind: AtomicU64::new(0),
            wakeup: OnceLock::new(),
            callers_turn: CallersTurnSlot::default(),
            changed: DirtySet::default(),
        };
        registry.changed.reach(agents);
        registry
    }

    /// Makes room for the agent of the next number. Agents join one at a time.
    pub fn join(&self) {
        self.changed.reach(self.signals.len() + 1);
        if let Some(wakeup) = self.wakeup.get() {
            wakeup.reach(self.signals.len() + 1);
        }
        self.signals.grow();
    }

    /// From now on notifications go to this many workers of a pool.
    pub fn set_workers(&self, workers: usize) {
        self.wakeup.get_or_init(|| WorkerWakeup::new(self.signals.len(), workers));
    }

    /// Wake-up of the workers; `None` where every agent has its own thread.
    pub fn wakeup(&self) -> Option<&WorkerWakeup> {
        self.wakeup.get()
    }

    fn signal(&self, id: AgentId) -> Option<&Signal> {
        self.signals.get(id.0 as usize)
    }

    /// Registers the thread to unpark for `id`; `None` once that has ended.
    pub fn set_thread(&self, id: AgentId, thread: Option<Thread>) {
        if let Some(signal) = self.signal(id) {
            *signal.thread.lock().unwrap_or_else(PoisonError::into_inner) = thread;
        }
    }

    /// Assigns the turns of `id` to `leader`, which has a lower number; `None`: it makes them itself again.
    pub fn follow(&self, id: AgentId, leader: Option<AgentId>) {
        if let Some(signal) = self.signal(id) {
            signal.leader.store(leader.map_or(NO_AGENT, |l| l.0), Release);
        }
    }

    /// The agent that makes the turns of `id`, at the end of the chain of leaders; `id` itself if it is not led.
    pub fn leader(&self, id: AgentId) -> AgentId {
        let mut at = id;
        while let Some(next) = self.direct_leader(at) {
            at = next;
        }
        at
    }

    /// The agent that makes the turns of `id`, if that is another.
    pub fn led_by(&self, id: AgentId) -> Option<AgentId> {
        Some(self.leader(id)).filter(|leader| *leader != id)
    }

    /// How long the end of a run waits for these agents' turns before they count as hung: a turn of a cluster makes the steps of all its
    /// members.
    pub fn end_patience(&self, missing: impl Iterator<Item = AgentId>) -> Duration {
        let mut led = vec![0; self.signals.len()];
        (0..).map(AgentId).take(led.len()).for_each(|id| led[self.leader(id).0 as usize] += 1);
        let most = missing.filter_map(|id| led.get(id.0 as usize).copied()).fold(1, u32::max);
        END_PATIENCE * most.min(END_PATIENCE_MAX)
    }

    fn direct_leader(&self, id: AgentId) -> Option<AgentId> {
        let leader = self.signal(id)?.leader.load(Acquire);
        (leader < id.0).then_some(AgentId(leader))
    }

    /// Declares that `id` makes no more turns.
    pub fn close(&self, id: AgentId) {
        if let Some(signal) = self.signal(id) {
            signal.closed.store(true, Release);
        }
    }

    /// Whether `id` makes no more turns.
    pub fn is_closed(&self, id: AgentId) -> bool {
        self.signal(id).is_some_and(|signal| signal.closed.load(Acquire))
    }

    /// `id` must not rest before its next turn; if it is at rest, it wakes.
    pub fn wake(&self, id: AgentId) {
        let mut at = Some(id);
        while let Some(next) = at {
            let Some(signal) = self.signal(next) else { return };
            signal.woken.store(true, Release);
            fence(SeqCst);
            if signal.resting.load(Relaxed) {
                self.notify(next);
            }
            at = self.direct_leader(next);
        }
    }

    /// Makes the thread that serves `id` check its flags.
    pub fn notify(&self, id: AgentId) {
        let Some(signal) = self.signal(id) else { return };
        if let Some(wakeup) = self.wakeup.get() {
            wakeup.notify(id);
            return;
        }
        self.notified.store(true, Release);
        signal.unpark();
    }

    /// Reports that another agent acts on `id` at simulated time `now`.
    pub fn touch(&self, id: AgentId, now: SimTime) {
        let Some(signal) = self.signal(id) else { return };
        signal.touched.fetch_max(now.as_nanos().saturating_add(1), AcqRel);
        fence(SeqCst);
        if self.is_resting(id) {
            self.wake(id);
        }
    }

    /// Whether the agent that makes the turns of `id` is at rest.
    pub fn is_resting(&self, id: AgentId) -> bool {
        self.signal(self.leader(id)).is_some_and(|signal| signal.resting.load(Acquire))
    }

    /// Whether `id` was woken, or touched so recently that it may not rest at `now`.
    pub fn must_stay_awake(&self, id: AgentId, now: SimTime) -> bool {
        self.signal(id).is_some_and(|signal| signal.woken.load(Acquire) || signal.is_held(now))
    }

    /// Puts the agent to rest, with all agents it leads, unless one of them was woken or recently touched; whether it did.
    pub fn try_rest(&self, id: AgentId, led: impl Iterator<Item = AgentId>, now: SimTime) -> bool {
        let Some(signal) = self.signal(id) else { return false };
        signal.resting.store(true, Release);
        fence(SeqCst);
        let mut disturbed = false;
        for signal in std::iter::once(id).chain(led).filter_map(|id| self.signal(id)) {
            disturbed |= signal.is_held(now) | signal.take_wake();
        }
        if disturbed {
            signal.resting.store(false, Release);
        }
        !disturbed
    }

    /// A turn of `id` begins: clears its wake-up, which this turn handles. To be called before the turn reads its inputs.
    pub fn clear_wake(&self, id: AgentId) {
        if let Some(signal) = self.signal(id) {
            signal.take_wake();
        }
    }

    /// Whether `id` was woken and has not handled it yet.
    pub fn is_woken(&self, id: AgentId) -> bool {
        self.signal(id).is_some_and(|signal| signal.woken.load(Acquire))
    }

    /// Ends the rest of `id` if it was woken; whether it was.
    pub fn take_wake(&self, id: AgentId) -> bool {
        let Some(signal) = self.signal(id) else { return false };
        let woken = signal.take_wake();
        if woken {
            signal.resting.store(false, Release);
        }
        woken
    }

    /// Whether any agent was notified since the last call.
    pub fn take_notified(&self) -> bool {
        self.notified.load(Relaxed) && self.notified.swap(false, AcqRel)
    }

    /// Unparks every thread, so that it reads the timeline again.
    pub fn unpark_all(&self) {
        if let Some(wakeup) = self.wakeup.get() {
            wakeup.wake_all();
        }
        self.signals.iter().for_each(Signal::unpark);
    }

    /// Records at `now` that an agent near peers is far behind, or is still postponed relative to the scene's time.
    pub fn note_far_behind(&self, now: SimTime) {
        let noted = self.far_behind.load(Relaxed);
        // all agents read this word: it is written seldom
        if noted == 0 || now > SimTime::from_nanos(noted - 1) + FAR_BEHIND_NOTED {
            self.far_behind.fetch_max(now.as_nanos().saturating_add(1), AcqRel);
        }
    }

    /// Whether any agent was far behind recently.
    pub fn is_any_far_behind(&self, now: SimTime) -> bool {
        let noted = self.far_behind.load(Acquire);
        noted > 0 && SimTime::from_nanos(noted - 1) + FAR_BEHIND_HOLD > now
    }

    /// The flags of one agent, which is there.
    pub fn signal_state(&self, id: AgentId) -> SignalState {
        self.signal(id).map_or(SignalState::LEFT, Signal::state)
    }

    /// Takes over the flags of one agent.
    pub fn set_signal_state(&self, id: AgentId, state: SignalState) {
        self.signal(id).into_iter().for_each(|signal| signal.set_state(state));
    }

    /// The agents that rest, are woken or were touched, and their leaders.
    pub fn state(&self) -> SleepState {
        let (notified, far_behind) = (self.notified.load(Acquire), self.far_behind.load(Acquire));
        SleepState { signals: self.signals.iter().map(Signal::state).collect(), notified, far_behind }
    }

    /// Takes over a state of the first agents: the others have left. All of them have new states then.
    pub fn set_state(&self, state: &SleepState) {
        let SleepState { signals, notified, far_behind } = state;
        let states = signals.iter().copied().chain(std::iter::repeat(SignalState::LEFT));
        self.signals.iter().zip(states).for_each(|(signal, state)| signal.set_state(state));
        self.notified.store(*notified, Release);
        self.far_behind.store(*far_behind, Release);
        (0..).map(AgentId).take(self.signals.len()).for_each(|id| self.changed.mark(id));
    }

    /// Asks every thread to end.
    pub fn stop(&self) {
        self.stop.store(true, Release);
        self.unpark_all();
    }

    /// Takes that back: the run goes on, with other threads in the place of ended ones.
    pub fn go_on(&self) {
        let _gate = self.gate.lock().unwrap_or_else(PoisonError::into_inner);
        self.stop.store(false, Release);
    }

    /// Notes that the run ends for good.
    pub fn end(&self) {
        self.ended.store(true, Release);
    }

    /// Whether the run ends for good, or has ended.
    pub fn has_ended(&self) -> bool {
        self.ended.load(Acquire)
    }

    /// Calls `leave` if threads are still asked to end, and that will not be taken back unseen: a thread that finds it `false` goes on.
    pub fn end_if_stopping(&self, leave: impl FnOnce()) -> bool {
        let _gate = self.gate.lock().unwrap_or_else(PoisonError::into_inner);
        let stopping = self.stopping();
        if stopping {
            leave();
        }
        stopping
    }

    /// Whether threads have been asked to end.
    pub fn stopping(&self) -> bool {
        self.stop.load(Acquire)
    }
}

impl Signal {
    fn unpark(&self) {
        if let Some(thread) = &*self.thread.lock().unwrap_or_else(PoisonError::into_inner) {
            thread.unpark();
        }
    }

    fn state(&self) -> SignalState {
        SignalState {
            resting: self.resting.load(Acquire),
            woken: self.woken.load(Acquire),
            leader: self.leader.load(Acquire),
            closed: self.closed.load(Acquire),
            touched: self.touched.load(Acquire),
        }
    }

    fn set_state(&self, SignalState { resting, woken, leader, closed, touched }: SignalState) {
        self.resting.store(resting, Release);
        self.woken.store(woken, Release);
        self.leader.store(leader, Release);
        self.closed.store(closed, Release);
        self.touched.store(touched, Release);
    }

    /// Whether it was woken since the last call; writes before the wake are then visible.
    fn take_wake(&self) -> bool {
        // a flag that is down is not written: its cache line stays shared by all readers;
        // a flag that is up is exchanged, not just cleared: else a wake right before would be overwritten unseen
        self.woken.load(Relaxed) && self.woken.swap(false, AcqRel)
    }

    /// Whether the last touch still keeps it awake.
    fn is_held(&self, now: SimTime) -> bool {
        let touched = self.touched.load(Acquire);
        touched > 0 && SimTime::from_nanos(touched - 1) + TOUCH_HOLD > now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ME: AgentId = AgentId(0);

    fn try_rest(sleep: &SleepRegistry, now: SimTime) -> bool {
        sleep.try_rest(ME, std::iter::empty(), now)
    }

    #[test]
    fn a_wake_before_the_rest_is_not_lost() {
        let sleep = SleepRegistry::new(1);
        sleep.wake(ME);
        assert!(!try_rest(&sleep, SimTime::ZERO), "woken before it rested");
        assert!(try_rest(&sleep, SimTime::ZERO), "that wake is used up");
        sleep.wake(ME);
        assert!(sleep.take_notified());
        assert!(sleep.take_wake(ME));
        assert!(!sleep.take_wake(ME));
    }

    #[test]
    fn a_cluster_is_waited_for_as_long_as_its_members() {
        let sleep = SleepRegistry::new(40);
        let patience = |of: &[u32]| sleep.end_patience(of.iter().copied().map(AgentId));
        assert_eq!(patience(&[0, 1]), END_PATIENCE);
        [1, 5].into_iter().for_each(|id| sleep.follow(AgentId(id), Some(AgentId(0))));
        sleep.follow(AgentId(7), Some(AgentId(5)));
        assert_eq!([patience(&[0]), patience(&[2, 3]), patience(&[])], [4 * END_PATIENCE, END_PATIENCE, END_PATIENCE]);
        (8..40).for_each(|id| sleep.follow(AgentId(id), Some(AgentId(7))));
        assert_eq!(patience(&[0, 3]), END_PATIENCE_MAX * END_PATIENCE);
    }

    #[test]
    fn a_touched_agent_stays_awake_for_the_hold() {
        let sleep = SleepRegistry::new(1);
        sleep.touch(ME, SimTime::ZERO);
        assert!(!try_rest(&sleep, SimTime::from_nanos(99_999_999)));
        assert!(try_rest(&sleep, SimTime::from_nanos(100_000_000)));
        sleep.touch(ME, SimTime::from_nanos(200_000_000));
        assert!(sleep.take_wake(ME));
    }

    #[test]
    fn a_led_agent_wakes_its_leader_and_the_leaders_leader() {
        let sleep = SleepRegistry::new(3);
        sleep.follow(AgentId(2), Some(AgentId(1)));
        sleep.follow(AgentId(1), Some(ME));
        assert_eq!(sleep.leader(AgentId(2)), ME);
        let led = || [AgentId(1), AgentId(2)].into_iter();
        assert!(sleep.try_rest(ME, led(), SimTime::ZERO));
        sleep.wake(AgentId(2));
        assert!(sleep.take_notified() && sleep.take_wake(ME));
        assert!(!sleep.try_rest(ME, led(), SimTime::ZERO), "the wake of one it leads is its own");
        assert!(sleep.try_rest(ME, led(), SimTime::ZERO));
        sleep.touch(AgentId(1), SimTime::from_nanos(500_000_000));
        assert!(sleep.take_wake(ME));
        sleep.follow(AgentId(1), None);
        assert_eq!(sleep.leader(AgentId(2)), AgentId(1));
    }

    #[test]
    fn being_far_behind_is_forgotten_after_a_while() {
        let (sleep, at) = (SleepRegistry::new(1), |ms: u64| SimTime::from_nanos(1_000_000 * ms));
        assert!(!sleep.is_any_far_behind(SimTime::ZERO));
        sleep.note_far_behind(SimTime::ZERO);
        assert!(sleep.is_any_far_behind(at(1999)) && !sleep.is_any_far_behind(at(2000)));
        sleep.note_far_behind(at(1500));
        sleep.note_far_behind(at(1550));
        assert!(sleep.is_any_far_behind(at(3499)) && !sleep.is_any_far_behind(at(3500)));
    }

    #[test]
    fn unknown_agents_are_ignored() {
        let sleep = SleepRegistry::new(1);
        sleep.wake(AgentId(7));
        sleep.touch(AgentId(7), SimTime::ZERO);
        assert!(!sleep.take_notified());
    }
}
