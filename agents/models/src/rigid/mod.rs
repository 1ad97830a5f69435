//! Rigid body agents: exact flight in double precision.
//!
//! In: a [`RigidSpec`], steps. Out: the body's motion about its centre of mass. Never here: contacts, joints and springs; they are rows
//! of the problem of the cluster that steps the body (docs/theory/clusters.md).
//!
//! A body follows its parabola in closed form and rotates by a splitting that conserves the angular momentum (`motion.rs`), so free fall
//! is exact to rounding at any step and for any time.
//!
//! A kinematic body (`kinematic.rs`) has the same shape, moves as it is led, and gives way to nothing.
//!
//! Two rules hold for every pair: friction is the geometric mean of both coefficients, restitution the larger of both.

mod body;
mod kinematic;
mod mass_properties;
mod member;
mod motion;
mod spec;

pub use crate::trajectory::Keyframe;
pub use body::RigidBody;
pub use kinematic::KinematicBody;
pub use metachron_contact::joint::{JOINT_GAP_MAX_M, Joint, JointError, JointKind, Mimic, Motor, MotorGoal};
pub use spec::{GivenInertia, LIMITS, Led, MASS, Restraint, RigidError, RigidSpec};

#[cfg(test)]
mod tests;
