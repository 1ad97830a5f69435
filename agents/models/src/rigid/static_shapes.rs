//! The static solids around a body, and its contacts with them.
//!
//! In: the obstacles of a spec, the body where it is. Out: places on each. Never here: how long a flight past them lasts
//! ([`crate::rigid::conservative_advancement`]), what a touch does.
//!
//! A plane is represented by a slab under the body, larger than it, with its top at the plane: so corners and edges rest on it as on
//! any face. A mesh is tested triangle by triangle with parry: in single precision, relative to the mesh.

use super::company::placed;
use super::conservative_advancement::{MovingShape, pose};
use super::motion::Motion;
use glam::{DQuat, DVec3};
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, touches};
use metachron_geometry::{CollisionShape, Place, PlacedShape, ShapeKind, ShapePose, SolidShape, Touch};
use metachron_geometry::{Obstacle, ShapeError, Solid};
use rapier3d::parry::query::{
    ContactManifold, ContactManifoldsWorkspace, DefaultQueryDispatcher, PersistentQueryDispatcher,
};

/// All static solids.
pub(super) struct StaticShapes(Vec<Standing>);

/// One static solid.
pub(super) struct Standing {
    /// Its shape and skin.
    pub form: CollisionShape,
    position: DVec3,
    rotation: DQuat,
    /// Half the slab's height, for a plane, metres.
    slab_m: Option<f64>,
    /// Storage for triangle contacts, for a mesh.
    mesh: Option<MeshScratch>,
}

/// The body at its present place.
pub(super) struct Mine<'a> {
    pub form: &'a CollisionShape,
    pub mover: &'a MovingShape,
    pub motion: &'a Motion,
}

/// Storage for the touches of one mesh.
#[derive(Default)]
struct MeshScratch {
    manifolds: Vec<ContactManifold<(), ()>>,
    workspace: Option<ContactManifoldsWorkspace>,
}

/// Half the size of a plane's slab, in radii of the body: it reaches past the body on all sides, and as deep.
const SLAB_RADII: f64 = 4.0;
/// Bits of a triangle's corners, edges and face in keys, and of those of the body.
const FEATURE_BITS: u32 = 12;

impl StaticShapes {
    /// The forms of `obstacles` for a body of `radius_m`.
    ///
    /// # Errors
    /// [`ShapeError`] for an invalid solid.
    pub(super) fn new(obstacles: &[Obstacle], radius_m: f64) -> Result<Self, ShapeError> {
        let standing = obstacles.iter().map(|obstacle| {
            let slab_m = matches!(obstacle.solid, Solid::Plane).then_some(SLAB_RADII * radius_m);
            let slab = slab_m.map(|half| Solid::Box { half_extents_m: DVec3::splat(half) });
            let solid = slab.unwrap_or_else(|| obstacle.solid.clone());
            let mesh = matches!(solid, Solid::Mesh { .. }).then(MeshScratch::default);
            let kind = ShapeKind::Solid(SolidShape::new(solid, DVec3::ZERO)?);
            let form = CollisionShape { kind, friction: obstacle.friction, restitution: obstacle.restitution };
            let rotation = obstacle.rotation.normalize();
            Ok(Standing { form, position: obstacle.position, rotation, slab_m, mesh })
        });
        Ok(Self(standing.collect::<Result<_, _>>()?))
    }

    /// Each static solid.
    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Standing> {
        self.0.iter_mut()
    }
}

impl Standing {
    /// Every place with a gap of at most `reach_m` (metres, ≥ 0) between the body and this; the previous contents of `into` are dropped.
    pub(super) fn touches(
        &mut self,
        mine: &Mine<'_>,
        reach_m: f64,
        scratch: &mut NarrowPhaseScratch,
        into: &mut Vec<Touch>,
    ) {
        if self.mesh.is_some() {
            into.clear();
            self.touch_triangles(mine, reach_m, into);
        } else {
            let view = ShapePose::Solid { position: self.place(mine.motion.position), rotation: self.rotation };
            touches(&placed(mine.form, mine.motion), &PlacedShape { form: &self.form, view }, reach_m, scratch, into);
        }
    }

    /// The same for a mesh. Its inner edges are smoothed over: a body that slides across two coplanar triangles is not caught by their
    /// edge.
    fn touch_triangles(&mut self, mine: &Mine<'_>, reach_m: f64, into: &mut Vec<Touch>) {
        let (ShapeKind::Solid(SolidShape { shape, .. }), Some(scratch)) = (&self.form.kind, &mut self.mesh) else {
            return;
        };
        let MeshScratch { manifolds, workspace } = scratch;
        // old points would be carried along instead of being recomputed
        manifolds.iter_mut().for_each(|manifold| manifold.points.clear());
        let Mine { mover, motion, .. } = mine;
        let back = self.rotation.conjugate();
        let relative = pose(back * (mover.origin(motion) - self.position), back * motion.rotation);
        let (mesh, moving) = (shape.as_ref(), mover.shape.as_ref());
        let found =
            DefaultQueryDispatcher.contact_manifolds(&relative, mesh, moving, reach_m as f32, manifolds, workspace);
        if found.is_err() {
            return;
        }
        for manifold in manifolds {
            let normal = (self.rotation * manifold.local_n1.as_dvec3()).normalize_or_zero();
            let parts = u64::from(manifold.subshape1) << 32 | u64::from(manifold.subshape2) << (2 * FEATURE_BITS);
            for point in manifold.points.iter().filter(|point| f64::from(point.dist) <= reach_m) {
                let features = u64::from(point.fid1.0) << FEATURE_BITS | u64::from(point.fid2.0);
                let gap_m = f64::from(point.dist);
                let on = self.position + self.rotation * point.local_p1.as_dvec3();
                let (on_a, on_b) = (Place::Point(on + normal * gap_m), Place::Point(on));
                into.push(Touch { key: parts ^ features, normal, gap_m, on_a, on_b });
            }
        }
    }

    /// Position of its middle, for a body at `at`.
    fn place(&self, at: DVec3) -> DVec3 {
        let Some(half) = self.slab_m else { return self.position };
        let up = self.rotation * DVec3::Z;
        at - up * (up.dot(at - self.position) + half)
    }
}
