//! Load of an agent at its finest, as a fraction of a core: the mean of the last windows, bursts included.
//!
//! In: the load of a window, scaled to the finest. Out: their mean. Never here: the present level of the agent.
//! Theory: `docs/theory/control.md`, eq. 18.

use std::collections::VecDeque;

/// Number of windows: four seconds, after which a burst no longer counts. More frequent bursts are covered by the mean.
const WINDOWS: usize = 16;
/// A window this much above the mean counts as expensive …
const EXPENSIVE: f64 = 1.25;
/// … and this many in a row, a second, are not a burst: the work has grown, and older windows are discarded.
pub(super) const IN_A_ROW: usize = 4;

/// The load of an agent at its finest, as a fraction of a core.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct FullLoad {
    windows: VecDeque<f64>,
    expensive: usize,
}

impl FullLoad {
    /// Adds the load of a window.
    pub fn note(&mut self, load: f64) {
        let expensive = self.mean().is_some_and(|mean| load > EXPENSIVE * mean);
        self.expensive = if expensive { self.expensive + 1 } else { 0 };
        if self.windows.len() == WINDOWS {
            self.windows.pop_front();
        }
        self.windows.push_back(load);
        if self.expensive >= IN_A_ROW {
            self.windows.drain(..self.windows.len() - IN_A_ROW);
            self.expensive = 0;
        }
    }

    /// The mean; `None` before the first window.
    pub fn mean(&self) -> Option<f64> {
        let sum: f64 = self.windows.iter().sum();
        (!self.windows.is_empty()).then(|| sum / self.windows.len() as f64)
    }
}
