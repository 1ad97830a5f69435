//! Publication of a soft body: its snapshot.
//!
//! In: a body between two steps. Out: its vertices, and the data that peers need for contact. Never here: any change of its state.

use super::body::SoftBody;
use super::inertia::SoftInertia;
use metachron_core::{Inertia, Snapshot};

impl SoftBody {
    /// Writes everything but the time.
    pub(super) fn publish(&self, into: &mut Snapshot) {
        into.clear();
        into.steps = self.steps;
        into.resolution = None;
        into.energy_j = self.energy_j();
        into.drift_m = self.doubling.watch.error_m();
        into.residual_m = self.mesh.residual_m(&self.positions) + into.drift_m;
        into.grips.clone_from(&self.grips);
        (into.at_rest, into.grounded) = (self.at_rest, self.lately.is_grounded());
        into.acceleration = self.acceleration;
        into.bounds = Some(self.bounds());
        let soft = into.body.soft_mut();
        soft.positions.clone_from(&self.positions);
        soft.velocities.clone_from(&self.velocities);
        if self.company.is_watched() && self.steps > 0 {
            let inertia = into.inertia.response_mut::<SoftInertia>();
            let (answer, lies) = self.footing.told(self.system.answer());
            inertia.copy_from(answer, &self.contacts.mobilities);
            inertia.stand(lies, &self.foretold.standing);
            inertia.accelerations.clone_from(&self.foretold.accelerations);
            inertia.span_s = self.foretold.span_s;
            inertia.mass_kg.clone_from(&self.mesh.mass_kg);
            inertia.damping_per_s = self.spec.matter.damping_per_s;
        } else {
            into.inertia = Inertia::Immovable;
        }
        self.company.mates().write(into);
        into.touches.extend(self.knock.on());
    }
}
