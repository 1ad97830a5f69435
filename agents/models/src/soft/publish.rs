//! Publication of a soft body: its snapshot.
//!
//! In: a body between two steps. Out: its vertices. Never here: any change of its state.

use super::body::SoftBody;
use metachron_core::{Body, Snapshot, SoftState};

impl SoftBody {
    /// Writes everything but the time.
    pub(super) fn publish(&self, into: &mut Snapshot) {
        into.clear();
        into.resolution = self.present_resolution();
        into.nodes = Some(self.nodes());
        into.energy_j = self.energy_j();
        into.residual_m = self.mesh.residual_m(&self.positions);
        into.removed = self.removed;
        (into.at_rest, into.acceleration) = (self.at_rest, self.acceleration);
        into.bounds = Some(self.bounds());
        self.write_state(into.body.soft_mut());
    }

    /// Writes its vertices, and the nodes that carry them.
    fn write_state(&self, into: &mut SoftState) {
        let Some(skin) = &self.skin else {
            into.positions.clone_from(&self.positions);
            into.velocities.clone_from(&self.velocities);
            into.nodes = None;
            return;
        };
        into.positions.clone_from(&skin.positions);
        into.velocities.clone_from(&skin.velocities);
        let nodes = into.nodes.get_or_insert_default();
        nodes.positions.clone_from(&self.positions);
        nodes.velocities.clone_from(&self.velocities);
    }

    /// Its state as a snapshot has it.
    #[must_use]
    pub fn start(&self) -> Body {
        let mut state = SoftState::default();
        self.write_state(&mut state);
        Body::Soft(state)
    }
}
