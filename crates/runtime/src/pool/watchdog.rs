//! The turn in progress of a worker, as seen by the watchdog.
//!
//! In: turns, from the worker. Out: the turn in progress. A worker whose step does not return is given up: the worker when its step returns
//! and the watchdog at its timeout compete for one atomic word, and the later one finds it decided.
//! Never here: threads, the treatment of the agent.

use metachron_core::AgentId;
use std::sync::atomic::{AtomicU64, Ordering::SeqCst};

/// State of one worker; a worker that is replaced leaves its state behind.
#[derive(Debug, Default)]
pub(super) struct WatchdogWord {
    /// The turn in progress: its number and, in the low half, the agent's number plus one. [`IDLE`] between turns.
    word: AtomicU64,
}

/// A turn in progress, as read by the watchdog; equal values are the same turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct WatchedTurn(u64);

const IDLE: u64 = 0;
const GIVEN_UP: u64 = u64::MAX;

impl WatchedTurn {
    /// The agent of the turn.
    pub const fn agent(self) -> AgentId {
        AgentId((self.0 as u32).wrapping_sub(1))
    }
}

impl WatchdogWord {
    /// Turn number `turn` begins, of `id`.
    pub fn begin(&self, turn: u32, id: AgentId) -> WatchedTurn {
        let word = (u64::from(turn & 0x7fff_ffff) << 32) | u64::from(id.0.wrapping_add(1));
        // read by the watchdog only, and its timeout is long
        self.word.store(word, std::sync::atomic::Ordering::Relaxed);
        WatchedTurn(word)
    }

    /// The step of `turn` has returned; whether the worker has not been given up.
    pub fn end(&self, turn: WatchedTurn) -> bool {
        self.word.compare_exchange(turn.0, IDLE, SeqCst, SeqCst).is_ok()
    }

    /// The turn in progress, if there is one.
    pub fn current(&self) -> Option<WatchedTurn> {
        Some(self.word.load(SeqCst)).filter(|word| *word != IDLE && *word != GIVEN_UP).map(WatchedTurn)
    }

    /// Gives the worker up, if `turn` is still in progress; whether it was.
    pub fn give_up(&self, turn: WatchedTurn) -> bool {
        self.word.compare_exchange(turn.0, GIVEN_UP, SeqCst, SeqCst).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn either_the_step_returns_or_the_worker_is_given_up() {
        let watchdog = WatchdogWord::default();
        assert_eq!(watchdog.current(), None);
        let first = watchdog.begin(1, AgentId(7));
        assert_eq!(watchdog.current().map(WatchedTurn::agent), Some(AgentId(7)));
        assert!(watchdog.end(first));
        assert!(!watchdog.give_up(first), "it is over");
        let second = watchdog.begin(2, AgentId(7));
        assert_ne!(first, second);
        assert!(watchdog.give_up(second));
        assert!(!watchdog.end(second), "it is given up");
        assert_eq!(watchdog.current(), None);
    }
}
