//! Publication of a soft body: its snapshot.
//!
//! In: a body between two steps. Out: its vertices. Never here: any change of its state.

use super::body::SoftBody;
use metachron_core::Snapshot;

impl SoftBody {
    /// Writes everything but the time.
    pub(super) fn publish(&self, into: &mut Snapshot) {
        into.clear();
        into.steps = self.steps;
        into.resolution = self.present_resolution();
        into.nodes = Some(self.nodes());
        into.energy_j = self.energy_j();
        into.drift_m = self.doubling.watch.error_m();
        into.residual_m = self.mesh.residual_m(&self.positions) + into.drift_m;
        into.removed = self.removed;
        into.grips.clone_from(&self.grips);
        (into.at_rest, into.acceleration) = (self.at_rest, self.acceleration);
        into.bounds = Some(self.bounds());
        let soft = into.body.soft_mut();
        let (positions, velocities) =
            self.skin.as_ref().map_or((&self.positions, &self.velocities), |skin| (&skin.positions, &skin.velocities));
        soft.positions.clone_from(positions);
        soft.velocities.clone_from(velocities);
    }
}
