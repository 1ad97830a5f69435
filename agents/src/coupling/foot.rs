//! A place where something fixed carries a body that bends: it can push and not pull.
//!
//! In: where the body was pressed in its last step. Out: whether what pushes it presses it there. Never here: how the body answers them as it lies
//! there ([`crate::rod`], [`crate::soft`]). Theory: docs/theory/coupling.md, eq. 7k.

use super::Slots;
use glam::DVec3;

/// Such a place.
#[derive(Debug, Clone, Copy)]
pub struct Foot {
    /// The velocities of the body that it joins.
    pub slots: Slots,
    /// Out of what is fixed.
    pub normal: DVec3,
    /// What it gives against a motion into it or out of it, kg.
    pub stiffness: f64,
}

/// Where a body lies, and its factor there; `None` for nowhere.
pub type Lies<'a, F> = Option<(&'a [Foot], &'a F)>;

/// What others know of a body that lies: where, its factor there, and how each slot will accelerate there.
#[derive(Debug, Clone, Default)]
pub struct Carried<F> {
    feet: Vec<Foot>,
    factor: F,
    accelerations: Vec<DVec3>,
}

impl<F> Carried<F> {
    /// Takes over where a body lies and how it will accelerate there, into the storage that is here; `copy` that of a factor.
    pub fn take(&mut self, lies: Lies<'_, F>, accelerations: &[DVec3], copy: impl FnOnce(&mut F, &F)) {
        self.feet.clear();
        self.accelerations.clear();
        self.accelerations.extend_from_slice(accelerations);
        if let Some((feet, factor)) = lies {
            self.feet.extend_from_slice(feet);
            copy(&mut self.factor, factor);
        }
    }

    /// Where it lies.
    pub fn feet(&self) -> &[Foot] {
        &self.feet
    }

    /// Its factor there, where it lies.
    pub fn factor(&self) -> Option<&F> {
        (!self.feet.is_empty()).then_some(&self.factor)
    }

    /// How it will accelerate there, where that is known.
    pub fn accelerations(&self) -> Option<&[DVec3]> {
        (!self.accelerations.is_empty()).then_some(&self.accelerations[..])
    }
}

/// Whether what carries a body there bears a `push` on it, N·s or a sum of directions: it goes towards the feet, taken together.
pub fn is_borne(feet: &[Foot], push: DVec3) -> bool {
    feet.iter().map(|foot| foot.normal).sum::<DVec3>().dot(push) < 0.0
}

/// Adds to `into` what feet take of a change of velocities, N·s and N·m·s in slots: it presses the body on them.
pub fn press(feet: &[Foot], velocities: &[DVec3], into: &mut [DVec3]) {
    for Foot { slots, normal, stiffness } in feet {
        slots.scatter(*normal * (normal.dot(slots.velocity(velocities)) * *stiffness), into);
    }
}
