//! Solids that never move, and their contacts with bodies of every kind.
//!
//! In: an [`Obstacle`], a placed body. Out: places with normals from the solid towards the body, the box around the solid.
//! Never here: what a touch does, how long a flight past them lasts.
//!
//! A rigid body meets a plane as the top face of a slab under it, larger than it: so its corners and edges rest on it
//! as on any face. A deformable meets the plane itself. A mesh is its triangles, an open one too: balls, capsules,
//! tubes and skins meet its distance field, other shapes each triangle near them.

use super::blocks::mesh_convex::PlacedMesh;
use super::primitives::{Block, Piece, Pieces};
use super::swept::{Element, ElementPair, Elements, NEAR_M, SweptScratch, first_share};
use super::{NarrowPhaseScratch, SweptReach, SweptShape, finish, touches};
use crate::solids::signed_distance::{Ball, Field};
use crate::{
    Aabb, CollisionShape, CompoundPart, Obstacle, PlacedShape, ShapeError, ShapeKind, ShapePose, Solid, SolidShape,
};
use crate::{Touch, is_closed, mesh_triangles};
use glam::{DMat3, DQuat, DVec3, Vec3};
use metachron_core::unit_rotation;
use rapier3d::parry::shape::Cuboid;

/// Half the size of a plane's slab, in radii of the body: it reaches past the body on all sides, and as deep.
const SLAB_RADII: f64 = 4.0;
/// A static solid at its place.
#[derive(Debug)]
pub struct StaticSolid {
    /// Its shape and skin.
    pub form: CollisionShape,
    position: DVec3,
    rotation: DQuat,
    mesh: Option<StaticMesh>,
    bounds: Aabb,
}

/// The triangles of a static mesh, in its own axes.
#[derive(Debug)]
struct StaticMesh {
    field: Field,
    /// How deep inside it a point is still pushed out, metres: an open mesh is felt from behind only within reach.
    deep_m: f64,
    /// A ball around it, in its own axes.
    around: Ball,
}

/// Why a static solid is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StaticSolidError {
    /// Its solid is invalid.
    #[error("the shape of the static solid `{name}` is invalid: {source}")]
    Shape {
        /// The solid's name.
        name: String,
        /// The fault of its shape.
        source: ShapeError,
    },
    /// Its place is not finite, or its rotation is zero.
    #[error("the place of the static solid `{name}` must be finite and its rotation not zero")]
    Place {
        /// The solid's name.
        name: String,
    },
}

impl StaticSolid {
    /// The solid of an obstacle.
    ///
    /// # Errors
    /// [`StaticSolidError`] for an invalid shape or place.
    pub fn new(obstacle: &Obstacle) -> Result<Self, StaticSolidError> {
        let Obstacle { name, solid, position, friction, restitution, traits, .. } = obstacle;
        let Some(rotation) = unit_rotation(obstacle.rotation).filter(|_| position.is_finite()) else {
            return Err(StaticSolidError::Place { name: name.clone() });
        };
        let bad = |source| StaticSolidError::Shape { name: name.clone(), source };
        let kind = ShapeKind::Solid(SolidShape::new(solid.clone(), DVec3::ZERO).map_err(bad)?);
        let form = CollisionShape { kind, friction: *friction, restitution: *restitution, traits: *traits };
        let mesh = StaticMesh::of(solid).map_err(bad)?;
        let bounds = bounds(solid, *position, rotation);
        Ok(Self { form, position: *position, rotation, mesh, bounds })
    }

    /// Where the origin of its axes is, metres.
    #[must_use]
    pub const fn position(&self) -> DVec3 {
        self.position
    }

    /// From its axes to the world's.
    #[must_use]
    pub const fn rotation(&self) -> DQuat {
        self.rotation
    }

