//! What an agent would take of a core at its finest: the mean of the last windows, with the bursts among them.
//!
//! In: the load of a window, carried to the finest. Out: their mean. Never here: where on the stairs the agent is.
//! Theory: `docs/theory/control.md`, eq. 18.

use std::collections::VecDeque;

/// Windows that count: four seconds, after which a burst is forgotten. Bursts that come more often than that are paid for by their mean.
const WINDOWS: usize = 16;
/// So much above the mean a window is dear …
const DEAR: f64 = 1.25;
/// … and so many in a row, a second, are no burst: it is the work that has grown, and what was before says nothing any more.
pub(super) const IN_A_ROW: usize = 4;

/// The load of an agent at its finest, as a part of a core.
#[derive(Debug, Clone, Default)]
pub(super) struct FullLoad {
    windows: VecDeque<f64>,
    dear: usize,
}

impl FullLoad {
    /// Learns the load of a window.
    pub fn note(&mut self, load: f64) {
        let dear = self.mean().is_some_and(|mean| load > DEAR * mean);
        self.dear = if dear { self.dear + 1 } else { 0 };
        if self.windows.len() == WINDOWS {
            self.windows.pop_front();
        }
        self.windows.push_back(load);
        if self.dear >= IN_A_ROW {
            self.windows.drain(..self.windows.len() - IN_A_ROW);
            self.dear = 0;
        }
    }

    /// The mean; `None` before anything was learnt.
    pub fn mean(&self) -> Option<f64> {
        let sum: f64 = self.windows.iter().sum();
        (!self.windows.is_empty()).then(|| sum / self.windows.len() as f64)
    }
}
