//! Contacts of blocks with the triangles of a static mesh: each triangle is a convex part.
//!
//! In: a block and a mesh. Out: contacts with normals towards the block. Never here: strands and skins, which meet the mesh's distance field.
//!
//! A normal that leads into a neighbouring triangle is turned into the cone that the mesh allows there: a body that slides across
//! two coplanar triangles is not caught by their edge. A body behind a triangle does not touch it.

use super::convex_convex::{ConvexScratch, SAME_SHARE, SINGLE_SHARE, clip, parts, pose};
use super::gjk::{Convex, Difference, Found, Part, Rounded, Separation};
use crate::narrow_phase::primitives::Block;
use crate::narrow_phase::touch_key::{TouchKey, TouchKind};
use crate::solids::mesh_distance::MeshField;
use crate::{Aabb, Place, Touch};
use glam::{DQuat, DVec3};
use rapier3d::parry::bounding_volume::BoundingVolume;
use rapier3d::parry::query::details::NormalConstraints;
use rapier3d::parry::shape::{TriMesh, Triangle};

/// A normal whose cosine with that of a triangle is above this is the same.
const FACE: f64 = 1.0 - 1e-9;
/// Neighbours whose normals have a cosine above this with a triangle's are in its plane: a tenth of a degree.
const FLAT: f64 = 1.0 - 1e-6;
/// Where the mesh has turned a normal, a place is left out that is deeper by this factor than the way out before: it belongs to another
/// triangle.
const DEEPER: f64 = 5.0;

/// The triangles of a static mesh at its place.
pub(crate) struct PlacedMesh<'a> {
    /// Its triangles, in its axes.
    pub field: &'a MeshField,
    /// The same with the cones of normals.
    pub triangles: &'a TriMesh,
    /// Where its axes' origin is.
    pub origin: DVec3,
    /// From its axes to the world's.
    pub rotation: DQuat,
}

impl ConvexScratch {
    /// Every place within `reach_m`, with normals from the mesh towards the block.
    pub fn touches_mesh(&mut self, block: &Block<'_>, mesh: &PlacedMesh<'_>, reach_m: f64, into: &mut Vec<Touch>) {
        for part in parts(block) {
            let from = into.len();
            let back = mesh.rotation.conjugate();
            let at = back * (part.origin - mesh.origin);
            if !(at.is_finite() && part.rotation.is_finite()) {
                continue;
            }
            let loose_m = reach_m.max(0.0) + SINGLE_SHARE * block.around.radius_m;
            let around = part.shape.compute_aabb(&pose(DVec3::ZERO, back * part.rotation)).loosened(loose_m as f32);
            let region = Aabb { low: at + around.mins.as_dvec3(), high: at + around.maxs.as_dvec3() };
            let size_m = block.around.radius_m;
            mesh.field.triangles_in(region, |number, corners, face| {
                let near = corners.map(|corner| corner - at);
                let pair = PartOnTriangle { part, mesh, number, near, face, reach_m, size_m, from };
                pair.visit(self, into);
            });
        }
    }
}

/// A convex part and a triangle that may touch.
struct PartOnTriangle<'a> {
    part: Part<'a>,
    mesh: &'a PlacedMesh<'a>,
    /// The triangle's number.
    number: u32,
    /// Its corners in the axes of the mesh, relative to the part's origin, metres.
    near: [DVec3; 3],
    /// Its normal in the axes of the mesh.
    face: DVec3,
    reach_m: f64,
    size_m: f64,
    /// The places of the same part with the same mesh begin here.
    from: usize,
}

