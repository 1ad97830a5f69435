//! When objects may be drawn better than they ask for: only while all of them have all that they ask for, and time is left.
//!
//! In: what was chosen for a frame. Out: whether better rungs are offered in the next. Never here: the rungs ([`super::ladder`]), a choice.
//! Theory: `docs/theory/control.md`, section 6; (RH05, §7.2) proposes it for time that would stay unspent.

use super::ask::{Ask, Promise};
use super::plan::LevelDemand;

/// Frames in which all must have had all, before more is offered: half a second at 60 Hz …
const PATIENCE: u32 = 30;
/// … and the most that this grows to where it was offered too soon.
const PATIENCE_MAX: u32 = 960;
/// What must be left of the target, as a part of it.
const SPARE: f64 = 0.1;

/// Whether more is offered than objects ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Raise {
    open: bool,
    /// Frames since it opened, or in which all had all.
    frames: u32,
    patience: u32,
}

impl Default for Raise {
    fn default() -> Self {
        Self { open: false, frames: 0, patience: PATIENCE }
    }
}

impl Raise {
    /// Whether better rungs are offered.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// Learns what was chosen.
    pub fn observe(&mut self, ask: &Ask<'_>, levels: &[LevelDemand], promise: &Promise) {
        let has_all = promise.feasible && ask.drawable().all(|at| has_all(ask, at, &levels[at]));
        let spare = promise.predicted_s < (1.0 - SPARE) * ask.target_s;
        self.frames = if has_all && (self.open || spare) { self.frames.saturating_add(1) } else { 0 };
        if self.open && !has_all {
            // what did not last ten times as long as it was waited for was offered too soon
            let lasted = self.frames > 10 * self.patience;
            self.patience = if lasted { PATIENCE } else { (2 * self.patience).min(PATIENCE_MAX) };
            self.open = false;
        } else if !self.open && self.frames >= self.patience {
            (self.open, self.frames) = (true, 0);
        }
    }
}

/// Whether an object is drawn as well as it asks for: what is left out for its group asks for nothing.
fn has_all(ask: &Ask<'_>, at: usize, level: &LevelDemand) -> bool {
    let ladder = ask.ladders.of(at);
    let best = ladder.rungs[..ladder.asked].iter().max_by(|a, b| a.accuracy.total_cmp(&b.accuracy));
    best.is_none_or(|best| level.polygons >= best.polygons && level.shading >= best.shading)
}
