//! Published response of a soft body to impulses: its factor.
//!
//! In: the factor of the last substep. Out: the velocities that impulses cause. Never here: which impulses.

use super::system::Factor;
use crate::coupling::{Carried, Foot, Lies};
use glam::DVec3;

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

    /// The feet on which it rests.
    pub(crate) fn feet(&self) -> &[Foot] {
        self.standing.feet()
    }

    /// The predicted acceleration of each slot, with the supports where they have `borne` the impulses; empty if unknown.
    pub(crate) fn foretold(&self, borne: bool) -> &[DVec3] {
        self.standing.accelerations().filter(|_| borne).unwrap_or(&self.accelerations)
    }

    /// Number of slots: one for each vertex; zero before the first step.
    #[must_use]
    pub const fn slots(&self) -> usize {
        self.factor.vertices()
    }

    /// Appends the scale of the inverse mass of each slot: enough for the step size of an iteration.
    pub(crate) fn scale(&self, into: &mut Vec<f64>) {
        into.extend_from_slice(&self.mobilities);
    }

    /// Change of its acceleration in the coming step, m/s², by displacements that its state does not yet contain, one for each vertex and
    /// divided by its step (m/s): elastic forces cancel those in stiff directions (docs/theory/soft.md, eq. 16d).
    pub(crate) fn take_back(&self, borne: bool, shares: &mut [DVec3], room: &mut Vec<DVec3>) {
        room.clear();
        room.extend(shares.iter().zip(&self.mass_kg).map(|(share, mass)| *share * *mass));
        self.respond(room, borne);
        let damped = 2.0 + self.span_s * self.damping_per_s;
        shares.iter_mut().zip(room).for_each(|(share, moved)| *share = (*moved * damped - *share * 2.0) / self.span_s);
    }

    /// Replaces impulses, one for each slot (N·s), by the velocities they cause (m/s), with the supports where they have `borne` them,
    /// or without.
    ///
    /// # Panics
    /// If their number differs from [`Self::slots`].
    pub fn respond(&self, impulses: &mut [DVec3], borne: bool) {
        assert_eq!(impulses.len(), self.slots(), "one impulse a slot");
        self.standing.factor().filter(|_| borne).unwrap_or(&self.factor).respond(impulses);
    }
}
