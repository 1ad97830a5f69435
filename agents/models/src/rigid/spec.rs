//! Specification of a rigid body: its properties and initial state, the numbers a scene gives, and their checks.

use glam::{DQuat, DVec3};
use metachron_geometry::{ContactTraits, ShapeError, Solid};

/// A rigid body before it is built.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct RigidSpec {
    /// Its shape; not a plane. An open mesh counts as its convex hull.
    pub solid: Solid,
    /// Position of the origin of the shape's axes, metres.
    pub position: DVec3,
    /// Rotation from the shape's axes to the world's.
    pub rotation: DQuat,
    /// Velocity of the centre of mass at the start, m/s.
    pub velocity: DVec3,
    /// Angular velocity at the start, rad/s, world axes.
    pub spin: DVec3,
    /// Mass, kilograms, > 0.
    pub mass_kg: f64,
    /// Coefficient of restitution, 0 … 1; a pair takes the larger.
    pub restitution: f64,
    /// Coulomb friction coefficient, ≥ 0; a pair takes the geometric mean.
    pub friction: f64,
    /// What else it says about its contacts.
    pub traits: ContactTraits,
    /// Gravity, m/s².
    pub gravity: DVec3,
    /// Whether the body may report that it is at rest.
    pub sleep: bool,
}

/// Why a rigid body cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RigidError {
    /// The solid is invalid.
    #[error("the shape of the rigid body is invalid: {0}")]
    Shape(#[from] ShapeError),
    /// A plane is unbounded, so it has no mass.
    #[error("a plane cannot be a moving body; make it a static solid")]
    MovingPlane,
    /// A number is outside its range.
    #[error("{what} is {value}; it must be {wanted}")]
    BadNumber {
        /// Which number.
        what: &'static str,
        /// The value given.
        value: f64,
        /// The range it must be in.
        wanted: &'static str,
    },
    /// A vector or rotation is not finite, too large, or a rotation is zero.
    #[error("{what} must be finite and within the range of single precision")]
    BadVector {
        /// Which one.
        what: &'static str,
    },
}

/// The largest coordinate or speed accepted, metres or m/s: beyond it a contact solver in single precision would lose all resolution.
pub(super) const REACH_MAX: f64 = 1e6;

impl RigidSpec {
    /// A solid of `mass_kg` at `position` on which nothing acts: zero velocity, no gravity, friction 0.5, no bounce;
    /// it never reports rest.
    #[must_use]
    pub fn free(solid: Solid, position: DVec3, mass_kg: f64) -> Self {
        Self {
            solid,
            position,
            rotation: DQuat::IDENTITY,
            velocity: DVec3::ZERO,
            spin: DVec3::ZERO,
            mass_kg,
            restitution: 0.0,
            friction: 0.5,
            traits: ContactTraits::default(),
            gravity: DVec3::ZERO,
            sleep: false,
        }
    }

    /// Whether every number is in its range.
    pub(super) fn check(&self) -> Result<(), RigidError> {
        if matches!(self.solid, Solid::Plane) {
            return Err(RigidError::MovingPlane);
        }
        number("the mass", self.mass_kg, (1e-9, 1e9), "between 1e-9 and 1e9 kg")?;
        number("the restitution", self.restitution, (0.0, 1.0), "between 0 and 1")?;
        number("the friction", self.friction, (0.0, 1e3), "between 0 and 1000")?;
        vector("the position", self.position)?;
        vector("the velocity", self.velocity)?;
        vector("the spin", self.spin)?;
        vector("the gravity", self.gravity)?;
        rotation("the rotation", self.rotation)
    }
}

fn number(what: &'static str, value: f64, range: (f64, f64), wanted: &'static str) -> Result<(), RigidError> {
    let good = (range.0..=range.1).contains(&value);
    if good { Ok(()) } else { Err(RigidError::BadNumber { what, value, wanted }) }
}

fn vector(what: &'static str, value: DVec3) -> Result<(), RigidError> {
    if value.abs().max_element() <= REACH_MAX && value.is_finite() {
        Ok(())
    } else {
        Err(RigidError::BadVector { what })
    }
}

fn rotation(what: &'static str, value: DQuat) -> Result<(), RigidError> {
    let good = value.is_finite() && value.length_squared() > 0.0;
    if good { Ok(()) } else { Err(RigidError::BadVector { what }) }
}
