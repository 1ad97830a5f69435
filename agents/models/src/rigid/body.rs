//! The rigid body agent.
//!
//! In: a [`RigidSpec`]. Out: a snapshot. Never here: its steps ([`super::member`]).

use super::mass_properties::MassDistribution;
use super::member::Unknowns;
use super::motion::{Flight, Motion};
use super::{RigidError, RigidSpec};
use glam::{DQuat, DVec3};
use metachron_contact::{Agent, Input, Inputs, SetMotion, Stepping};
use metachron_core::{Archive, ArchiveError, Body, Bounds, RigidState, Snapshot, archive_values};
use metachron_geometry::{CollisionShape, ShapeKind, SolidShape};
use std::sync::Arc;

/// A rigid body with its own clock.
pub struct RigidBody {
    pub(super) distribution: MassDistribution,
    pub(super) flight: Flight,
    pub(super) may_sleep: bool,
    pub(super) motion: Motion,
    pub(super) form: Arc<CollisionShape>,
    /// No point of it is farther from its centre of mass, metres.
    pub(super) radius_m: f64,
    /// The mean acceleration of the last step, m/s².
    pub(super) acceleration: DVec3,
    /// How its spin changed in the mean of that step, rad/s².
    pub(super) angular_acceleration: DVec3,
    pub(super) at_rest: bool,
    pub(super) quiet_s: f64,
    /// Its unknowns in a contact cluster.
    pub(super) unknowns: Unknowns,
}

/// A body in contact that moves slower than this everywhere is still, m/s: below the visible.
pub(super) const STILL_M_S: f64 = 2e-3;
/// A body that was still for this long of its own time is at rest, seconds.
pub(super) const REST_S: f64 = 0.5;

impl RigidBody {
    /// Builds the body of `spec`.
    ///
    /// # Errors
    /// [`RigidError`] for a shape without volume, a plane and a number outside its range.
    pub fn new(spec: RigidSpec) -> Result<Self, RigidError> {
        spec.check_numbers()?;
        let distribution = MassDistribution::of_body(&spec)?;
        let rotation = spec.rotation.normalize();
        let mut motion = Motion {
            position: spec.position + rotation * distribution.com,
            rotation,
            velocity: spec.restraint.translation(spec.velocity),
            angular: DVec3::ZERO,
        };
        motion.set_spin(&distribution, spec.restraint.rotation(spec.spin));
        let flight = Flight { gravity: spec.restraint.translation(spec.gravity), restraint: spec.restraint };
        let shape = SolidShape::moving(&spec.solid, distribution.com)?;
        let radius_m = shape.radius_m;
        let kind = ShapeKind::Solid(shape);
        let RigidSpec { friction, restitution, traits, .. } = spec;
        let form = CollisionShape { kind, friction, restitution, traits };
        let mut body = Self {
            distribution,
            flight,
            may_sleep: spec.sleep,
            motion,
            form: Arc::new(form),
            radius_m,
            acceleration: flight.gravity,
            angular_acceleration: DVec3::ZERO,
            at_rest: false,
            quiet_s: 0.0,
            unknowns: Unknowns::default(),
        };
        body.unknowns.start([body.motion.velocity, body.motion.spin(&body.distribution)]);
        Ok(body)
    }

    /// The centre of mass in the shape's own axes, metres.
    ///
    /// A snapshot holds the position of the centre of mass: a point `p` of the shape is at `position + rotation * (p − com_local)`.
    #[must_use]
    pub fn com_local(&self) -> DVec3 {
        self.distribution.com
    }

    /// The speed that its spin gives to its farthest point, m/s.
    pub(super) fn swing_m_s(&self) -> f64 {
        self.radius_m * self.motion.spin(&self.distribution).length()
    }

    /// The box around it.
    fn bounds(&self) -> Bounds {
        Bounds {
            low: self.motion.position - self.radius_m,
            high: self.motion.position + self.radius_m,
            speed_m_s: self.motion.velocity.length() + self.swing_m_s(),
        }
    }
}

impl Agent for RigidBody {
    fn model(&self) -> &'static str {
        "rigid"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Cluster(self)
    }

    fn inputs(&self) -> Inputs {
        use Input::{Force, Place, Spring, State, Torque, Velocity};
        Inputs::of(&[Spring, Force, Torque, Place, Velocity, State])
    }

    fn set_motion(&mut self, set: &SetMotion) -> bool {
        let Self { motion, distribution, flight: Flight { restraint, .. }, .. } = self;
        let origin_m = set.position_m.unwrap_or(motion.position - motion.rotation * distribution.com);
        let spin_rad_s = restraint.rotation(set.spin_rad_s.unwrap_or_else(|| motion.spin(distribution)));
        let rotation = set.rotation.map_or(motion.rotation, DQuat::normalize);
        let velocity = restraint.translation(set.velocity_m_s.unwrap_or(motion.velocity));
        let mut to = Motion { position: origin_m + rotation * distribution.com, rotation, velocity, ..*motion };
        to.set_spin(distribution, spin_rad_s);
        if !to.is_sane(distribution) {
            return false;
        }
        *motion = to;
        (self.at_rest, self.quiet_s) = (false, 0.0);
        (self.acceleration, self.angular_acceleration) = (DVec3::ZERO, DVec3::ZERO);
        self.unknowns.start([velocity, spin_rad_s]);
        true
    }

    fn set_state(&mut self, state: &Body) -> Result<(), String> {
        let Body::Rigid(state) = state else { return Err("a rigid body has the state of one".to_owned()) };
        let rotation = state.rotation.normalize();
        let set = SetMotion {
            position_m: Some(state.position - rotation * self.distribution.com),
            rotation: Some(rotation),
            velocity_m_s: Some(state.velocity),
            spin_rad_s: Some(state.spin),
        };
        let is_taken = set.is_sound() && self.set_motion(&set);
        is_taken.then_some(()).ok_or_else(|| "a number is not finite or too large".to_owned())
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        Some(self.form.clone())
    }

    /// Its estimate of its own error is the rounding of its coordinates.
    fn write_snapshot(&self, into: &mut Snapshot) {
        into.clear();
        into.resolution = None;
        into.body = Body::Rigid(RigidState {
            position: self.motion.position,
            rotation: self.motion.rotation,
            velocity: self.motion.velocity,
            spin: self.motion.spin(&self.distribution),
        });
        into.energy_j = self.motion.energy_j(&self.distribution, self.flight.gravity);
        into.residual_m = (self.motion.position.abs().max_element() + self.radius_m) * f64::EPSILON;
        (into.at_rest, into.acceleration) = (self.at_rest, self.acceleration);
        into.angular_acceleration = self.angular_acceleration;
        into.inertia = self.answers();
        into.bounds = Some(self.bounds());
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.motion, self.acceleration, self.angular_acceleration)?;
        archive_values!(archive, self.at_rest, self.quiet_s)?;
        self.unknowns.archive(archive)
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        let linear = self.motion.velocity * self.distribution.mass_kg;
        (linear, self.motion.position.cross(linear) + self.motion.angular)
    }

    fn mass_kg(&self) -> f64 {
        self.distribution.mass_kg
    }
}
