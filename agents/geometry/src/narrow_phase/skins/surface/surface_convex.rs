//! Contacts of soft bodies' skins with blocks: which of their places are nearest, and in which direction they push.
//!
//! In: a surface and a block that may touch. Out: touching places. Never here: round pieces, other surfaces.
//! Theory: docs/theory/contact.md, eq. 8.

use super::super::voronoi_regions::{Feature, LEAN_SHARE};
use super::{BarycentricPoint, DEEP_SHARE, SkinPoint, SurfaceQuery, Triangle, shares, vertex_key};
use crate::narrow_phase::blocks::convex_convex::parts;
use crate::narrow_phase::blocks::gjk::{Convex, Difference, Rounded, Separation};
use crate::narrow_phase::primitives::Block;
use crate::narrow_phase::touch_key::{TouchKey, TouchKind};
use crate::near_triangle;
use crate::solids::signed_distance;
use crate::solids::signed_distance::{Ball, Field};
use crate::{Aabb, Place, Touch};
use glam::DVec3;

/// Deeper than this share of an edge a place is pushed out of the block by the shortest way.
const BETTER_SHARE: f64 = 0.02;
/// The least difference of gap between a place and the adjacent corners: rounding, as a share of the size.
const ROUNDING_SHARE: f64 = 1e-6;
/// The normal of a face is the same this share of an edge farther on; that of an edge, a corner or a round side is not.
const BESIDE_SHARE: f64 = 0.1;
/// Normals whose cosine is above this are the same: a side with a radius of 100 m turns by more in 5 mm.
const FLAT: f64 = 1.0 - 1e-9;
/// Alternating projections between a triangle and a block: both are convex, so the two points approach each other.
const PROJECTIONS: usize = 8;
/// Limit of the cosine of a tool's normal with the skin's. A body that touches a skin from outside pushes it inwards. A tool that would
/// push it aside or outwards has pierced it, and touches it no more until it is out again. From outside the cosine with one of the faces is
/// at least 0.7 at the edge of a box, and 0.57 at a corner.
const PIERCED: f64 = -0.5;

/// The point of a triangle that is nearest to a block.
struct Projected {
    point: SkinPoint,
    /// The distance there, in the block's axes.
    touch: signed_distance::Touch,
    /// The largest distance of a corner of the triangle from its middle, metres.
    size_m: f64,
}

