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

/// Whether what carries a body there bears a `push` on it, N·s or a sum of directions: it goes towards the feet, taken together.
pub fn is_borne(feet: &[Foot], push: DVec3) -> bool {
    feet.iter().map(|foot| foot.normal).sum::<DVec3>().dot(push) < 0.0
}
