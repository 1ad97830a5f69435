//! A tube's publication: its snapshot.
//!
//! In: a tube between two steps. Out: its curve, and the data that others need to touch it. Never here: any change of its state.

use super::inertia::CurveInertia;
use super::residual;
use super::state::RodState;
use super::tube::Tube;
use glam::DVec3;
use metachron_core::{Bounds, Inertia, Snapshot};

/// The bounding box of a tube in this state that is nowhere wider than `radius_m`.
pub fn bounds(state: &RodState, radius_m: f64) -> Bounds {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for x in &state.x {
        (low, high) = (low.min(*x), high.max(*x));
    }
    let speed = state.u.iter().step_by(2).map(|v| v.length_squared()).fold(0.0, f64::max).sqrt();
    Bounds { low: low - radius_m, high: high + radius_m, speed_m_s: speed }
}

impl Tube {
    /// Writes everything except the time.
    pub(super) fn publish(&self, into: &mut Snapshot) {
        into.clear();
        into.steps = self.steps;
        into.resolution = Some(self.resolution);
        into.energy_j = self.energy_j();
        into.drift_m = self.doubling.error_m();
        into.residual_m = residual::estimate_m(&self.now, &self.matter, &self.division) + into.drift_m;
        into.grips.clone_from(&self.grips);
        (into.at_rest, into.grounded) = (self.at_rest, self.lately.is_grounded());
        into.bounds = Some(bounds(&self.now, self.widest_m()));
        self.publish_curve(into);
        self.publish_coupling(into);
    }

    fn publish_curve(&self, into: &mut Snapshot) {
        let curve = into.body.curve_mut();
        curve.arc_m.clone_from(&self.division.arc_m);
        curve.positions.clone_from(&self.now.x);
        curve.velocities.clear();
        curve.velocities.extend(self.now.u.iter().step_by(2));
        curve.frames.clone_from(&self.now.q);
        curve.radii_m.clear();
        curve.radii_m.extend(self.division.arc_m.iter().map(|&s| self.radius_at_m(s)));
    }

    /// Response to impulses, where a neighbour is near enough to need it; ledgers and pairs.
    fn publish_coupling(&self, into: &mut Snapshot) {
        let company = &self.stepper.company;
        if company.is_watched() || self.steps == 0 {
            into.acceleration = if self.steps == 0 { self.spec.gravity } else { self.acceleration };
            let inertia = into.inertia.response_mut::<CurveInertia>();
            let response = self.stepper.published_response();
            inertia.copy_from(response.factor, response.span_s, self.matter.held, &self.now.u);
            inertia.copy_supports(response.supported, &self.standing_accelerations);
            inertia.accelerations.clone_from(&self.accelerations);
            inertia.ahead_s = self.ahead_s;
            inertia.copy_masses(&self.matter, &self.division.length, &self.now.t);
        } else {
            into.inertia = Inertia::Immovable;
        }
        company.write(into);
    }
}
