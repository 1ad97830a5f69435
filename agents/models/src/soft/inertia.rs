//! Published response of a soft body to impulses: its factor.
//!
//! In: the factor of the last substep. Out: the velocities that impulses cause. Never here: which impulses.

use super::system::Factor;
use glam::DVec3;
use metachron_core::ImpulseResponse;
use metachron_core::{Carried, Foot, Lies};

/// A soft body's response to impulses: A⁻¹ of its own step (docs/theory/soft.md, eq. 2), held vertices left out.
#[derive(Debug, Clone, Default)]
pub struct SoftInertia {
    factor: Factor,
    /// Its feet on supports, and its response there.
    standing: Carried<Factor>,
    /// Inverse mass of each vertex by itself, 1/kg.
    mobilities: Vec<f64>,
    /// Predicted acceleration of each vertex without impulses of peers, m/s².
    pub accelerations: Vec<DVec3>,
    /// The length of the last substep, seconds: published velocities are the means over it.
    pub span_s: f64,
    /// Mass of each vertex, kg, and damping, 1/s.
    pub(super) mass_kg: Vec<f64>,
    pub(super) damping_per_s: f64,
}

impl SoftInertia {
    /// Copies a factor into the existing storage.
    pub(super) fn copy_from(&mut self, factor: &Factor, mobilities: &[f64]) {
        self.factor.copy_from(factor);
        self.mobilities.clear();
        self.mobilities.extend_from_slice(mobilities);
    }

    /// Copies its feet and its predicted accelerations there.
    pub(super) fn stand(&mut self, lies: Lies<'_, Factor>, accelerations: &[DVec3]) {
        self.standing.take(lies, accelerations, Factor::copy_from);
    }
}

impl ImpulseResponse for SoftInertia {
    /// One a vertex.
    fn slots(&self) -> usize {
        self.factor.vertices()
    }

    fn respond(&self, impulses: &mut [DVec3], supported: bool) {
        assert_eq!(impulses.len(), self.slots(), "one impulse a slot");
        self.standing.factor().filter(|_| supported).unwrap_or(&self.factor).respond_at(impulses);
    }

    fn append_mobilities(&self, into: &mut Vec<f64>) {
        into.extend_from_slice(&self.mobilities);
    }

    fn accelerations(&self, supported: bool) -> &[DVec3] {
        self.standing.accelerations().filter(|_| supported).unwrap_or(&self.accelerations)
    }

    fn span_s(&self) -> f64 {
        self.span_s
    }

    fn forecast_s(&self) -> f64 {
        self.span_s
    }

    /// Elastic forces take back what is stiff (docs/theory/soft.md, eq. 16d).
    fn elastic_change(&self, supported: bool, changed: &mut [DVec3], scratch: &mut Vec<DVec3>) {
        scratch.clear();
        scratch.extend(changed.iter().zip(&self.mass_kg).map(|(share, mass)| *share * *mass));
        self.respond(scratch, supported);
        let damped = 2.0 + self.span_s * self.damping_per_s;
        changed
            .iter_mut()
            .zip(scratch)
            .for_each(|(share, moved)| *share = (*moved * damped - *share * 2.0) / self.span_s);
    }

    fn supports(&self) -> &[Foot] {
        self.standing.feet()
    }

    fn boxed_clone(&self) -> Box<dyn ImpulseResponse> {
        Box::new(self.clone())
    }
}
