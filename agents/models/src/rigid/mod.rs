//! Rigid body agents: exact flight in double precision, contacts in a rapier3d world per body.
//!
//! In: a [`RigidSpec`], steps with their context. Out: the body's motion about its centre of mass, and the impulses it gives.
//! Never here: the state of another agent; a body meets peers as they were last published (docs/theory/coupling.md), except
//! those in its island (`island/`).
//!
//! Between contacts a body follows its parabola in closed form and rotates by a splitting that conserves the angular momentum
//! (`motion.rs`), so free fall is exact to rounding at any step and for any time. `conservative_advancement.rs` bounds its duration.
//! An impact is solved as instantaneous, so bounce heights do not depend on the step either: with all simultaneous
//! contacts, in double precision (`meeting.rs`). In lasting contact with static solids a body is moved by
//! the contact solver (`world.rs`, single precision, 4 small passes in at most 1/240 s), in lasting contact with other agents by the
//! solve of `meeting.rs`. Springs are implicit (`linear_spring.rs`).
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
mod leant;
mod linear_spring;
mod mass_properties;
mod meeting;
mod member;
mod motion;
mod orientation_spring;
mod pair;
mod places;
mod sided;
mod spec;
mod spring_set;
mod world;

pub use body::RigidBody;
pub use metachron_contact::joint::{JOINT_GAP_MAX_M, Joint, JointError, JointKind};
pub use spec::{RigidError, RigidSpec};

#[cfg(test)]
mod tests;
