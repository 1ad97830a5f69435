//! What an island knows of its members and of the solids that stand still.
//!
//! In: a [`RigidBody`] and the obstacles of its spec. Out: what both solvers need of them. Never here: how anything moves.

use super::super::mass_properties::MassDistribution;
use super::super::motion::Motion;
use super::super::{RigidBody, RigidError};
use glam::{DQuat, DVec3};
use metachron_core::AgentId;
use metachron_core::{Mat6, Twist};
use metachron_geometry::{Obstacle, Solid, StaticSolidError};
use rapier3d::parry::math::{Pose, Rotation};
use rapier3d::parry::query::{DefaultQueryDispatcher, QueryDispatcher};
use rapier3d::parry::shape::SharedShape;

/// A body of the island.
pub(super) struct Member {
    /// Who it is.
    pub id: AgentId,
    /// Where its body is in the crew: 0 leads, k is the k-th companion.
    pub seat: usize,
    /// Its mass.
    pub spread: MassDistribution,
    /// Its shape, in its own axes.
    pub shape: SharedShape,
    /// No point of it is farther from the centre of mass, metres.
    pub radius_m: f64,
    /// Coulomb friction coefficient.
    pub friction: f64,
    /// Coefficient of restitution.
    pub restitution: f64,
    /// Its state: the truth, in double precision.
    pub motion: Motion,
    /// The velocity and the spin that it was given at the start of the step, until its first part has begun, m/s and rad/s.
    pub received: Twist,
    /// Gravity of the part being solved, m/s²; zero where a spring's solution has it already.
    pub gravity: DVec3,
    /// How springs on it, and tools that press it, resist what the island does to it in the part being solved, about its centre of mass.
    pub springs: Option<Mat6>,
    /// By how much the island changed its velocities in the last part, for those springs and tools.
    pub bent: Twist,
    /// Nothing but gravity and the island moves it in this step: its body is asked for nothing between the parts.
    pub alone: bool,
    /// Whether one that bends presses it, and wants to know how it answers among its fellows,
    pub asked: bool,
    /// and how it does, where that is known: its inverse mass about its centre.
    pub answer: Option<Mat6>,
    /// Whether it touched anything in the last part.
    pub touching: bool,
    /// How deep it sank into anything in the last part, metres, ≥ 0.
    pub depth_m: f64,
    /// How long it has been a member, seconds.
    pub joined_s: f64,
}

impl Member {
    pub(super) fn new(id: AgentId, seat: usize, body: &RigidBody) -> Self {
        Self {
            id,
            seat,
            spread: body.spread,
            shape: body.world.mover.shape.clone(),
            radius_m: body.world.mover.radius_m,
            friction: body.company.form.friction,
            restitution: body.company.form.restitution,
            motion: body.motion,
            received: [DVec3::ZERO; 2],
            gravity: body.gravity,
            springs: None,
            bent: [DVec3::ZERO; 2],
            alone: false,
            asked: false,
            answer: None,
            touching: body.touching,
            depth_m: 0.0,
            joined_s: 0.0,
        }
    }

    /// The fastest point of the body, m/s, at most.
    pub(super) fn speed_m_s(&self) -> f64 {
        self.motion.velocity.length() + self.motion.spin(&self.spread).length() * self.radius_m
    }

    /// Whether the balls around the two overlap.
    pub(super) fn is_near(&self, other: &Self) -> bool {
        self.motion.position.distance(other.motion.position) < self.radius_m + other.radius_m
    }

    /// The share of the way to `there` that it certainly gets before it may touch `other`.
    pub(super) fn free_share(&self, there: &Motion, other: &Self) -> f64 {
        let Motion { position, rotation, .. } = self.motion;
        let way_m = there.position.distance(position) + there.rotation.angle_between(rotation) * self.radius_m;
        if position.distance(other.motion.position) > self.radius_m + other.radius_m + way_m {
            return 1.0;
        }
        let [mine, theirs] = [self, other].map(|member| pose_about(position, member.origin(), member.motion.rotation));
        let gap = DefaultQueryDispatcher.distance(&mine.inv_mul(&theirs), self.shape.as_ref(), other.shape.as_ref());
        (gap.map_or(0.0, |gap| f64::from(gap.distance)) / way_m).min(1.0)
    }

    /// Where its shape's axes start, metres.
    fn origin(&self) -> DVec3 {
        self.motion.position - self.motion.rotation * self.spread.com
    }

    /// How far any point of it gets within `h` seconds, metres, at most.
    pub(super) fn travel_m(&self, h: f64) -> f64 {
        h * (self.speed_m_s() + h * self.gravity.length())
    }
}

/// A solid that never moves, as islands see it.
pub(super) struct Ground {
    /// Its shape, in its own axes.
    pub shape: SharedShape,
    /// Where its axes start, metres.
    pub position: DVec3,
    /// Rotation from its axes to the world's.
    pub rotation: DQuat,
    /// Coulomb friction coefficient.
    pub friction: f64,
    /// Coefficient of restitution.
    pub restitution: f64,
    /// Whether it is a half space, which has no end.
    plane: bool,
    /// Lowest and highest corner in world axes.
    bounds: (DVec3, DVec3),
}

impl Ground {
    pub(super) fn new(obstacle: &Obstacle) -> Result<Self, RigidError> {
        let shape = obstacle
            .solid
            .to_shared_shape()
            .map_err(|source| StaticSolidError::Shape { name: obstacle.name.clone(), source })?;
        let rotation = obstacle.rotation.normalize();
        let bounds = shape.compute_aabb(&pose_about(DVec3::ZERO, obstacle.position, rotation));
        Ok(Self {
            shape,
            position: obstacle.position,
            rotation,
            friction: obstacle.friction,
            restitution: obstacle.restitution,
            plane: matches!(obstacle.solid, Solid::Plane),
            bounds: (bounds.mins.as_dvec3(), bounds.maxs.as_dvec3()),
        })
    }

    /// Whether no point of it is within `reach` of `place`.
    pub(super) fn is_beyond(&self, place: DVec3, reach: f64) -> bool {
        if self.plane {
            return (self.rotation * DVec3::Z).dot(place - self.position) > reach;
        }
        place.distance(place.clamp(self.bounds.0, self.bounds.1)) > reach
    }

    /// Where its axes start for somebody near `origin`: a plane is the same wherever along itself it is placed.
    pub(super) fn position_near(&self, origin: DVec3) -> DVec3 {
        if !self.plane {
            return self.position;
        }
        let normal = self.rotation * DVec3::Z;
        origin - normal * normal.dot(origin - self.position)
    }
}

/// A pose in single precision, about `origin`.
pub(super) fn pose_about(origin: DVec3, position: DVec3, rotation: DQuat) -> Pose {
    let q = rotation.as_quat();
    Pose::from_parts((position - origin).as_vec3(), Rotation::from_xyzw(q.x, q.y, q.z, q.w).normalize())
}
