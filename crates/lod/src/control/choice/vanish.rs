//! Objects that are left out where not even the coarsest of everything fits: "no polygons at all" (FS93, §3), as the last resort.
//!
//! In: ladders, a time. Out: which of the objects that may vanish are left out of this frame. Never here: objects of groups, where the policy
//! may draw an impostor for them. Theory: `docs/theory/budget.md`, section 3.

use super::groups::Groups;
use crate::control::demand::query::FrameQuery;

/// Factor of the benefit per cost of an object that was drawn in the frame before: it does not go out for a slight
/// change of size.
pub(super) const STAY_FACTOR: f64 = 1.25;

/// An object comes back where this fraction of the time stays free: it does not come in for a slight change of time.
const COME_BACK: f64 = 0.05;

/// Which objects are left out.
#[derive(Debug, Clone, Default)]
pub(crate) struct Vanish {
    /// In the order in which the objects are given.
    out: Vec<bool>,
    /// Objects that may vanish with their benefit per cost and cost at the coarsest.
    ranked: Vec<(usize, f64, f64)>,
}

impl Vanish {
    /// Finds the objects left out: from everything at its coarsest the ones with the least benefit per cost, until the
    /// rest fits. `slowness`: how much slower the machine is than the prices.
    pub fn update(&mut self, query: &FrameQuery<'_>, groups: &Groups, slowness: f64) {
        let before = core::mem::take(&mut self.out);
        let was_out = |at: usize| before.get(at).copied().unwrap_or(false);
        self.out.resize(query.views.len(), false);
        self.ranked.clear();
        let mut least_s = 0.0;
        for at in query.drawable().filter(|at| groups.parent(*at).is_none()) {
            let coarsest = &query.ladders.of(at).rungs[0];
            least_s += slowness * coarsest.cost_s;
            if query.views[at].view.may_vanish {
                let stays = if was_out(at) { 1.0 } else { STAY_FACTOR };
                let worth = stays * query.weight(at) * coarsest.accuracy / coarsest.cost_s.max(1e-12);
                self.ranked.push((at, worth, slowness * coarsest.cost_s));
            }
        }
        self.ranked.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        let budget_s = query.budget_s();
        for &(at, _, cost_s) in &self.ranked {
            let room_s = if was_out(at) { (1.0 - COME_BACK) * budget_s } else { budget_s };
            if least_s > room_s {
                self.out[at] = true;
                least_s -= cost_s;
            }
        }
    }

    /// Leaves nothing out.
    pub fn clear(&mut self) {
        self.out.clear();
    }

    /// Which objects are left out, in their order.
    pub fn out(&self) -> &[bool] {
        &self.out
    }
}
