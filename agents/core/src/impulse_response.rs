//! How a deformable answers impulses, as other agents may query it.
//!
//! In: impulses, one a slot. Out: the velocities that they cause. Never here: a model's own matrices; each model implements the trait for the
//! factor that it publishes. Theory: docs/theory/rod.md, eq. 17; docs/theory/soft.md, eq. 2.

use crate::Foot;
use glam::DVec3;
use std::any::Any;
use std::fmt::Debug;

/// A published answer to impulses: A⁻¹ of the deformable's own step.
///
/// A slot is one three-dimensional velocity: a vertex's or node's (m/s), or a segment's spin (rad/s). `supported` asks for the answer with
/// the static solids that carry the deformable; without it the deformable floats.
pub trait ImpulseResponse: Any + Debug + Send + Sync {
    /// Number of slots; zero before the first step.
    fn slots(&self) -> usize;

    /// Turns impulses, one a slot (N·s; N·m·s of a segment), into the velocities that they cause (m/s; rad/s).
    ///
    /// # Panics
    /// Where there are not as many as [`Self::slots`].
    fn respond(&self, impulses: &mut [DVec3], supported: bool);

    /// Appends the size of the inverse mass of each slot, 1/kg or 1/(kg·m²): enough for the scale of an iteration.
    fn append_mobilities(&self, into: &mut Vec<f64>);

    /// Predicted acceleration of each slot in the next step, m/s² and rad/s²; empty where it is not known.
    fn accelerations(&self, supported: bool) -> &[DVec3];

    /// Length of the substep that ended last, seconds: published velocities are means over it. Zero before the first.
    fn span_s(&self) -> f64;

    /// Length of the step that [`Self::accelerations`] predict, seconds; zero where they are those of the last step.
    fn forecast_s(&self) -> f64;

    /// Replaces `changed`, velocities that arrive when the predicted step begins, by the change of acceleration that they cause in it, m/s².
    /// `carried` is how far they have moved each slot by then, divided by that step, m/s; storage afterwards
    /// (docs/theory/soft.md, eq. 16d, 16e).
    fn elastic_change(&self, supported: bool, changed: &mut [DVec3], carried: &mut Vec<DVec3>);

    /// Places where static solids, or agents that these carry, support it.
    fn supports(&self) -> &[Foot];

    /// What only a curve offers: `None` for every other deformable.
    fn curve(&self) -> Option<&dyn CurveResponse> {
        None
    }

    /// A copy in storage of its own.
    fn boxed_clone(&self) -> Box<dyn ImpulseResponse>;
}

/// The part of a response that has slots for nodes and segments in turn.
pub trait CurveResponse {
    /// Spin of each segment, rad/s, world axes.
    fn spins(&self) -> &[DVec3];

    /// Turns velocities in slots into momenta (docs/theory/rod.md, eq. 11).
    fn momenta(&self, velocities: &mut [DVec3]);
}

impl Clone for Box<dyn ImpulseResponse> {
    fn clone(&self) -> Self {
        self.as_ref().boxed_clone()
    }
}
