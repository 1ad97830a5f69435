//! Contacts of a closed skin with a box: vertices over its faces, its edges across those of the skin, its corners over triangles.
//!
//! In: a closed skin and a box that may touch. Out: touching places with normals towards the skin. Never here: open skins, tools.
//! Theory: docs/theory/contact.md, eq. 9.
//!
//! The normal of each place is that of its two features, not the way between two points: that way vanishes where the two lie on each
//! other, and turns round or aside where they overlap.

use super::super::voronoi_regions::{LEAN, LEAN_SHARE};
use super::{BarycentricPoint, DEEP_SHARE, Edge, SkinPoint, SurfaceQuery, Triangle, shares, vertex_key};
use crate::narrow_phase::primitives::Block;
use crate::narrow_phase::touch_key::{TouchKey, TouchKind};
use crate::{Aabb, Place, Touch, near_segments};
use glam::DVec3;

/// A skin meets a face by which it can have come in: their normals are opposed by this cosine at least.
const FACING: f64 = 0.1;
/// Edges whose directions have a sine below this have no place of their own: their ends tell it.
const PARALLEL: f64 = 1e-3;
/// A vertex deeper than this share of an edge may have come in sideways.
const DEEP_FROM_SHARE: f64 = 0.02;
/// Edges that have passed each other did so only where each lies at least this share of that depth inside the other body.
const HALF: f64 = 0.5;

/// A box where it is.
struct PlacedBox {
    middle: DVec3,
    /// Its directions and half extents, metres.
    axes: [DVec3; 3],
    half_m: DVec3,
}

/// An edge of a box.
struct Rim {
    number: u32,
    ends: [DVec3; 2],
    /// The normals of the faces that meet there.
    faces: [DVec3; 2],
}

impl PlacedBox {
    fn of(block: &Block<'_>, half_m: DVec3) -> Self {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| block.rotation * axis);
        Self { middle: block.origin, axes, half_m }
    }

    /// How far a point is along each direction from the middle, metres.
    fn local(&self, point: DVec3) -> DVec3 {
        DVec3::from_array(self.axes.map(|axis| axis.dot(point - self.middle)))
    }

    /// How deep inside a point is; negative outside, metres.
    fn depth_m(&self, point: DVec3) -> f64 {
        (self.half_m - self.local(point).abs()).min_element()
    }

    /// The corner with these signs, by bits.
    fn corner(&self, bits: usize) -> DVec3 {
        let along = |axis: usize| self.axes[axis] * self.half_m[axis] * sign(bits >> axis);
        self.middle + along(0) + along(1) + along(2)
    }

    /// The normals of the faces at a corner.
    fn faces(&self, bits: usize) -> [DVec3; 3] {
        std::array::from_fn(|axis| self.axes[axis] * sign(bits >> axis))
    }

    fn rims(&self) -> impl Iterator<Item = Rim> {
        (0..12).map(|number| {
            let axis = number / 4;
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            let bits = (number & 1) << next | (number >> 1 & 1) << last;
            let faces = self.faces(bits);
            let ends = [self.corner(bits), self.corner(bits | 1 << axis)];
            Rim { number: number as u32 + 1, ends, faces: [faces[next], faces[last]] }
        })
    }
}

fn sign(bit: usize) -> f64 {
    if bit & 1 == 1 { 1.0 } else { -1.0 }
}

