//! The contact solver of one body: a rapier3d world of its own, single precision.
//!
//! In: a [`Motion`] that touches something. Out: the motion after a stretch of contact. Blows are [`super::meeting`]'s.
//! Never here: free flight and the time of the touch ([`super::motion`], [`crate::rigid::conservative_advancement`]), springs.
//!
//! A pair's friction is the geometric mean of both coefficients, its restitution the larger of both.

use super::conservative_advancement::{Fall, Fixed, ImpactTimes, MovingShape, pose};
use super::mass_properties::MassDistribution;
use super::motion::Motion;
use super::{RigidError, RigidSpec};
use glam::DVec3;
use metachron_geometry::StaticSolidError;
use rapier3d::dynamics::{
    CoefficientCombineRule, FrictionModel, IntegrationParameters, MassProperties, RigidBodyBuilder, RigidBodyHandle,
    SpringCoefficients,
};
use rapier3d::geometry::ColliderBuilder;
use rapier3d::parry::math::{Pose, Rotation, Vec3};
use rapier3d::parry::shape::SharedShape;
use rapier3d::pipeline::PhysicsWorld;

/// A body among fixed solids.
pub(super) struct World {
    sim: PhysicsWorld,
    body: RigidBodyHandle,
    /// The fixed solids, each with the restitution of the body's contact with it.
    fixed: Vec<(Fixed, f64)>,
    /// The moving shape.
    pub mover: MovingShape,
    /// The solver's copy of the motion is old: it must be told before the next contact.
    stale: bool,
}

/// Solver passes within a contact step; each is a small step of its own.
pub(super) const PASSES: usize = 4;
/// Natural frequency of a contact, Hz: rapier's 60 lets a resting box sag 5e-5 m, this 2e-6 m.
const STIFFNESS_HZ: f32 = 300.0;
/// Damping ratio of a contact, rapier's own.
const DAMPING_RATIO: f32 = 10.0;

impl World {
    /// Puts the body of `spec` among its obstacles.
    pub(super) fn new(spec: &RigidSpec, spread: &MassDistribution) -> Result<Self, RigidError> {
        let mover = MovingShape::new(&spec.solid, spread)?;
        let mut sim = PhysicsWorld { integration_parameters: parameters(), ..PhysicsWorld::default() };
        let mut fixed = Vec::with_capacity(spec.obstacles.len());
        for obstacle in spec.obstacles.iter() {
            let solid = Fixed::new(&obstacle.solid, obstacle.position, obstacle.rotation)
                .map_err(|source| StaticSolidError::Shape { name: obstacle.name.clone(), source })?;
            let (shape, at) = solid.placed();
            // what bounces is struck before: lasting contact does not
            sim.colliders.insert(collider(shape, obstacle.friction, 0.0).position(at));
            fixed.push((solid, obstacle.restitution.max(spec.restitution)));
        }
        let axes = spread.axes.as_quat();
        let properties = MassProperties::with_principal_inertia_frame(
            Vec3::ZERO,
            spread.mass_kg as f32,
            spread.moments.as_vec3(),
            Rotation::from_xyzw(axes.x, axes.y, axes.z, axes.w),
        );
        // the solver's body has its origin in the centre of mass, so that both copies of the state mean the same point
        let moving = RigidBodyBuilder::dynamic()
            .additional_mass_properties(properties)
            .can_sleep(false)
            .allow_fast_rotation(true)
            .gyroscopic_forces_enabled(true);
        let shape = collider(mover.shape.clone(), spec.friction, 0.0)
            .position(Pose::from_parts(-spread.com.as_vec3(), Rotation::IDENTITY));
        let (body, _) = sim.insert(moving, shape);
        Ok(Self { sim, body, fixed, mover, stale: true })
    }

    /// Seconds of certainly free flight, at most `horizon`.
    pub(super) fn free_time(&self, motion: &Motion, fall: Fall, horizon: f64) -> f64 {
        let all = self.fixed.iter().map(|(solid, _)| solid);
        all.fold(horizon, |free, solid| free.min(solid.approach(&self.mover, motion, fall, free).free_s))
    }

