//! The input of every cost-based policy, and the promise that it gives.
//!
//! In: the objects with their ladders, the time. Out: [`FrameQuery`] and [`Promise`]. Never here: a choice.

use super::level;
use super::plan::{LevelDemand, SizedView};
use crate::control::prices::benefit;
use crate::control::prices::ladder::{Ladder, Ladders, Rung};
use crate::cost::benefit::Sliders;
use crate::cost::value::Value;
use crate::select::Entry;
use metachron_core::Resolution;

/// Ticks of a second: costs are whole nanoseconds.
pub(crate) const TICKS: f64 = 1e9;

/// Benefit is given in parts of a pixel, so that the integers of a knapsack resolve fine levels.
pub(crate) const PARTS_OF_A_PIXEL: f64 = 4096.0;

/// A level whose cost is invalid is assumed to cost twice this, ticks: a small object on a slow machine.
const USUAL: f64 = 1e5;

/// The input of a policy for one frame.
#[derive(Clone, Copy)]
pub(crate) struct FrameQuery<'a> {
    pub views: &'a [SizedView],
    pub ladders: &'a Ladders,
    pub sliders: &'a Sliders,
    /// The value formula of Robin Hood.
    pub value: Value,
    /// Target time of a frame, seconds, > 0.
    pub target_s: f64,
    /// Time limit for choosing, seconds, if one is set.
    pub choose_s: Option<f64>,
    /// The fraction of the target that is left free at least, 0 … 0.9.
    pub margin: f64,
    /// Time that is spent whatever is chosen, seconds, ≥ 0.
    pub fixed_s: f64,
    /// Time in it that the frame does not spend but leaves to agents, seconds, ≥ 0.
    pub reserve_s: f64,
    /// Whether Robin Hood shares the time once more that no object took.
    pub spend_rest: bool,
    /// Which objects are left out of this frame; empty for none.
    pub out: &'a [bool],
}

/// The prediction of a choice.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Promise {
    /// Time for the choice, seconds; below 0 where other work takes the whole frame.
    pub budget_s: f64,
    /// Predicted time of the whole frame, seconds; 0 where the policy predicts nothing.
    pub predicted_s: f64,
    /// Value of the choice, in the policy's own unit.
    pub value: f64,
    /// The certificate: no choice within the budget has a greater value; 0 where the policy gives none.
    pub upper: f64,
    /// Whether the cheapest choice fits the budget.
    pub feasible: bool,
    /// Objects in view that are left out for lack of time.
    pub holes: u32,
    /// Passes of a search that goes on from the frame before (MB97); 0 for other policies.
    pub passes: u32,
}

impl Promise {
    /// Value over its bound, 0 … 1; `None` without a bound.
    #[must_use]
    pub fn value_over_bound(&self) -> Option<f64> {
        (self.upper > 0.0).then(|| (self.value / self.upper).min(1.0))
    }
}

impl FrameQuery<'_> {
    /// Time for the choice, seconds.
    pub fn budget_s(&self) -> f64 {
        self.target_s * (1.0 - self.margin) - self.fixed_s
    }

    /// The same in whole ticks.
    pub fn budget(&self) -> i64 {
        // a cast of floats saturates
        libm::floor(self.budget_s() * TICKS) as i64
    }

    /// Numbers of the objects in view that are drawn as themselves, not as groups.
    pub fn drawable(&self) -> impl Iterator<Item = usize> + '_ {
        let itself = |at: &usize| !self.views[*at].view.is_group() && !self.ladders.of(*at).rungs.is_empty();
        (0..self.views.len()).filter(|at| self.is_offered(*at)).filter(itself)
    }

    /// Whether an object is in view and not left out.
    pub fn is_offered(&self, at: usize) -> bool {
        self.views[at].view.visible && !self.out.get(at).is_some_and(|out| *out)
    }

    /// Number that breaks ties between objects.
    pub fn id(&self, at: usize) -> u64 {
        u64::from(self.views[at].view.id.0)
    }

    /// Benefit of an object in view at an accuracy of 1.
    pub fn weight(&self, at: usize) -> f64 {
        benefit::weight(&self.views[at].view, self.sliders, self.ladders.of(at).polygon_px())
    }

    /// A rung of an object as an entry of a knapsack.
    pub fn entry(&self, weight: f64, rung: &Rung) -> Entry {
        self.entry_of(rung, weight * rung.accuracy)
    }

    /// A rung of an object as an entry of a knapsack with this benefit, pixels.
    pub fn entry_of(&self, rung: &Rung, benefit: f64) -> Entry {
        Entry::measured(TICKS * rung.cost_s, PARTS_OF_A_PIXEL * benefit, USUAL).0
    }
}

/// The demand for one rung.
pub(crate) fn demand(at: usize, views: &[SizedView], rung: &Rung) -> LevelDemand {
    LevelDemand { id: views[at].view.id, resolution: rung.resolution, polygons: rung.polygons, shading: rung.shading }
}

/// The demand of an object that is left out of the picture: its coarsest resolution, no triangles.
pub(crate) fn left_out(at: usize, views: &[SizedView], ladder: &Ladder) -> LevelDemand {
    let view = &views[at].view;
    let usual = Resolution { eps_m: view.range.eps_m.1, n: view.range.n.0 };
    let resolution = ladder.rungs.first().map_or(usual, |rung| rung.resolution);
    let n = if view.is_group() { level::open(view) } else { resolution.n };
    LevelDemand { id: view.id, resolution: Resolution { n, ..resolution }, polygons: 0.0, shading: view.shading.1 }
}