impl PartOnTriangle<'_> {
    /// Adds the places of the pair.
    fn visit(&self, scratch: &mut ConvexScratch, into: &mut Vec<Touch>) {
        let Self { part, mesh, near, .. } = self;
        let [a, b, c] = near.map(|corner| corner.as_vec3());
        let shape = Triangle::new(a, b, c);
        let triangle = Part { number: 0, shape: &shape, origin: part.origin, rotation: mesh.rotation };
        let corners = near.map(|corner| part.origin + mesh.rotation * corner);
        let ConvexScratch { hull, manifold } = scratch;
        let rounded = Rounded { corners, radii_m: [0.0; 3] };
        let difference = Difference::new(part, &rounded);
        let apart = match difference.search(self.reach_m) {
            Found::Apart(apart) => Some(apart),
            Found::Far(_) => None,
            Found::Overlap if self.is_flat() => self.out_of_face(),
            Found::Overlap => hull.way_out(&difference),
        };
        let Some(apart) = apart else { return };
        let Some(normal) = self.allowed(apart.normal) else { return };
        let turned = normal != apart.normal;
        let facing = Separation { normal, ..apart };
        clip(manifold, part, &triangle, &facing);
        let is_face = normal.dot(mesh.rotation * self.face) > FACE;
        let least_m = manifold.points.iter().map(|point| f64::from(point.dist)).fold(f64::INFINITY, f64::min);
        let shift_m = apart.gap_m - least_m;
        let is_there = shift_m.abs() < SAME_SHARE * self.size_m;
        let key = |features| TouchKey {
            parts: [self.number, part.number],
            ..TouchKey::new(TouchKind::MeshTriangle, features)
        };
        if !turned && !is_there {
            self.add(self.touch(key([0; 2]), normal, apart.on[0], apart.gap_m), into);
        }
        for point in &manifold.points {
            let place = part.rotation * point.local_p1.as_dvec3();
            let gap_m = if is_face {
                normal.dot(place - mesh.rotation * near[0])
            } else if turned || !is_there {
                f64::from(point.dist)
            } else {
                f64::from(point.dist) + shift_m
            };
            if turned && gap_m < DEEPER * apart.gap_m.min(0.0) {
                continue;
            }
            self.add(self.touch(key([point.fid2.0, point.fid1.0]), normal, place, gap_m), into);
        }
    }

    /// Whether the triangle and its neighbours are in one plane: then every way out of it is along its normal.
    fn is_flat(&self) -> bool {
        let cone = self.mesh.triangles.triangle_normal_constraints(self.number);
        cone.is_some_and(|cone| cone.edges.iter().all(|edge| f64::from(edge.dot(cone.face)) > FLAT))
    }

    /// The way out of the triangle along its normal; `None` where the other way is shorter.
    fn out_of_face(&self) -> Option<Separation> {
        let Self { part, mesh, near, face, .. } = self;
        let normal = mesh.rotation * *face;
        let plane_m = face.dot(near[0]);
        let [low, high] = [-normal, normal].map(|way| part.support(way, part.origin));
        let (front_m, back_m) = (normal.dot(low) - plane_m, normal.dot(high) - plane_m);
        (-front_m <= back_m).then(|| Separation { normal, gap_m: front_m, on: [low, low - normal * front_m] })
    }

    /// The normal that the mesh allows for one that leads out of the triangle; `None` behind it.
    fn allowed(&self, normal: DVec3) -> Option<DVec3> {
        let Self { mesh, face, number, .. } = self;
        let Some(cone) = mesh.triangles.triangle_normal_constraints(*number) else { return Some(normal) };
        let local = mesh.rotation.conjugate() * normal;
        if local.dot(*face) > FACE {
            return Some(mesh.rotation * *face);
        }
        let (before, mut after) = (local.as_vec3(), local.as_vec3());
        if !cone.project_local_normal_mut(&mut after) {
            return None;
        }
        // single precision turns a normal that is allowed by a rounding
        if before.distance(after) < f32::EPSILON * 8.0 {
            return Some(normal);
        }
        let turned = after.as_dvec3().try_normalize()?;
        Some(mesh.rotation * if turned.dot(*face) > 1.0 - f64::from(f32::EPSILON) { *face } else { turned })
    }

    /// The contact at a place on the part, relative to its origin.
    fn touch(&self, key: TouchKey, normal: DVec3, place: DVec3, gap_m: f64) -> Touch {
        let on_a = self.part.origin + place;
        Touch { key, normal, gap_m, on_a: Place::Point(on_a), on_b: Place::Point(on_a - normal * gap_m) }
    }

    /// Adds a contact, unless it is too far or a neighbouring triangle has reported it.
    fn add(&self, touch: Touch, into: &mut Vec<Touch>) {
        let within_m = SAME_SHARE * self.size_m;
        let is_same = |known: &Touch| {
            let (Place::Point(reported), Place::Point(here)) = (known.on_a, touch.on_a) else { return false };
            reported.distance(here) < within_m && known.normal.dot(touch.normal) > FACE
        };
        if touch.gap_m <= self.reach_m && !into[self.from..].iter().any(is_same) {
            into.push(touch);
        }
    }
}
