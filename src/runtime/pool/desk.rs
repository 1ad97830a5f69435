//! Whose turn a worker makes, for those who watch over it.
//!
//! In: turns, from the worker. Out: how long the same one lasts. A worker whose step does not return is given up: whoever comes
//! first, the worker with its step or the watch with its patience, decides, and the other one finds it decided.
//! Never here: threads, what becomes of the agent.

use metachron_core::AgentId;
use std::sync::atomic::{AtomicU64, Ordering::SeqCst};

/// One worker's place; a worker that is replaced leaves its desk behind.
#[derive(Debug, Default)]
pub(super) struct Desk {
    /// The turn under way: its number and, below, the agent's number plus one. [`IDLE`] between turns.
    word: AtomicU64,
}

/// A turn under way, as the watch sees it; equal ones are the same turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sitting(u64);

const IDLE: u64 = 0;
const GIVEN_UP: u64 = u64::MAX;

impl Sitting {
    /// Whose turn it is.
    pub const fn whose(self) -> AgentId {
        AgentId((self.0 as u32).wrapping_sub(1))
    }
}

impl Desk {
    /// Turn number `turn` begins, of `id`.
    pub fn sit(&self, turn: u32, id: AgentId) -> Sitting {
        let word = (u64::from(turn & 0x7fff_ffff) << 32) | u64::from(id.0.wrapping_add(1));
        // read by the watch alone, and its patience is long
        self.word.store(word, std::sync::atomic::Ordering::Relaxed);
        Sitting(word)
    }

    /// The step of `sitting` has returned; whether the worker is still wanted.
    pub fn rise(&self, sitting: Sitting) -> bool {
        self.word.compare_exchange(sitting.0, IDLE, SeqCst, SeqCst).is_ok()
    }

    /// The turn under way, if there is one.
    pub fn sitting(&self) -> Option<Sitting> {
        Some(self.word.load(SeqCst)).filter(|word| *word != IDLE && *word != GIVEN_UP).map(Sitting)
    }

    /// Gives the worker up, if `sitting` still lasts; whether it does.
    pub fn give_up(&self, sitting: Sitting) -> bool {
        self.word.compare_exchange(sitting.0, GIVEN_UP, SeqCst, SeqCst).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn either_the_step_returns_or_the_worker_is_given_up() {
        let desk = Desk::default();
        assert_eq!(desk.sitting(), None);
        let first = desk.sit(1, AgentId(7));
        assert_eq!(desk.sitting().map(Sitting::whose), Some(AgentId(7)));
        assert!(desk.rise(first));
        assert!(!desk.give_up(first), "it is over");
        let second = desk.sit(2, AgentId(7));
        assert_ne!(first, second);
        assert!(desk.give_up(second));
        assert!(!desk.rise(second), "nobody waits for it any more");
        assert_eq!(desk.sitting(), None);
    }
}
