//! What never changes around all clusters of a scene: static solids.
//!
//! In: the obstacles of a scene. Out: the same, ready for searches; shared by all clusters. Never here: what moves.

use glam::{DQuat, DVec3};
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, touches};
use metachron_geometry::{
    Aabb, CollisionShape, Obstacle, PlacedShape, ShapeError, ShapeKind, ShapePose, Solid, SolidShape, Touch,
};

/// The surroundings that all clusters of a scene share.
#[derive(Debug, Default)]
pub struct ClusterScene {
    /// The strength of gravity, m/s², ≥ 0: what closes no faster than it does within a macro step does not rebound.
    pub gravity_m_s2: f64,
    statics: Vec<StaticSolid>,
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
        })
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
