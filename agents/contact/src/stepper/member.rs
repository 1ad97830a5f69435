//! What a body offers the cluster that it is stepped in.
//!
//! In: steps, velocities. Out: a matrix, velocities without contact, a skin, how points of it move. Never here: contacts, other bodies.

use crate::cluster::{Block, Response, Side};
use glam::DVec3;
use metachron_core::{Anchor, StepError};
use metachron_geometry::{ContactSide, Place, PlacedShape};

/// A body that a cluster steps together with all that it touches. Its unknowns are blocks of three velocities: nodes (m/s), spins (rad/s).
///
/// A step is `begin`, then `move_to` within it where others make shorter steps, then `end`. A refused `begin` leaves the state as it was,
/// and so does a `begin` with no `end`. `keep` and `go_back` frame several steps that may have to be made again.
pub trait ClusterMember: Send {
    /// How it takes part.
    fn role(&self) -> Role;

    /// Prepares a step of `h_s` seconds from its present state: its matrix A and the velocities at the step's end without contact.
    ///
    /// # Errors
    /// [`StepError::Diverged`] where the matrix has no factor.
    fn begin(&mut self, h_s: f64) -> Result<(), StepError>;

    /// The lower half of A = M + h C + h² K of the step begun: symmetric and positive definite, kg or kg·m². Blocks that never move
    /// stand for themselves, and no side refers to them.
    fn blocks(&self) -> &[Block];

    /// The factor of that matrix, where `begin` has made one.
    fn response(&self) -> Option<&dyn Response> {
        None
    }

    /// The velocity of each block at the end of the step begun, if nothing touched the body.
    fn free(&self) -> &[DVec3];

    /// The velocity of each block now.
    fn velocities(&self) -> &[DVec3];

    /// Its skin where it is now; `None` where nothing can touch it.
    fn skin(&self) -> Option<PlacedShape<'_>>;

    /// How the point `place` of its skin moves with its blocks, for one side of a contact. The side's member is left to the caller.
    fn side(&self, place: &Place, contact: ContactSide) -> Side;

    /// The material point `anchor`; `None` for one that the body does not have.
    fn anchor(&self, anchor: Anchor) -> Option<MaterialPoint>;

    /// The speed of its fastest point where its blocks have the velocities `v`, m/s.
    fn speed_bound(&self, v: &[DVec3]) -> f64 {
        v.iter().map(|v| v.length_squared()).fold(0.0, f64::max).sqrt()
    }

    /// By how much the velocities `v` would turn or stretch it in a step of `h_s` seconds, as a share of what its linear forces can take:
    /// above 1 the step should be divided. Zero for a body whose forces are exact.
    fn strain(&self, v: &[DVec3], h_s: f64) -> f64 {
        let _ = (v, h_s);
        0.0
    }

    /// Keeps the present state, at the end of a step.
    fn keep(&mut self);

    /// Goes back to the state kept last.
    fn go_back(&mut self);

    /// Places the skin where it is `t_s` seconds into the step begun, having moved with the velocities `v` from its start.
    fn move_to(&mut self, v: &[DVec3], t_s: f64);

    /// Ends the step begun, of `h_s` seconds, with these velocities. `touched` is false where nothing acted on the body but blows at the
    /// start, which account for what `v` is beyond its free velocities: its motion after them is then its own.
    ///
    /// # Errors
    /// [`StepError::Diverged`] where the state would not be finite; it is then what it was before.
    fn end(&mut self, v: &[DVec3], h_s: f64, touched: bool) -> Result<(), StepError>;

    /// Whether it has been still long enough to rest, as far as it can tell by itself.
    fn is_calm(&self) -> bool;

    /// Stops it: it rests until something wakes it.
    fn rest(&mut self);

    /// The cost of the step begun, in the unit of [`metachron_core::StepReport::work`].
    fn work(&self) -> f64 {
        1.0
    }
}

/// How a member takes part in its cluster.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Moves as it is told; whatever it touches gives way. It has no blocks.
    Kinematic,
    /// Moves as a whole: its steps cost next to nothing, so it takes the shortest of its cluster.
    Rigid,
    /// Bends: it keeps steps of its own length.
    Deformable,
}

/// A point of a body's matter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaterialPoint {
    /// Its position, metres.
    pub position: DVec3,
    /// How it moves with the body's blocks.
    pub side: Side,
}
