//! Who sleeps and who wakes whom.
//!
//! In: wakes and touches from any thread. Out: a flag each agent looks at, and its thread unparked.
//! Never here: when an agent is due ([`super::pace`]), what it is told ([`super::mailbox`]).
//!
//! No wake is lost: who goes to rest raises `resting` first and looks at `woken` and `touched` after; who wakes writes these
//! first and looks at `resting` after. In one total order (SeqCst) at least one of the two sees the other.

use metachron_agents::{AgentId, SimSpan, SimTime};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::SeqCst};
use std::thread::Thread;

/// How long after the last touch an agent may not rest, simulated time: longer than the period of any toucher above 10 Hz,
/// so that a touched agent does not doze off between two touches.
const TOUCH_HOLD: SimSpan = SimSpan::from_nanos(100_000_000);

/// The flags of one agent.
#[derive(Debug, Default)]
struct Signal {
    resting: AtomicBool,
    woken: AtomicBool,
    /// Simulated nanoseconds of the last touch, plus one; zero for never.
    touched: AtomicU64,
    thread: OnceLock<Thread>,
}

/// The flags of all agents of a run.
#[derive(Debug)]
pub(super) struct Switchboard {
    signals: Vec<Signal>,
    /// Somebody at rest was woken: the lockstep loop looks for them.
    rung: AtomicBool,
    stop: AtomicBool,
}

impl Switchboard {
    pub fn new(agents: usize) -> Self {
        let signals = std::iter::repeat_with(Signal::default).take(agents).collect();
        Self { signals, rung: AtomicBool::new(false), stop: AtomicBool::new(false) }
    }

    fn signal(&self, id: AgentId) -> Option<&Signal> {
        self.signals.get(id.0 as usize)
    }

    /// Tells which thread to unpark for `id`.
    pub fn lives_on(&self, id: AgentId, thread: Thread) {
        if let Some(signal) = self.signal(id) {
            signal.thread.get_or_init(|| thread);
        }
    }

    /// `id` must not rest before its next turn; if it rests now, it wakes.
    pub fn wake(&self, id: AgentId) {
        let Some(signal) = self.signal(id) else { return };
        signal.woken.store(true, SeqCst);
        if signal.resting.load(SeqCst) {
            self.rung.store(true, SeqCst);
            signal.thread.get().inspect(|t| t.unpark());
        }
    }

    /// Another agent acts on `id` at simulated time `now`.
    pub fn touch(&self, id: AgentId, now: SimTime) {
        let Some(signal) = self.signal(id) else { return };
        signal.touched.fetch_max(now.as_nanos().saturating_add(1), SeqCst);
        if signal.resting.load(SeqCst) {
            self.wake(id);
        }
    }

    /// Goes to rest, unless somebody woke or touched `id` lately; whether it did.
    pub fn try_rest(&self, id: AgentId, now: SimTime) -> bool {
        let Some(signal) = self.signal(id) else { return false };
        signal.resting.store(true, SeqCst);
        let touched = signal.touched.load(SeqCst);
        let held = touched > 0 && SimTime::from_nanos(touched - 1) + TOUCH_HOLD > now;
        if held || signal.woken.swap(false, SeqCst) {
            signal.resting.store(false, SeqCst);
            return false;
        }
        true
    }

    /// Ends the rest of `id` if somebody woke it; whether somebody did.
    pub fn take_wake(&self, id: AgentId) -> bool {
        let Some(signal) = self.signal(id) else { return false };
        if !signal.woken.swap(false, SeqCst) {
            return false;
        }
        signal.resting.store(false, SeqCst);
        true
    }

    /// Whether anybody at rest was woken since the last call.
    pub fn take_rung(&self) -> bool {
        self.rung.load(SeqCst) && self.rung.swap(false, SeqCst)
    }

    /// Unparks every thread, so that it looks at the timeline again.
    pub fn unpark_all(&self) {
        self.signals.iter().filter_map(|s| s.thread.get()).for_each(Thread::unpark);
    }

    /// Asks every thread to end.
    pub fn stop(&self) {
        self.stop.store(true, SeqCst);
        self.unpark_all();
    }

    /// Whether threads have been asked to end.
    pub fn stopping(&self) -> bool {
        self.stop.load(SeqCst)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ME: AgentId = AgentId(0);

    #[test]
    fn a_wake_before_the_rest_is_not_lost() {
        let board = Switchboard::new(1);
        board.wake(ME);
        assert!(!board.try_rest(ME, SimTime::ZERO), "woken before it lay down");
        assert!(board.try_rest(ME, SimTime::ZERO), "that wake is used up");
        board.wake(ME);
        assert!(board.take_rung());
        assert!(board.take_wake(ME));
        assert!(!board.take_wake(ME));
    }

    #[test]
    fn a_touched_agent_stays_awake_for_the_hold() {
        let board = Switchboard::new(1);
        board.touch(ME, SimTime::ZERO);
        assert!(!board.try_rest(ME, SimTime::from_nanos(99_999_999)));
        assert!(board.try_rest(ME, SimTime::from_nanos(100_000_000)));
        board.touch(ME, SimTime::from_nanos(200_000_000));
        assert!(board.take_wake(ME));
    }

    #[test]
    fn strangers_are_nobody() {
        let board = Switchboard::new(1);
        board.wake(AgentId(7));
        board.touch(AgentId(7), SimTime::ZERO);
        assert!(!board.take_rung());
    }
}
