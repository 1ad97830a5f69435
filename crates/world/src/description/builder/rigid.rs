//! Rigid bodies of a scene built in code.
//!
//! In: measures. Out: a [`RigidSpec`]. Never here: the scene.

use super::{RATE_DEFAULT_HZ, SURFACE};
use glam::{DQuat, DVec3};
use metachron_geometry::{CompoundPart, ContactTraits, Solid};
use metachron_models::rigid::{GivenInertia, Keyframe, RigidSpec};

/// A rigid body before it is added.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct Rigid {
    pub(super) spec: RigidSpec,
    pub(super) gravity_scale: f64,
    pub(super) rate_hz: f64,
}

impl Rigid {
    /// A body of this shape: 1 kg at the origin, at rest.
    #[must_use]
    pub fn new(solid: Solid) -> Self {
        let (friction, restitution) = SURFACE;
        let spec = RigidSpec { friction, restitution, sleep: true, ..RigidSpec::free(solid, DVec3::ZERO, 1.0) };
        Self { spec, gravity_scale: 1.0, rate_hz: RATE_DEFAULT_HZ }
    }

    /// A ball of this radius, metres.
    #[must_use]
    pub fn ball(radius_m: f64) -> Self {
        Self::new(Solid::Ball { radius_m })
    }

    /// Several solids as one body, each with the origin and the rotation of its axes in the body's, metres. All are
    /// equally dense; see [`CompoundPart::density`].
    #[must_use]
    pub fn compound(parts: impl IntoIterator<Item = CompoundPart>) -> Self {
        Self::new(Solid::Compound { parts: parts.into_iter().collect() })
    }

    /// A capsule along z of this radius and this half length of its straight part, metres.
    #[must_use]
    pub fn capsule(radius_m: f64, half_height_m: f64) -> Self {
        Self::new(Solid::Capsule { radius_m, half_height_m })
    }

    /// A box with these half edges, metres.
    #[must_use]
    pub fn cuboid(half_extents_m: [f64; 3]) -> Self {
        Self::new(Solid::Box { half_extents_m: half_extents_m.into() })
    }

    setters! {
        /// Its mass, kilograms, within [`MASS`](metachron_models::rigid::MASS).
        mass_kg: f64 => spec.mass_kg;
        /// Where its mass is, in place of evenly inside its shape.
        inertia: GivenInertia => spec.inertia;
        /// Position of its shape's origin, metres.
        at: [f64; 3] => spec.position;
        /// Rotation from its shape's axes to the world's.
        turned: DQuat => spec.rotation;
        /// Velocity at the start, m/s.
        velocity_m_s: [f64; 3] => spec.velocity;
        /// Coefficient of restitution, within [`RESTITUTION`](metachron_geometry::RESTITUTION).
        restitution: f64 => spec.restitution;
        /// Coulomb friction coefficient, within [`FRICTION`](metachron_geometry::FRICTION).
        friction: f64 => spec.friction;
        /// How many times as strong gravity is for it; below zero it rises.
        gravity_scale: f64 => gravity_scale;
        /// Along which axes of the world it does not move: x, y, z.
        lock_translation: [bool; 3] => spec.restraint.locked_translation;
        /// About which axes of the world it does not turn: x, y, z.
        lock_rotation: [bool; 3] => spec.restraint.locked_rotation;
        /// Its contact traits: the groups that it collides with, rules of pairs, whether it only senses.
        contact: ContactTraits => spec.traits;
        /// Steps a simulated second, 1 … 100000.
        rate_hz: f64 => rate_hz;
    }

    /// By which rates its velocity and its angular momentum decay, 1/s, within the range of [`LIMITS`](metachron_models::rigid::LIMITS).
    #[must_use]
    pub const fn damping_per_s(mut self, linear_per_s: f64, angular_per_s: f64) -> Self {
        let restraint = &mut self.spec.restraint;
        (restraint.linear_damping_per_s, restraint.angular_damping_per_s) = (linear_per_s, angular_per_s);
        self
    }

    /// Kinematic: it moves as [`metachron_runtime::Command::pose`] and its keyframes lead it, and gives way to nothing.
    /// Bodies that touch it push back; [`metachron_core::Snapshot::contact_wrench`] has their wrench. Its mass and
    /// velocity have no meaning.
    #[must_use]
    pub fn kinematic(mut self) -> Self {
        self.spec.led.get_or_insert_default();
        self
    }

    /// Kinematic, with one more keyframe: at `at_s` seconds of its time, later than the one before, the origin of its shape is at `position_m`,
    /// metres, turned by `rotation`. It starts in the first.
    #[must_use]
    pub fn keyframe(mut self, at_s: f64, position_m: [f64; 3], rotation: DQuat) -> Self {
        let led = self.spec.led.get_or_insert_default();
        let key = Keyframe { at_s, tip_m: position_m.into(), rotation, jaw: 0.0 };
        if led.keyframes.is_empty() {
            (self.spec.position, self.spec.rotation) = (key.tip_m, rotation);
        }
        led.keyframes.push(key);
        self
    }

    /// Whether its keyframes start again after the last.
    #[must_use]
    pub fn repeating(mut self) -> Self {
        self.spec.led.get_or_insert_default().repeat = true;
        self
    }
}
