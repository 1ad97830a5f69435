//! A rigid body as an agent: exact flight in double precision, contacts in a rapier3d world of its own.
//!
//! In: a [`RigidSpec`], steps, what is around. Out: the body's motion about its centre of mass, and what it gives to others.
//! Never here: the state of another agent; a body meets others as they were last seen (docs/theory/coupling.md), but for
//! those that share its world (`island/`).
//!
//! Between touches a body follows its parabola in closed form and turns by a splitting that keeps the angular momentum
//! (`motion.rs`), so free fall is exact to rounding at any step and for any time. `clearance.rs` bounds how long that may
//! last. At a touch the blow is solved as if it took no time, so bounce heights do not depend on the step either: with all
//! that is touched at once, in double precision (`meeting.rs`). A body that stays in touch with fixed solids is carried by
//! the contact solver (`world.rs`, single precision, 4 small passes in at most 1/240 s), one that stays in touch with others by the solve of `meeting.rs`. Springs are implicit (`springs.rs`).
//!
//! Two rules hold for every pair: friction is the geometric mean of both coefficients, restitution the larger of both.

mod advance;
mod body;
mod borne;
mod company;
mod conservative_advancement;
mod exchange;
mod footing;
mod hold;
mod island;
mod joint;
mod leant;
mod linear_spring;
mod mass_properties;
mod meeting;
mod motion;
mod orientation_spring;
mod pair;
mod places;
mod sided;
mod spec;
mod spring_set;
mod static_shapes;
mod world;

pub use body::RigidBody;
pub use joint::{JOINT_GAP_MAX_M, Joint, JointError, JointKind};
pub use spec::{RigidError, RigidSpec};

#[cfg(test)]
mod tests;
