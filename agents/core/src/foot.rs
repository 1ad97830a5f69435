//! The places where something fixed, or somebody whom that carries, carries a body that bends: they can push and not pull.
//!
//! In: where the body was pressed in its last step. Out: whether what pushes it presses it there. Never here: how the body answers them as it lies
//! there (`metachron_models::rod`, `metachron_models::soft`). Theory: docs/theory/coupling.md, eq. 7k and 7p.

use super::jacobian::ContactJacobian;
use glam::DVec3;

/// A foot is stiffer than the body itself there by this factor at most: it gives way by a thousandth.
const STIFFER: f64 = 1e3;

/// Such a place.
#[derive(Debug, Clone, Copy)]
pub struct Foot {
    /// The velocities of the body that it joins.
    pub slots: ContactJacobian,
    /// Out of what carries it.
    pub normal: DVec3,
    /// What it gives against a motion into it or out of it, kg.
    pub stiffness: f64,
}

/// All feet of a body: those on what is fixed, then those on others.
#[derive(Debug, Clone, Default)]
pub struct Stance {
    feet: Vec<Foot>,
    fixed: usize,
}

impl Stance {
    /// Finds the feet of a body: what `fixed` places join, with their normals, and those on others that `carry` appends. None is much stiffer
    /// than what the body resists with itself there, kg.
    pub fn find(
        &mut self,
        fixed: impl Iterator<Item = (ContactJacobian, DVec3)>,
        carry: impl FnOnce(&mut Vec<Foot>),
        inertia: impl Fn(&Foot) -> f64,
    ) {
        self.forget();
        self.feet.extend(fixed.map(|(slots, normal)| Foot { slots, normal, stiffness: f64::INFINITY }));
        self.fixed = self.feet.len();
        carry(&mut self.feet);
        self.feet.iter_mut().for_each(|foot| foot.stiffness = foot.stiffness.min(STIFFER * inertia(foot)));
    }

    /// It lies on nothing.
    pub fn forget(&mut self) {
        self.feet.clear();
        self.fixed = 0;
    }

    /// Whether it lies on nothing.
    pub fn is_empty(&self) -> bool {
        self.feet.is_empty()
    }

    /// Where it lies.
    pub fn feet(&self) -> &[Foot] {
        &self.feet
    }

    /// Where it lies on others, who have to be given what presses it there.
    pub fn on_others(&self) -> &[Foot] {
        &self.feet[self.fixed..]
    }

    /// Whether what it lies on bears this push, N·s.
    pub fn bears(&self, push: DVec3) -> bool {
        is_borne(&self.feet, push)
    }
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
