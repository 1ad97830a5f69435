//! The rule for drawing objects better than requested: only while all of them have their requested best, and time is left.
//!
//! In: the choice of a frame. Out: whether better rungs are offered in the next. Never here: the rungs ([`crate::control::prices::ladder`]), a choice.
//! Theory: `docs/theory/control.md`, section 6; (RH05, §7.2) proposes it for time that would stay unspent.

use crate::control::demand::plan::LevelDemand;
use crate::control::demand::policy::Policy;
use crate::control::demand::query::{FrameQuery, Promise};

/// Frames in which all objects must have had their best before more is offered: half a second at 60 Hz …
const PATIENCE: u32 = 30;
/// … and the greatest value that this grows to if the offer was too early.
const PATIENCE_MAX: u32 = 960;
/// Time that must be left, as a fraction of the target.
const SPARE: f64 = 0.1;

/// Whether more than the requested quality is offered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct QualityBoost {
    open: bool,
    /// Frames since it opened, or frames in a row in which all objects had their best.
    frames: u32,
    patience: u32,
}

impl Default for QualityBoost {
    fn default() -> Self {
        Self { open: false, frames: 0, patience: PATIENCE }
    }
}

impl QualityBoost {
    /// Whether better rungs are offered.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// Updates the rule with a choice.
    ///
    /// Robin Hood gives no object more than its share, so that time can be left while others want it: there, time left is enough, without
    /// that of better rungs.
    pub fn observe(&mut self, query: &FrameQuery<'_>, levels: &[LevelDemand], promise: &Promise, policy: Policy) {
        let raised_s: f64 = query.drawable().map(|at| raised_s(query, at, &levels[at])).sum();
        let spare = promise.predicted_s - raised_s < (1.0 - SPARE) * query.target_s;
        let has_all = promise.feasible
            && match policy {
                Policy::RobinHood => spare,
                _ => query.drawable().all(|at| has_all(query, at, &levels[at])),
            };
        self.frames = if has_all && (self.open || spare) { self.frames.saturating_add(1) } else { 0 };
        if self.open && !has_all {
            // an offer that did not last ten times its waiting time was too early
            let lasted = self.frames > 10 * self.patience;
            self.patience = if lasted { PATIENCE } else { (2 * self.patience).min(PATIENCE_MAX) };
            self.open = false;
        } else if !self.open && self.frames >= self.patience {
            (self.open, self.frames) = (true, 0);
        }
    }
}

/// Seconds that an object takes beyond its best requested rung.
fn raised_s(query: &FrameQuery<'_>, at: usize, level: &LevelDemand) -> f64 {
    let (asked, better) = query.ladders.of(at).rungs.split_at(query.ladders.of(at).asked);
    let drawn = better.iter().find(|rung| (rung.polygons, rung.shading) == (level.polygons, level.shading));
    let most_s = asked.iter().map(|rung| rung.cost_s).fold(0.0, f64::max);
    drawn.map_or(0.0, |drawn| (drawn.cost_s - most_s).max(0.0))
}

/// Whether an object is drawn as well as requested; an object left out for its group requests nothing.
fn has_all(query: &FrameQuery<'_>, at: usize, level: &LevelDemand) -> bool {
    let ladder = query.ladders.of(at);
    let best = ladder.rungs[..ladder.asked].iter().max_by(|a, b| a.accuracy.total_cmp(&b.accuracy));
    best.is_none_or(|best| level.polygons >= best.polygons && level.shading >= best.shading)
}
