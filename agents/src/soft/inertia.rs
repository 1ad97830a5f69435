//! How a soft body answers impulses: its factor, as others may know it.
//!
//! In: the factor of the substep that ended last. Out: the velocities that impulses cause. Never here: which impulses.

use super::system::Factor;
use glam::DVec3;

/// A soft body's answer to impulses: A⁻¹ of its own step (docs/theory/soft.md, eq. 2), held vertices left out.
#[derive(Debug, Clone, Default)]
pub struct SoftInertia {
    factor: Factor,
    /// Of each vertex by itself, 1/kg.
    mobilities: Vec<f64>,
}

impl SoftInertia {
    /// Takes over a factor into the storage that is here.
    pub(super) fn copy_from(&mut self, factor: &Factor, mobilities: &[f64]) {
        self.factor.copy_from(factor);
        self.mobilities.clear();
        self.mobilities.extend_from_slice(mobilities);
    }

    /// How many slots it knows: one a vertex; zero before the first step.
    #[must_use]
    pub const fn slots(&self) -> usize {
        self.factor.vertices()
    }

    /// Appends the size of the inverse mass of each slot: enough for the scale of an iteration.
    pub(crate) fn scale(&self, into: &mut Vec<f64>) {
        into.extend_from_slice(&self.mobilities);
    }

    /// Turns impulses, one a slot (N·s), into the velocities they cause (m/s).
    ///
    /// # Panics
    /// Where there are not as many as [`Self::slots`].
    pub fn respond(&self, impulses: &mut [DVec3]) {
        assert_eq!(impulses.len(), self.slots(), "one impulse a slot");
        self.factor.respond(impulses);
    }
}