impl SurfaceQuery<'_> {
    /// Every place of a closed skin on a box with these half extents.
    pub(super) fn box_touches(&self, block: &Block<'_>, half_m: DVec3, into: &mut Vec<Touch>) {
        let cuboid = PlacedBox::of(block, half_m);
        self.corners_over(&cuboid, into);
        for (vertex, at) in self.vertices() {
            into.extend(self.vertex_on(&cuboid, vertex, at));
        }
        for edge in self.edges() {
            for rim in cuboid.rims() {
                into.extend(self.edge_across(&cuboid, &edge, &rim));
            }
        }
    }

    /// The corners of a box over triangles.
    pub(super) fn corners_over_skin(&self, block: &Block<'_>, half_m: DVec3, into: &mut Vec<Touch>) {
        self.corners_over(&PlacedBox::of(block, half_m), into);
    }

    fn corners_over(&self, cuboid: &PlacedBox, into: &mut Vec<Touch>) {
        into.extend((0..8).filter_map(|bits| self.corner_over(cuboid, bits)));
    }

    /// How deep two bodies may overlap, metres.
    fn deep_m(&self) -> f64 {
        DEEP_SHARE * self.surface.form.edge_m
    }

    /// A place whose normal and gap at the skin's core are known, unless it is too far.
    fn place_on_box(&self, key: TouchKey, here: SkinPoint, normal: DVec3, gap_m: f64) -> Option<Touch> {
        let on_b = Place::Point(here.position - normal * (0.5 * gap_m));
        (gap_m <= self.reach_m).then(|| Touch { key, normal, gap_m, on_a: here.spot.place(), on_b })
    }

    /// A vertex over or under a face that looks against the skin: of several faces the one that it is least deep under.
    /// A deep vertex has come in sideways where that way out is much shorter.
    fn vertex_on(&self, cuboid: &PlacedBox, vertex: u32, at: DVec3) -> Option<Touch> {
        let out = self.normals()[vertex as usize].try_normalize()?;
        let (local, rim_m) = (cuboid.local(at), LEAN_SHARE * self.surface.form.edge_m);
        let beyond = local.abs() - cuboid.half_m;
        let mut nearest: Option<(f64, DVec3)> = None;
        for axis in 0..3 {
            let lean = cuboid.axes[axis].dot(out);
            let side = -lean.signum();
            let gap_m = side * local[axis] - cuboid.half_m[axis];
            let within = beyond[(axis + 1) % 3] <= rim_m && beyond[(axis + 2) % 3] <= rim_m;
            // beyond the middle it is nearer to the far side
            let is_under = gap_m > -cuboid.half_m[axis];
            if lean.abs() >= FACING && within && is_under && nearest.is_none_or(|(least_m, _)| gap_m > least_m) {
                nearest = Some((gap_m, cuboid.axes[axis] * side));
            }
        }
        let (mut gap_m, mut normal) = nearest?;
        let shortest_m = beyond.max_element();
        if gap_m < -DEEP_FROM_SHARE * self.surface.form.edge_m && shortest_m > HALF * gap_m {
            let axis = (0..3).find(|axis| beyond[*axis] == shortest_m)?;
            (gap_m, normal) = (shortest_m, cuboid.axes[axis] * local[axis].signum());
        }
        self.place_on_box(vertex_key(vertex), SkinPoint::vertex(vertex, at), normal, gap_m)
    }

    /// The place where an edge of the skin and one of the box cross.
    fn edge_across(&self, cuboid: &PlacedBox, edge: &Edge, rim: &Rim) -> Option<Touch> {
        let inner = LEAN_SHARE..=1.0 - LEAN_SHARE;
        let along = [edge.ends[1] - edge.ends[0], rim.ends[1] - rim.ends[0]];
        let across = along[0].cross(along[1]);
        if across.length_squared() < PARALLEL * PARALLEL * along[0].length_squared() * along[1].length_squared() {
            return None;
        }
        let across = across.normalize();
        // of the box, and into the skin
        let normal = across * across.dot(rim.faces[0] + rim.faces[1]).signum();
        if rim.faces.iter().any(|face| face.dot(normal) < -LEAN) || !edge.feature().faces(self.surface, -normal, LEAN) {
            return None;
        }
        if !edge.feature().stands_out(self.surface, -normal) {
            return None;
        }
        let (s, t) = near_segments(edge.ends, rim.ends);
        if !(inner.contains(&s) && inner.contains(&t)) {
            return None;
        }
        let (here, there) = (edge.at(s), rim.ends[0].lerp(rim.ends[1], t));
        let gap_m = normal.dot(here.position - there);
        let passed = || {
            let deep_m = HALF * -gap_m..=-gap_m;
            -gap_m <= self.deep_m() && cuboid.depth_m(here.position) >= *deep_m.start() && self.holds(there, deep_m)
        };
        if gap_m < 0.0 && !passed() {
            return None;
        }
        self.place_on_box(TouchKey::new(TouchKind::Edge, [edge.number, rim.number]), here, normal, gap_m)
    }

    /// A corner over or under a triangle: of several the nearest.
    fn corner_over(&self, cuboid: &PlacedBox, bits: usize) -> Option<Touch> {
        let (at, faces) = (cuboid.corner(bits), cuboid.faces(bits));
        let radius_m = self.surface.form.radius_m;
        let around = Aabb::about(at, radius_m + self.reach_m.max(self.deep_m()));
        let mut nearest: Option<(f64, DVec3, SkinPoint, u32)> = None;
        self.surface.each_triangle(around, |Triangle { vertices, corners, number }| {
            let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]).try_normalize();
            let Some(out) = across.map(|across| self.out_toward(cuboid, bits, corners[0], across)) else { return };
            let gap_m = out.dot(at - corners[0]);
            let position = at - out * gap_m;
            // of equally near ones the lesser number counts
            let is_near = nearest.is_none_or(|(least_m, _, _, first)| {
                gap_m.abs() < least_m.abs() || (gap_m.abs() == least_m.abs() && number < first)
            });
            if !is_near || gap_m < -self.deep_m() || faces.iter().any(|face| face.dot(-out) < -HALF) {
                return;
            }
            let Some(shares) = shares(position, corners) else { return };
            if shares.iter().all(|share| *share >= -LEAN_SHARE) {
                let point = SkinPoint { spot: BarycentricPoint { vertices, shares }, position };
                nearest = Some((gap_m, -out, point, number));
            }
        });
        let (gap_m, normal, point, triangle) = nearest?;
        self.place_on_box(TouchKey::new(TouchKind::Triangle, [triangle, bits as u32]), point, normal, gap_m - radius_m)
    }

    /// The side of a triangle with the normal `across` on which a corner is: outside of a closed skin; of an open one where the middle of
    /// the box's edge from there through the skin is.
    fn out_toward(&self, cuboid: &PlacedBox, bits: usize, origin: DVec3, across: DVec3) -> DVec3 {
        if self.surface.form.closed {
            return across;
        }
        let steep = |axis: &usize| cuboid.axes[*axis].dot(across).abs();
        let axis = (0..3).max_by(|a, b| steep(a).total_cmp(&steep(b))).unwrap_or(0);
        let middle = 0.5 * (cuboid.corner(bits) + cuboid.corner(bits ^ 1 << axis));
        across * across.dot(middle - origin).signum()
    }
}