    /// What of the fixed solids lies ahead of a flight of `horizon` seconds.
    pub(super) fn ahead(&self, motion: &Motion, fall: Fall, horizon: f64) -> ImpactTimes {
        let mut ahead = ImpactTimes::clear(horizon);
        for (solid, restitution) in &self.fixed {
            ahead.add(solid.approach(&self.mover, motion, fall, horizon), *restitution);
        }
        ahead
    }

    /// The deepest overlap with a fixed solid, metres.
    pub(super) fn depth_m(&self, motion: &Motion) -> f64 {
        self.fixed.iter().map(|(solid, _)| solid.depth_m(&self.mover, motion)).fold(0.0, f64::max)
    }

    /// The motion was changed from outside: by a flight, a blow or a spring.
    pub(super) fn moved(&mut self) {
        self.stale = true;
    }

    /// Advances a touching body by `h` seconds.
    pub(super) fn contact(
        &mut self,
        motion: &mut Motion,
        spread: &MassDistribution,
        h: f64,
        gravity: DVec3,
    ) -> Result<(), &'static str> {
        if !motion.is_sane(spread) {
            return Err("the motion is out of the contact solver's reach");
        }
        self.tell(motion, spread);
        self.sim.gravity = gravity.as_vec3();
        self.sim.integration_parameters.dt = h as f32;
        self.sim.step();
        if !self.sim.quarantine().is_empty() {
            return Err("the contact solver lost the body");
        }
        let body = &self.sim.bodies[self.body];
        let turned = body.rotation();
        motion.position = body.translation().as_dvec3();
        motion.rotation =
            glam::DQuat::from_xyzw(f64::from(turned.x), f64::from(turned.y), f64::from(turned.z), f64::from(turned.w))
                .normalize();
        motion.velocity = body.linvel().as_dvec3();
        motion.set_spin(spread, body.angvel().as_dvec3());
        if motion.is_sane(spread) { Ok(()) } else { Err("the contact solver's answer is not finite") }
    }

    /// Brings the solver's copy up to date.
    fn tell(&mut self, motion: &Motion, spread: &MassDistribution) {
        if self.stale {
            let body = &mut self.sim.bodies[self.body];
            body.set_position(pose(motion.position, motion.rotation), true);
            body.set_linvel(motion.velocity.as_vec3(), true);
            body.set_angvel(motion.spin(spread).as_vec3(), true);
            self.stale = false;
        }
    }
}

/// The solver's settings: nothing reused from older poses, no cap on speed, the stiffer floor of [`STIFFNESS_HZ`].
///
/// `Simplified` friction acts in the middle of a patch of contacts. `Coulomb` acts in each point, clips the impulse that
/// would stop that point, and so points it up to 20° off the slip: a cube on a slope then feels 6 % too little (measured). Both turn
/// the friction of a long body that slides askew by a few degrees: a limit of clipping, whatever the passes.
fn parameters() -> IntegrationParameters {
    IntegrationParameters {
        num_solver_iterations: PASSES,
        num_internal_stabilization_iterations: 2,
        static_contact_softness: SpringCoefficients::new(STIFFNESS_HZ, DAMPING_RATIO),
        friction_model: FrictionModel::Simplified,
        contact_recycling: false,
        normalized_max_linear_velocity: f32::MAX,
        ..IntegrationParameters::default()
    }
}

/// A shape as the contact solver touches it; its mass comes from the body.
pub(super) fn collider(shape: SharedShape, friction: f64, restitution: f64) -> ColliderBuilder {
    ColliderBuilder::new(shape)
        .density(0.0)
        .friction(friction as f32)
        .friction_combine_rule(CoefficientCombineRule::GeometricMean)
        .restitution(restitution as f32)
        .restitution_combine_rule(CoefficientCombineRule::Max)
}
