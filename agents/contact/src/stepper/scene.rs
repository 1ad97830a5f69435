//! What never changes around all clusters of a scene: static solids and joints.
//!
//! In: the obstacles and joints of a scene. Out: the same, ready for searches; shared by all clusters. Never here: what moves.

use crate::joint::{Joint, JointError};
use glam::{DQuat, DVec3};
use metachron_core::AgentId;
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, touches};
use metachron_geometry::{
    Aabb, CollisionShape, Obstacle, PlacedShape, ShapeError, ShapeKind, ShapePose, Solid, SolidShape, Touch,
};
use std::sync::Arc;

/// The surroundings that all clusters of a scene share.
#[derive(Debug, Default)]
pub struct ClusterScene {
    /// The strength of gravity, m/s², ≥ 0: what closes no faster than it does within a macro step does not rebound.
    pub gravity_m_s2: f64,
    statics: Vec<StaticSolid>,
    joints: Arc<[Joint]>,
    /// Numbers of joints, by their first bodies and then by themselves.
    by_body: Vec<u32>,
    /// Pairs of jointed bodies that do not collide, the lower number first, sorted.
    apart: Vec<[AgentId; 2]>,
}

impl ClusterScene {
    /// The surroundings of `obstacles`.
    ///
    /// # Errors
    /// [`ShapeError`] for an invalid solid.
    pub fn new(obstacles: &[Obstacle], gravity: DVec3) -> Result<Self, ShapeError> {
        Ok(Self {
            gravity_m_s2: gravity.length(),
            statics: obstacles.iter().map(StaticSolid::new).collect::<Result<_, _>>()?,
            ..Self::default()
        })
    }

    /// The same with `joints` between rigid bodies.
    ///
    /// # Errors
    /// [`JointError`] for a number outside its range.
    pub fn jointed(self, joints: Arc<[Joint]>) -> Result<Self, JointError> {
        joints.iter().try_for_each(Joint::check)?;
        let mut by_body: Vec<u32> = (0..).zip(joints.iter()).map(|(number, _)| number).collect();
        by_body.sort_by_key(|&number| joints[number as usize].a);
        let passing = joints.iter().filter(|joint| !joint.collide);
        let pairs = passing.filter_map(|joint| joint.b.map(|b| [joint.a.min(b), joint.a.max(b)]));
        let mut apart: Vec<_> = pairs.collect();
        apart.sort_unstable();
        apart.dedup();
        Ok(Self { joints, by_body, apart, ..self })
    }

    /// The joints whose first body is `id`, with their numbers.
    pub fn joints_of(&self, id: AgentId) -> impl Iterator<Item = (u32, &Joint)> {
        let first = self.by_body.partition_point(|&number| self.joints[number as usize].a < id);
        let joints = self.by_body[first..].iter().map(|&number| (number, &self.joints[number as usize]));
        joints.take_while(move |(_, joint)| joint.a == id)
    }

    /// Whether two jointed bodies pass through each other; the lower number first.
    pub fn lets_through(&self, pair: [AgentId; 2]) -> bool {
        self.apart.binary_search(&pair).is_ok()
    }

    /// The static solids, by their numbers.
    pub fn statics(&self) -> &[StaticSolid] {
        &self.statics
    }
}

#[derive(Debug)]
pub struct StaticSolid {
    form: CollisionShape,
    position: DVec3,
    rotation: DQuat,
}

impl StaticSolid {
    fn new(obstacle: &Obstacle) -> Result<Self, ShapeError> {
        let kind = ShapeKind::Solid(SolidShape::new(obstacle.solid.clone(), DVec3::ZERO)?);
        let form = CollisionShape { kind, friction: obstacle.friction, restitution: obstacle.restitution };
        Ok(Self { form, position: obstacle.position, rotation: obstacle.rotation.normalize() })
    }

    pub fn form(&self) -> &CollisionShape {
        &self.form
    }

    pub fn may_meet(&self, _bounds: &Aabb) -> bool {
        true
    }

    pub fn touches(
        &self,
        body: &PlacedShape<'_>,
        reach_m: f64,
        scratch: &mut NarrowPhaseScratch,
        into: &mut Vec<Touch>,
    ) {
        let ShapeKind::Solid(solid) = &self.form.kind else { return };
        if let (Solid::Plane, ShapeKind::Solid(mine), ShapePose::Solid { position, .. }) =
            (&solid.solid, &body.form.kind, body.view)
        {
            let half = 4.0 * mine.radius_m;
            let up = self.rotation * DVec3::Z;
            let Ok(slab) = SolidShape::new(Solid::Box { half_extents_m: DVec3::splat(half) }, DVec3::ZERO) else {
                return;
            };
            let form = CollisionShape { kind: ShapeKind::Solid(slab), friction: 0.0, restitution: 0.0 };
            let at = position - up * (up.dot(position - self.position) + half);
            let view = ShapePose::Solid { position: at, rotation: self.rotation };
            touches(body, &PlacedShape { form: &form, view }, reach_m, scratch, into);
            return;
        }
        let view = ShapePose::Solid { position: self.position, rotation: self.rotation };
        touches(body, &PlacedShape { form: &self.form, view }, reach_m, scratch, into);
    }
}
