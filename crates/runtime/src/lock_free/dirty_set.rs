//! Set of agents whose state has changed since the run's single reader last looked.
//!
//! In: numbers of agents, from the threads that make their turns. Out: each of them once. Scanning a hundred thousand agents without news
//! takes as little time as reading one agent with news. Never here: the states themselves.

use super::sync::atomic::{AtomicU64, Ordering};
use crossbeam_utils::CachePadded;
use metachron_core::AgentId;

/// One bit per agent. Words are padded: agents of one word mostly share a worker, and workers must not disturb each other.
#[derive(Debug, Default)]
pub(crate) struct DirtySet(boxcar::Vec<CachePadded<AtomicU64>>);

impl DirtySet {
    /// Makes room for so many agents.
    pub fn reach(&self, agents: usize) {
        while self.0.count() < agents.div_ceil(64) {
            self.0.push(CachePadded::default());
        }
    }

    /// Reports a new state of `id`; to be called after the state is visible.
    pub fn mark(&self, id: AgentId) {
        if let Some(word) = self.0.get(id.0 as usize / 64) {
            // written even if the bit is set: else the reader could clear the bit and miss the state that this caller has published
            word.fetch_or(1 << (id.0 % 64), Ordering::AcqRel);
        }
    }

    /// Visits the agents with new states, by rising numbers.
    pub fn take(&self, mut visit: impl FnMut(AgentId)) {
        for (at, word) in &self.0 {
            // an idle word is only read; a bit that is set now is found the next time
            if word.load(Ordering::Relaxed) == 0 {
                continue;
            }
            let mut bits = word.swap(0, Ordering::AcqRel);
            while bits != 0 {
                visit(AgentId(at as u32 * 64 + bits.trailing_zeros()));
                bits &= bits - 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mark_is_visited_once() {
        let set = DirtySet::default();
        set.reach(130);
        let visited = || {
            let mut visited = Vec::new();
            set.take(|id| visited.push(id.0));
            visited
        };
        [129, 0, 64, 0, 63].iter().for_each(|id| set.mark(AgentId(*id)));
        assert_eq!(visited(), [0, 63, 64, 129]);
        assert!(visited().is_empty());
        set.mark(AgentId(5000));
        assert!(visited().is_empty(), "unknown agents are ignored");
    }

    #[test]
    fn a_value_stored_before_a_mark_is_visible_with_it() {
        let (set, value) = (DirtySet::default(), AtomicU64::new(0));
        set.reach(1);
        let last = 100_000;
        std::thread::scope(|scope| {
            scope.spawn(|| {
                for k in 1..=last {
                    value.store(k, Ordering::Release);
                    set.mark(AgentId(0));
                }
            });
            // a reader that looks only at reported agents reaches the last value
            let mut seen = 0;
            while seen < last {
                set.take(|_| seen = value.load(Ordering::Acquire));
                std::thread::yield_now();
            }
        });
    }
}
