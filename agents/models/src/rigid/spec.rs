//! Specification of a rigid body: its properties and initial state, the numbers a scene gives, and their checks.

use super::mass_properties::MassDistribution;
use crate::symmetric::principal_axes;
use crate::trajectory::Keyframe;
use glam::{DMat3, DQuat, DVec3};
use metachron_core::{NumberRange, OutOfRange, Ranges, unit_rotation};
use metachron_geometry::{ContactTraits, FRICTION, RESTITUTION, ShapeError, Solid, SolidShape};

/// Ranges of the numbers of [`RigidSpec`] and its [`Restraint`].
pub const LIMITS: Ranges = Ranges(&[
    ("mass_kg", MASS),
    ("restitution", RESTITUTION),
    ("linear_damping_per_s", DAMPING),
    ("angular_damping_per_s", DAMPING),
]);
/// Range of the mass.
pub const MASS: NumberRange = NumberRange::new(1e-9, 1e9, "kg");
const DAMPING: NumberRange = NumberRange::new(0.0, 1e6, "1/s");

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
    /// Mass, kilograms, within [`MASS`].
    pub mass_kg: f64,
    /// Where its mass is; `None` for evenly inside its shape.
    pub inertia: Option<GivenInertia>,
    /// Coefficient of restitution, within [`RESTITUTION`]; a pair takes the larger.
    pub restitution: f64,
    /// Coulomb friction coefficient, within [`FRICTION`]; a pair takes the geometric mean.
    pub friction: f64,
    /// Its groups, combine rules, spin friction, and whether it is a sensor.
    pub traits: ContactTraits,
    /// Gravity, m/s².
    pub gravity: DVec3,
    /// Whether the body may report that it is at rest.
    pub sleep: bool,
    /// Its damping, and the axes along and about which it cannot move.
    pub restraint: Restraint,
    /// How it is led, of a kinematic body ([`super::KinematicBody`]), whose mass, velocity, spin and gravity have no meaning; `None` for a
    /// body that moves by the forces on it.
    pub led: Option<Led>,
}

/// Mass properties that were measured or computed elsewhere, in place of those of the shape.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct GivenInertia {
    /// Centre of mass in the shape's axes, metres.
    pub com_m: DVec3,
    /// Inertia tensor about the centre of mass along the shape's axes, kg·m²: symmetric, its principal moments above zero, none larger than
    /// the sum of the other two.
    pub about_com_kg_m2: DMat3,
}

/// The damping of a rigid body wherever it is, and the axes of the world along and about which it does not move.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Restraint {
    /// Its velocity decays by this rate, 1/s, within the range of [`LIMITS`].
    pub linear_damping_per_s: f64,
    /// Its angular momentum likewise.
    pub angular_damping_per_s: f64,
    /// Whether it is kept from moving along x, y, z.
    pub locked_translation: [bool; 3],
    /// Whether it is kept from turning about x, y, z. Of a body that turns about two axes, gyroscopic torques are left out.
    pub locked_rotation: [bool; 3],
}

impl Restraint {
    /// The part of a velocity along free axes, m/s.
    pub(super) fn translation(&self, v: DVec3) -> DVec3 {
        left(self.locked_translation, v)
    }

    /// The part of a spin about free axes, rad/s.
    pub(super) fn rotation(&self, w: DVec3) -> DVec3 {
        left(self.locked_rotation, w)
    }

    /// Whether it locks an axis of rotation.
    pub(super) const fn locks_rotation(&self) -> bool {
        let [x, y, z] = self.locked_rotation;
        x || y || z
    }

    /// Whether it locks any axis.
    pub(super) const fn locks(&self) -> bool {
        let [x, y, z] = self.locked_translation;
        x || y || z || self.locks_rotation()
    }
}

fn left(locked: [bool; 3], v: DVec3) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|i| if locked[i] { 0.0 } else { v[i] }))
}

/// How a kinematic body moves where no command leads it.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Led {
    /// Poses of the origin of its axes, times rising; jaws have no meaning. None for one that stays where it is.
    pub keyframes: Vec<Keyframe>,
    /// Whether the motion starts again after the last keyframe.
    pub repeat: bool,
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
    #[error(transparent)]
    BadNumber(#[from] OutOfRange),
    /// No body has these principal moments of inertia.
    #[error(
        "the inertia has the principal moments {moments_kg_m2:?} kg·m²; they must be above zero, and none larger than the sum of the others"
    )]
    BadInertia {
        /// The moments, kg·m²; not numbers where the tensor is not symmetric.
        moments_kg_m2: [f64; 3],
    },
    /// A vector is not finite, or too large.
    #[error("{what} must be finite and within the range of single precision")]
    BadVector {
        /// Which one.
        what: &'static str,
    },
    /// A rotation is not finite, or zero.
    #[error("{what} must be a quaternion that is finite and not zero")]
    BadRotation {
        /// Which one.
        what: &'static str,
    },
}

