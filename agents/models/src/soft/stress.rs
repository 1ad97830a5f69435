//! The stress in a soft body, in a state that it has published.
//!
//! In: a body of the specification of the one that published it, and the snapshot. Out: a number for every vertex. Never here: steps, damping.
//! Theory: docs/theory/soft.md, eq. 6, 9, 28.

use super::body::SoftBody;
use metachron_contact::Agent;
use metachron_core::Snapshot;

impl SoftBody {
    /// The von Mises stress of the elastic forces at every vertex of a state that a body of the same specification published, Pa, ≥ 0: the mean of
    /// the elements around it by volume, of sheets in the middle of their thickness. The body takes that state. `None` where it is no state
    /// of such a body, and once cells were removed.
    pub fn von_mises_pa(&mut self, state: &Snapshot) -> Option<Vec<f64>> {
        if state.removed.cells > 0 {
            return None;
        }
        state.resolution.into_iter().for_each(|resolution| self.set_resolution(resolution));
        self.set_state(&state.body).ok()?;
        let of_nodes = self.mesh.von_mises_pa(&self.positions, &self.spec.material);
        let Some(skin) = &self.skin else { return Some(of_nodes) };
        // weights of a point beside its cell may be below zero
        let carried =
            skin.carried().iter().map(|point| point.terms().map(|(node, share)| of_nodes[node] * share).sum());
        Some(carried.map(|stress: f64| stress.max(0.0)).collect())
    }
}