    /// Its shape where it is.
    #[must_use]
    pub const fn placed(&self) -> PlacedShape<'_> {
        let view = ShapePose::Solid { position: self.position, rotation: self.rotation };
        PlacedShape { form: &self.form, view }
    }

    /// The box around it; that of a plane has no bounds.
    #[must_use]
    pub const fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Every place with a gap of at most `reach_m` (metres, ≥ 0) between a body and this, with normals towards the body, by rising keys; the
    /// previous contents of `into` are dropped.
    pub fn touches(
        &self,
        body: &PlacedShape<'_>,
        reach_m: f64,
        scratch: &mut NarrowPhaseScratch,
        into: &mut Vec<Touch>,
    ) {
        let is_rigid = matches!(body.form.kind, ShapeKind::Solid(_) | ShapeKind::Tool(_));
        match &self.mesh {
            Some(_) => {
                into.clear();
                scratch.known.prepare_pieces(body);
                self.touch_mesh(body, reach_m, scratch, into);
                finish(into);
            }
            None if self.is_plane() && is_rigid => {
                into.clear();
                scratch.known.prepare_pieces(body);
                self.touch_slab(body, reach_m, scratch, into);
                finish(into);
            }
            None => _ = touches(body, &self.placed(), reach_m, scratch, into),
        }
    }

    /// The share 0 … 1 of a body's motion at which it first comes within reach of this, and its contacts at that moment, by
    /// rising keys; `None` and no contacts where it does not ([`super::first_touch`]). A body behind a triangle of a mesh passes through it.
    pub fn first_touch(
        &self,
        body: &SweptShape<'_>,
        reach: SweptReach,
        scratch: &mut NarrowPhaseScratch,
        into: &mut Vec<Touch>,
    ) -> Option<f64> {
        into.clear();
        let mut swept = std::mem::take(&mut scratch.swept);
        let share = self.first_share(body, reach.reach_m, scratch, &mut swept);
        let [storage, _] = &mut swept.placed;
        if let Some(then) = share.and_then(|share| body.within(share, storage)) {
            self.touches(&then, reach.reach_m + reach.around_m, scratch, into);
        }
        scratch.swept = swept;
        share
    }

    fn first_share(
        &self,
        body: &SweptShape<'_>,
        reach_m: f64,
        scratch: &mut NarrowPhaseScratch,
        swept: &mut SweptScratch,
    ) -> Option<f64> {
        let plane = self.is_plane().then(|| Element::HalfSpace { point: self.position, up: self.rotation * DVec3::Z });
        let field = self.mesh.as_ref().and_then(|mesh| mesh.field.mesh());
        if plane.is_none() && field.is_none() {
            let view = ShapePose::Solid { position: self.position, rotation: self.rotation };
            let placed = PlacedShape { form: &self.form, view };
            return first_share(body, &SweptShape { start: placed, end: placed }, reach_m, &mut scratch.known, swept);
        }
        scratch.known.prepare_pieces(&body.start);
        let elements = Elements::of(body, &scratch.known)?;
        let mut earliest: Option<f64> = None;
        let mut meet = |number: usize, other: Element<'_>, face: DVec3| {
            let pair = ElementPair { elements: [elements.element(number), other], reach_m, latest: earliest };
            let meeting = pair.meeting(&mut swept.hull).filter(|meeting| meeting.normal.dot(face) >= 0.0);
            earliest = meeting.map(|meeting| meeting.share).or(earliest);
        };
        for number in 0..elements.count() {
            let around = elements.bounds(number).grown(reach_m + NEAR_M);
            if !(around.low.is_finite() && around.high.is_finite()) {
                continue;
            }
            if let Some(Element::HalfSpace { point, up }) = plane {
                meet(number, Element::HalfSpace { point, up }, up);
            } else if let Some(field) = field {
                field.triangles_in(around.seen_from(self.position, self.rotation), |_, corners, face| {
                    let start = corners.map(|corner| self.position + self.rotation * corner);
                    let other = Element::Corners { start, ways: [DVec3::ZERO; 3], radii_m: [0.0; 3] };
                    meet(number, other, self.rotation * face);
                });
            }
        }
        earliest
    }

    const fn is_plane(&self) -> bool {
        matches!(&self.form.kind, ShapeKind::Solid(SolidShape { solid: Solid::Plane, .. }))
    }

    /// Adds the places of a rigid body on a plane: each of its pieces on a slab under it.
    fn touch_slab(
        &self,
        body: &PlacedShape<'_>,
        reach_m: f64,
        scratch: &mut NarrowPhaseScratch,
        into: &mut Vec<Touch>,
    ) {
        let NarrowPhaseScratch { known, searches, .. } = scratch;
        for (number, piece) in Pieces::of(body, known).iter() {
            let body = match &body.form.kind {
                ShapeKind::Solid(form) => Ball { centre: solid_centre(body), radius_m: form.radius_m },
                _ => piece.around(),
            };
            let up = self.rotation * DVec3::Z;
            let height_m = up.dot(body.centre - self.position);
            // a body whose middle is behind the plane has to be pushed back through it, and not out of the slab's side
            let half_m = SLAB_RADII * (body.radius_m + (-height_m).max(0.0));
            let slab = Cuboid::new(Vec3::splat(half_m as f32));
            let origin = body.centre - up * (height_m + half_m);
            let around = Ball { centre: origin, radius_m: f64::from(slab.local_bounding_sphere().radius) };
            let Ok(field) = Field::of(&Solid::Box { half_extents_m: DVec3::splat(half_m) }) else { continue };
            let slab = Piece::Block(Block {
                field: Some(&field),
                shape: &slab,
                origin,
                rotation: self.rotation,
                around,
                deep_m: 2.0 * around.radius_m,
                pierces: false,
            });
            searches.touches([(number, &piece), (0, &slab)], reach_m, into);
        }
    }

    /// Adds the places of a body on a mesh.
    fn touch_mesh(
        &self,
        body: &PlacedShape<'_>,
        reach_m: f64,
        scratch: &mut NarrowPhaseScratch,
        into: &mut Vec<Touch>,
    ) {
        let (ShapeKind::Solid(form), Some(mesh)) = (&self.form.kind, &self.mesh) else { return };
        let (Some(triangles), Some(field)) = (form.shape.as_trimesh(), mesh.field.mesh()) else { return };
        let NarrowPhaseScratch { known, searches, .. } = scratch;
        let (origin, rotation) = (self.position, self.rotation);
        let placed = PlacedMesh { field, triangles, origin, rotation };
        let around = Ball { centre: origin + rotation * mesh.around.centre, ..mesh.around };
        let (field, shape, deep_m) = (Some(&mesh.field), form.shape.as_ref(), mesh.deep_m);
        let whole = Piece::Block(Block { field, shape, origin, rotation, around, deep_m, pierces: false });
        for (number, piece) in Pieces::of(body, known).iter() {
            let from = into.len();
            if let Piece::Block(block) = &piece {
                searches.blocks.touches_mesh(block, &placed, reach_m, into);
                into[from..].iter_mut().for_each(|touch| touch.key.pieces = [number as u8, 0]);
            } else {
                searches.touches([(number, &piece), (0, &whole)], reach_m, into);
            }
        }
    }
}