/// The largest coordinate or speed accepted, metres or m/s: beyond it a contact solver in single precision would lose all resolution.
pub(super) const REACH_MAX: f64 = 1e6;

/// The longest script, seconds (11 days).
const SCRIPT_MAX_S: f64 = 1e6;

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
            inertia: None,
            restitution: 0.0,
            friction: 0.5,
            traits: ContactTraits::default(),
            gravity: DVec3::ZERO,
            sleep: false,
            restraint: Restraint::default(),
            led: None,
        }
    }

    /// Its centre of mass in the axes of its shape, metres; their origin where the shape is none.
    #[must_use]
    pub fn com_local(&self) -> DVec3 {
        MassDistribution::of_body(self).map_or(DVec3::ZERO, |distribution| distribution.com)
    }

    /// Shifts its start and its keyframes, metres.
    pub fn shift(&mut self, by_m: DVec3) {
        self.position += by_m;
        self.led.iter_mut().flat_map(|led| &mut led.keyframes).for_each(|key| key.tip_m += by_m);
    }

    /// Whether a body can be built of it.
    ///
    /// # Errors
    /// [`RigidError`] for a shape without volume, a plane and a number outside its range.
    pub fn check(&self) -> Result<(), RigidError> {
        self.check_numbers()?;
        SolidShape::moving(&self.solid, MassDistribution::of_body(self)?.com)?;
        Ok(())
    }

    /// Whether every number is in its range.
    pub(super) fn check_numbers(&self) -> Result<(), RigidError> {
        if matches!(self.solid, Solid::Plane) {
            return Err(RigidError::MovingPlane);
        }
        let Restraint { linear_damping_per_s, angular_damping_per_s, .. } = self.restraint;
        LIMITS.check([self.mass_kg, self.restitution, linear_damping_per_s, angular_damping_per_s])?;
        FRICTION.check("friction", self.friction)?;
        self.inertia.as_ref().map_or(Ok(()), GivenInertia::check)?;
        vector("the position", self.position)?;
        vector("the velocity", self.velocity)?;
        vector("the spin", self.spin)?;
        vector("the gravity", self.gravity)?;
        rotation("the rotation", self.rotation)?;
        self.led.as_ref().map_or(Ok(()), Led::check)
    }
}

/// How much of the largest moment the triangle inequality may be missed by: moments are written with a few digits.
const TRIANGLE_SLACK: f64 = 1e-3;

impl GivenInertia {
    /// Whether a body can have it.
    ///
    /// # Errors
    /// [`RigidError::BadVector`] for a centre out of reach, [`RigidError::BadInertia`] for a tensor that no body has.
    pub fn check(&self) -> Result<(), RigidError> {
        vector("the centre of mass", self.com_m)?;
        let tensor = self.about_com_kg_m2;
        if !(tensor.is_finite() && tensor.abs_diff_eq(tensor.transpose(), 0.0)) {
            return Err(RigidError::BadInertia { moments_kg_m2: [f64::NAN; 3] });
        }
        let moments = principal_axes(tensor).values;
        let (least, greatest) = (moments.min_element(), moments.max_element());
        let triangle = 2.0 * greatest <= moments.element_sum() + TRIANGLE_SLACK * greatest;
        if least > 0.0 && triangle { Ok(()) } else { Err(RigidError::BadInertia { moments_kg_m2: moments.to_array() }) }
    }
}

impl Led {
    fn check(&self) -> Result<(), RigidError> {
        let mut before_s = 0.0;
        for (at, key) in self.keyframes.iter().enumerate() {
            let rises = if at == 0 { key.at_s >= before_s } else { key.at_s > before_s };
            let is_good = rises && key.at_s <= SCRIPT_MAX_S;
            let expected = "one later than that before, from 0 to 1e6 s";
            OutOfRange::unless(is_good, "the time of a keyframe", key.at_s, expected)?;
            before_s = key.at_s;
            vector("the position of a keyframe", key.tip_m)?;
            rotation("the rotation of a keyframe", key.rotation)?;
        }
        Ok(())
    }
}

fn vector(what: &'static str, value: DVec3) -> Result<(), RigidError> {
    if value.abs().max_element() <= REACH_MAX && value.is_finite() {
        Ok(())
    } else {
        Err(RigidError::BadVector { what })
    }
}

fn rotation(what: &'static str, value: DQuat) -> Result<(), RigidError> {
    unit_rotation(value).map(drop).ok_or(RigidError::BadRotation { what })
}