impl SurfaceQuery<'_> {
    pub(super) fn block(&self, block: &Block<'_>, field: &Field, into: &mut Vec<Touch>) {
        let radius_m = self.surface.form.radius_m;
        let inward = |centre: DVec3| block.inward(Ball { centre, radius_m });
        let nearest = |at: DVec3| {
            let near = field.touch(inward(at).centre, radius_m + self.reach_m);
            // a hull or mesh is searched as deep as the reach; for a point deeper inside the nearest way out is used
            near.or_else(|| field.inside(inward(at).centre, block.deep_m))
        };
        for (vertex, at) in self.vertices() {
            let touch = nearest(at).and_then(|touch| self.out(Feature::Vertex(vertex), block, touch));
            if let Some(touch) = touch {
                let key = vertex_key(vertex);
                into.extend(self.block_contact(key, SkinPoint::vertex(vertex, at), block, touch));
            }
        }
        if !field.needs_span_tests() {
            return;
        }
        let apart = |at: DVec3| nearest(at).map_or(f64::INFINITY, |touch| touch.distance_m);
        for edge in self.edges() {
            let ends = edge.ends;
            let Some((share, touch)) = field.lowest_of_span(ends.map(inward), self.reach_m) else { continue };
            let better_m = ROUNDING_SHARE * ends[0].distance(ends[1]);
            let inner = (LEAN_SHARE..=1.0 - LEAN_SHARE).contains(&share)
                && ends.into_iter().all(|end| touch.distance_m + better_m < apart(end));
            if let Some(touch) = inner.then(|| self.out(edge.feature(), block, touch)).flatten() {
                let key = TouchKey::new(TouchKind::Edge, [edge.number, 0]);
                into.extend(self.block_contact(key, edge.at(share), block, touch));
            }
        }
        if let (Some(half_m), false) = (field.half_extents_m(), block.pierces) {
            self.corners_over_skin(block, half_m, into);
            return;
        }
        let mut last = None;
        for triangle in self.triangles() {
            if self.corners(&triangle, block, field, into) {
                continue;
            }
            let Some(Projected { point, touch, size_m }) = self.project(&triangle, block, &mut last) else { continue };
            let share = if field.corners(DVec3::Z).is_some() { BETTER_SHARE } else { ROUNDING_SHARE };
            if triangle.corners.into_iter().all(|corner| touch.distance_m + share * size_m < apart(corner)) {
                let key = TouchKey::new(TouchKind::Triangle, [triangle.number, 0]);
                into.extend(self.block_contact(key, point, block, touch));
            }
        }
    }

    /// The place as reported by a vertex or an edge of the skin, with a push out of the skin and not along it; `None` where a neighbouring
    /// part is nearer. A place deep in the block is pushed out by the shortest way.
    fn out(
        &self,
        feature: Feature,
        block: &Block<'_>,
        touch: signed_distance::Touch,
    ) -> Option<signed_distance::Touch> {
        if touch.distance_m < -BETTER_SHARE * self.surface.form.edge_m {
            return Some(touch);
        }
        let way = -(block.rotation * touch.normal);
        let out = feature.out(self.surface, way)?;
        let local = block.rotation.conjugate() * -out;
        if feature.is_nearest(self.surface, way * touch.distance_m.max(0.0)) {
            return Some(signed_distance::Touch { normal: local, ..touch });
        }
        // the face continues there: the vertex may be the one that reaches it, whichever part is nearer now
        let Feature::Vertex(vertex) = feature else { return None };
        let field = block.field?;
        let here = block.inward(Ball { centre: self.surface.at(vertex), radius_m: 0.0 }).centre;
        let beside = here + (local - touch.normal).normalize_or_zero() * (BESIDE_SHARE * self.surface.form.edge_m);
        let there = field.touch(beside, self.surface.form.radius_m + self.reach_m)?;
        (there.normal.dot(touch.normal) > FLAT).then_some(touch)
    }

    /// Adds the corners of a block over a triangle; returns whether there are any.
    fn corners(&self, triangle: &Triangle, block: &Block<'_>, field: &Field, into: &mut Vec<Touch>) -> bool {
        let Triangle { number, vertices, corners } = *triangle;
        let (a, Some(out)) = (corners[0], self.facing(corners, block)) else { return false };
        let local = block.rotation.conjugate() * out;
        // for a thin body its far side does not count
        let ahead = out.dot(block.around.centre - a) > 0.0;
        let deep_m =
            self.surface.form.radius_m + if ahead { DEEP_SHARE } else { BETTER_SHARE } * self.surface.form.edge_m;
        let mut any = false;
        for (corner, name) in field.corners(local).into_iter().flatten().zip(1_u32..) {
            let at = block.rotation * corner + block.origin;
            let distance_m = out.dot(at - a);
            if distance_m < -deep_m || distance_m - self.surface.form.radius_m > self.reach_m {
                continue;
            }
            let foot = at - out * distance_m;
            let Some(shares) =
                shares(foot, corners).filter(|shares| shares.iter().all(|share| *share > -ROUNDING_SHARE))
            else {
                continue;
            };
            // a corner that is behind the face may have come past the skin's border, and not through it
            if distance_m < 0.0 && !self.crosses([at, block.around.centre]) {
                continue;
            }
            let touch = signed_distance::Touch { normal: -local, distance_m };
            let point = SkinPoint { spot: BarycentricPoint { vertices, shares }, position: foot };
            let key = TouchKey::new(TouchKind::Triangle, [number, name]);
            into.extend(self.block_contact(key, point, block, touch));
            any = true;
        }
        any
    }

    /// Whether a line crosses the skin.
    fn crosses(&self, [from, to]: [DVec3; 2]) -> bool {
        let mut crosses = false;
        self.surface.each_triangle(Aabb::of(&[from, to]), |Triangle { corners, .. }| {
            let [a, b, c] = corners;
            let across = (b - a).cross(c - a);
            let [before, after] = [from, to].map(|end| across.dot(end - a));
            let cut = from.lerp(to, before / (before - after));
            crosses |= before * after <= 0.0
                && before != after
                && shares(cut, corners).is_some_and(|shares| shares.iter().all(|share| *share > -ROUNDING_SHARE));
        });
        crosses
    }

    /// The normal of a triangle towards a block: out of a closed skin, and of an open one on the side of the block's middle.
    fn facing(&self, [a, b, c]: [DVec3; 3], block: &Block<'_>) -> Option<DVec3> {
        let across = (b - a).cross(c - a).try_normalize()?;
        let turned = !self.surface.form.closed && across.dot(block.around.centre - a) < 0.0;
        Some(if turned { -across } else { across })
    }

    /// The point of a triangle that is nearest to a block, if it is inside the triangle; `last` is as for [`Field::touch_by`].
    fn project(&self, triangle: &Triangle, block: &Block<'_>, last: &mut Option<u32>) -> Option<Projected> {
        let (field, corners) = (block.field?, triangle.corners);
        let radius_m = self.surface.form.radius_m;
        let mut point = (corners[0] + corners[1] + corners[2]) / 3.0;
        let size_m = corners.iter().map(|corner| corner.distance(point)).fold(0.0, f64::max);
        let look_m = radius_m + self.reach_m + 2.0 * size_m;
        let mut nearest =
            |point: DVec3| field.touch_by(block.inward(Ball { centre: point, radius_m }).centre, look_m, last);
        let mut touch = nearest(point)?;
        if touch.distance_m - size_m > radius_m + self.reach_m {
            return None; // and so is every point of it
        }
        if let Some(projected) = self.nearest_of_hull(triangle, block) {
            return Some(projected);
        }
        for left in (0..PROJECTIONS).rev() {
            let foot = point - block.rotation * touch.normal * touch.distance_m;
            let next = near_triangle(foot, corners);
            if next == point {
                break;
            }
            point = next;
            if left > 0 {
                touch = nearest(point)?;
            }
        }
        let point = triangle.inside(point)?;
        if touch.distance_m >= -BETTER_SHARE * self.surface.form.edge_m {
            touch.normal = block.rotation.conjugate() * -self.facing(corners, block)?;
        }
        Some(Projected { point, touch, size_m })
    }

    /// The same for a block of hulls that the triangle is apart from.
    fn nearest_of_hull(&self, triangle: &Triangle, block: &Block<'_>) -> Option<Projected> {
        let look_m = self.surface.form.radius_m + self.reach_m;
        let skin = Rounded { corners: triangle.corners, radii_m: [0.0; 3] };
        let hulls = parts(block).filter(|part| part.shape.as_convex_polyhedron().is_some());
        let nearest = hulls.filter_map(|part| Difference::new(&skin, &part).parted(look_m));
        let Separation { normal, gap_m, on } = nearest.min_by(|a, b| a.gap_m.total_cmp(&b.gap_m))?;
        let point = triangle.inside(skin.origin() + on[0])?;
        let middle = (skin.corners[0] + skin.corners[1] + skin.corners[2]) / 3.0;
        let size_m = skin.corners.iter().map(|corner| corner.distance(middle)).fold(0.0, f64::max);
        let touch = signed_distance::Touch { normal: block.rotation.conjugate() * normal, distance_m: gap_m };
        Some(Projected { point, touch, size_m })
    }

    /// The contact between a point of the skin and a block whose distance there is `touch`, unless they are too far.
    fn block_contact(
        &self,
        key: TouchKey,
        point: SkinPoint,
        block: &Block<'_>,
        touch: signed_distance::Touch,
    ) -> Option<Touch> {
        let SkinPoint { spot, position } = point;
        let gap_m = touch.distance_m - self.surface.form.radius_m;
        let normal = block.rotation * touch.normal;
        (gap_m <= self.reach_m && !(block.pierces && self.is_pierced(spot, normal))).then(|| Touch {
            key,
            normal,
            gap_m,
            on_a: spot.place(),
            on_b: Place::Point(position - normal * (0.5 * gap_m)),
        })
    }

    /// Whether a part of a tool that would push a spot of a closed surface along `normal` has gone through its skin there: through every
    /// face that meets there.
    fn is_pierced(&self, spot: BarycentricPoint, normal: DVec3) -> bool {
        let (surface, mut is_faced) = (self.surface, false);
        let corner = spot.vertices.into_iter().zip(spot.shares).find(|(_, share)| *share != 0.0);
        let at = corner.map_or(DVec3::NAN, |(vertex, _)| surface.at(vertex));
        surface.each_triangle(Aabb::about(at, 0.0), |Triangle { vertices, .. }| {
            is_faced |= spot.is_on(&vertices) && surface.out(vertices).is_some_and(|out| out.dot(normal) <= PIERCED);
        });
        surface.form.closed && !is_faced
    }
}
