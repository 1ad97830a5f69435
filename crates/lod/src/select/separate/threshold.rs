//! Baselines without a budget: every object at its finest level, or at the finest level whose polygons are large enough.
//!
//! In: covered pixels and polygons. Out: levels, whatever they cost. Never here: a prediction of cost, so no guarantee of time.
//! Theory: `docs/theory/budget.md`, eq. 13 and 14; the static rule is (FS93, §7), the feedback law of its threshold is ours.

use alloc::vec::Vec;

use crate::select::statement::problem::{Level, Problem, Selection};

/// Mean pixels per polygon that the static rule requires (FS93, §7).
pub const STATIC_PX: f64 = 1024.0;

/// Every object at its finest level: the reference for the other policies.
#[must_use]
pub fn full(problem: &Problem) -> Selection {
    let finest = |i| (problem.levels(i).len() as u32).checked_sub(1);
    problem.judge((0..problem.len()).map(finest).collect())
}

/// The finest level whose polygons cover at least `threshold_px` pixels each on average; else the coarsest.
///
/// `pixels`: pixels that the object covers; `polygons`: polygons of each level, coarsest first. `None` without levels; the coarsest if
/// `pixels` is 0 or NaN.
#[must_use]
pub fn level(pixels: f64, polygons: &[u32], threshold_px: f64) -> Level {
    let large = |&p: &u32| pixels >= threshold_px * f64::from(p.max(1));
    let finest = polygons.iter().rposition(large).unwrap_or(0);
    (!polygons.is_empty()).then_some(finest as u32)
}

/// A threshold adapted to the time of the frame before: θ ← θ exp(½ (t − T)/T), inside 1 … 2·10⁵ px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feedback {
    threshold_px: f64,
}

impl Default for Feedback {
    fn default() -> Self {
        Self { threshold_px: STATIC_PX }
    }
}

impl Feedback {
    /// The present threshold, pixels per polygon.
    #[must_use]
    pub fn threshold_px(&self) -> f64 {
        self.threshold_px
    }

    /// Updates the threshold: a frame took `took`, the target is `target`, in the same unit of time.
    ///
    /// Gives `false`, and changes nothing, if either is not finite, `took` is negative or `target` is not above 0.
    pub fn observe(&mut self, took: f64, target: f64) -> bool {
        let sound = took.is_finite() && took >= 0.0 && target.is_finite() && target > 0.0;
        if sound {
            let moved = self.threshold_px * libm::exp(0.5 * (took - target) / target);
            self.threshold_px = crate::within(moved, 1.0, 2e5);
        }
        sound
    }
}

/// The levels of many objects by [`level`]: `sizes` gives each object's pixels and its levels' polygons.
#[must_use]
pub fn levels<'a>(sizes: impl Iterator<Item = (f64, &'a [u32])>, threshold_px: f64) -> Vec<Level> {
    sizes.map(|(pixels, polygons)| level(pixels, polygons, threshold_px)).collect()
}