/// The centre of mass of a placed solid.
fn solid_centre(body: &PlacedShape<'_>) -> DVec3 {
    if let ShapePose::Solid { position, .. } = body.view { position } else { DVec3::NAN }
}

impl StaticMesh {
    /// The mesh of a solid that is one.
    fn of(solid: &Solid) -> Result<Option<Self>, ShapeError> {
        let Solid::Mesh { points_m, triangles } = solid else { return Ok(None) };
        let mesh = mesh_triangles(points_m, triangles)?;
        let Aabb { low, high } = Aabb::of(points_m);
        let centre = (low + high) * 0.5;
        let radius_m = points_m.iter().map(|p| p.distance(centre)).fold(0.0, f64::max);
        let deep_m = if is_closed(&mesh) { 2.0 * radius_m } else { 0.0 };
        Ok(Some(Self { field: Field::of(solid)?, deep_m, around: Ball { centre, radius_m } }))
    }
}

/// The box around a solid at its place.
fn bounds(solid: &Solid, position: DVec3, rotation: DQuat) -> Aabb {
    let turned = DMat3::from_quat(rotation);
    let axis = turned.z_axis.abs();
    let across = |radius_m: f64| (DVec3::ONE - axis * axis).max(DVec3::ZERO).map(f64::sqrt) * radius_m;
    let half = match solid {
        Solid::Plane => return Aabb::everywhere(),
        Solid::Compound { parts } => {
            let of_part = |part: &CompoundPart| {
                bounds(&part.solid, position + rotation * part.position_m, rotation * part.rotation)
            };
            return parts.iter().map(of_part).reduce(Aabb::union).unwrap_or(Aabb::about(position, 0.0));
        }
        Solid::Hull { points_m } | Solid::Mesh { points_m, .. } => {
            let of_point = |point: &DVec3| position + rotation * *point;
            let boxes = points_m.iter().map(|point| Aabb::about(of_point(point), 0.0));
            return boxes.reduce(Aabb::union).unwrap_or(Aabb::about(position, 0.0));
        }
        Solid::Ball { radius_m } => DVec3::splat(*radius_m),
        Solid::Box { half_extents_m: half } => {
            turned.x_axis.abs() * half.x + turned.y_axis.abs() * half.y + turned.z_axis.abs() * half.z
        }
        Solid::Capsule { radius_m, half_height_m } => axis * *half_height_m + *radius_m,
        Solid::Cylinder { radius_m, half_height_m } => axis * *half_height_m + across(*radius_m),
    };
    Aabb { low: position - half, high: position + half }
}
