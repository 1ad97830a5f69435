//! Contacts of soft bodies' skins with any other piece: their vertices, edges and triangles.
//!
//! In: a surface and another piece. Out: touching places, with the normal towards the surface; a lower bound of the gap.
//! Never here: a surface against itself. Theory: docs/theory/soft.md, eq. 15, 16.
//!
//! A place is told by the vertex, edge or triangle in whose region the other lies ([`crate::narrow_phase::voronoi_regions`]): what lies ahead on a flat skin is
//! no wall. On what is round each node over a triangle and each edge that it crosses is a place. A place of the other side is told in
//! the surface itself, so that both sides are pushed at one point.

mod surface_convex;
mod surface_surface;

use super::primitives::{Piece, Strand, Surface};
use super::voronoi_regions::{LEAN_SHARE, Ridge};
use crate::Place;
use crate::Touch;
use crate::signed_distance::Ball;
use crate::{near_segments, near_triangle};
use glam::DVec3;
use surface_surface::Skins;

/// Axes closer than this cross, metres: the vector from one to the other has no direction.
const CROSSING_M: f64 = 1e-9;
/// Two soft skins that have passed each other by more than this share of an edge are ignored: they came from elsewhere.
const DEEP_SHARE: f64 = 0.5;
/// Kinds of places in keys: a vertex of the surface, an edge, a triangle, a vertex of another surface.
const KINDS: [u64; 4] = [0, 1 << 40, 2 << 40, 3 << 40];
/// Shift of the part's number in its key.
const PART_SHIFT: u32 = 20;

/// Scratch storage for searches.
#[derive(Default)]
pub(super) struct SurfaceScratch {
    /// For a closed surface the outward normal at each vertex, of any length; `others` holds those of the other surface.
    normals: Vec<DVec3>,
    others: Vec<DVec3>,
}

/// A point of a surface: three vertices with shares.
#[derive(Clone, Copy)]
struct Spot {
    vertices: [u32; 3],
    shares: [f64; 3],
}

impl Spot {
    fn vertex(vertex: u32) -> Self {
        Self { vertices: [vertex; 3], shares: [1.0, 0.0, 0.0] }
    }

    fn edge([a, b]: [u32; 2], share: f64) -> Self {
        Self { vertices: [a, b, b], shares: [1.0 - share, share, 0.0] }
    }

    /// The outward normal of a closed surface there, from the normals of its vertices; of any length. `None` where it is open.
    fn out(self, normals: &[DVec3]) -> Option<DVec3> {
        let of = |vertex: u32| normals.get(vertex as usize).copied();
        let terms = self.vertices.into_iter().zip(self.shares).map(|(vertex, share)| of(vertex).map(|n| n * share));
        terms.sum()
    }

    fn place(self) -> Place {
        Place::Surface { vertices: self.vertices, shares: self.shares }
    }
}

impl Surface<'_> {
    fn at(&self, vertex: u32) -> DVec3 {
        self.positions[vertex as usize]
    }

    fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|vertex| self.at(vertex))
    }

    /// The edges within `low` … `high`, with their numbers.
    fn edges_in(&self, (low, high): (DVec3, DVec3)) -> impl Iterator<Item = (u64, [u32; 2], [DVec3; 2])> {
        let ends = (0..).zip(self.form.edges.iter()).map(|(i, edge)| (i, *edge, edge.map(|vertex| self.at(vertex))));
        ends.filter(move |(_, _, [a, b])| a.min(*b).cmple(high).all() && a.max(*b).cmpge(low).all())
    }

    /// The triangles within `low` … `high`, with their numbers.
    fn triangles_in(&self, (low, high): (DVec3, DVec3)) -> impl Iterator<Item = (u64, [u32; 3], [DVec3; 3])> {
        let all = (0..).zip(self.form.triangles.iter()).map(|(i, triangle)| (i, *triangle, self.corners(*triangle)));
        all.filter(move |(_, _, [a, b, c])| a.min(*b).min(*c).cmple(high).all() && a.max(*b).max(*c).cmpge(low).all())
    }

    /// The vertices of the skin within `low` … `high`.
    fn vertices_in(&self, (low, high): (DVec3, DVec3)) -> impl Iterator<Item = (u32, DVec3)> {
        let all = self.form.vertices.iter().map(|vertex| (*vertex, self.at(*vertex)));
        all.filter(move |(_, at)| at.cmple(high).all() && at.cmpge(low).all())
    }

    /// The spot of a triangle nearest to `point`, and its position; `None` unless it is inside.
    fn inside(&self, triangle: [u32; 3], [a, b, c]: [DVec3; 3], point: DVec3) -> Option<(Spot, DVec3)> {
        let near = near_triangle(point, [a, b, c]);
        let shares = shares(near, [a, b, c])?;
        let deep = shares.into_iter().all(|share| share > LEAN_SHARE);
        deep.then_some((Spot { vertices: triangle, shares }, near))
    }
}

/// The weight of each corner at a point of a triangle; `None` for one without area.
fn shares(p: DVec3, [a, b, c]: [DVec3; 3]) -> Option<[f64; 3]> {
    let normal = (b - a).cross(c - a);
    let area2 = normal.length_squared();
    let of = |u: DVec3, v: DVec3| (u - p).cross(v - p).dot(normal) / area2;
    (area2 > 0.0).then(|| [of(b, c), of(c, a), of(a, b)])
}

impl SurfaceScratch {
    /// Every place within `reach_m`, with normals towards the surface.
    pub(super) fn touches(&mut self, surface: &Surface<'_>, other: &Piece<'_>, reach_m: f64, into: &mut Vec<Touch>) {
        let (low, high) = other.bounds();
        let within_m = reach_m + surface.form.radius_m;
        let region = (low - within_m, high + within_m);
        learn_normals(surface, &mut self.normals);
        let meeting = Meeting { surface, reach_m, region, normals: &self.normals };
        match other {
            Piece::Strand(strand) => meeting.strand(strand, into),
            Piece::Block(block) => {
                if let Some(field) = block.field {
                    meeting.block(block, field, into);
                }
            }
            Piece::Surface(there) => {
                learn_normals(there, &mut self.others);
                let (low, high) = surface.bounds;
                let within_m = within_m + there.form.radius_m;
                let region = (low - within_m, high + within_m);
                let back = Meeting { surface: there, reach_m, region, normals: &self.others };
                Skins::new(&meeting, &back).touches(into);
            }
        }
    }
}

/// Computes the normals of the vertices of a closed surface; none for an open one.
fn learn_normals(surface: &Surface<'_>, into: &mut Vec<DVec3>) {
    into.clear();
    if !surface.form.closed {
        return;
    }
    into.resize(surface.positions.len(), DVec3::ZERO);
    for triangle in surface.form.triangles.iter() {
        let [a, b, c] = surface.corners(*triangle);
        let normal = (b - a).cross(c - a);
        triangle.iter().for_each(|vertex| into[*vertex as usize] += normal);
    }
}

/// A lower bound of the gap by the boxes around both, and a direction from the other to the surface.
pub(super) fn gap(surface: &Surface<'_>, other: &Piece<'_>) -> (DVec3, f64) {
    let ((low, high), (there_low, there_high)) = (surface.bounds, other.bounds());
    let apart = (low - there_high).max(DVec3::ZERO) - (there_low - high).max(DVec3::ZERO);
    let between = 0.5 * (low + high) - 0.5 * (there_low + there_high);
    let normal = apart.try_normalize().or(between.try_normalize()).unwrap_or(DVec3::Z);
    (normal, apart.length() - surface.form.radius_m)
}

/// A surface and another piece that may touch.
struct Meeting<'a> {
    surface: &'a Surface<'a>,
    reach_m: f64,
    /// Nothing outside this box is near.
    region: (DVec3, DVec3),
    normals: &'a [DVec3],
}

impl Meeting<'_> {
    fn strand(&self, strand: &Strand<'_>, into: &mut Vec<Touch>) {
        for (vertex, at) in self.surface.vertices_in(self.region) {
            let (span, share) = nearest_span(strand, at);
            let core = on_span(strand, span, share).centre;
            // a point behind the skin of a closed body is pushed out by its triangles
            let outside = self.normals.get(vertex as usize).is_none_or(|normal| normal.dot(core - at) >= 0.0);
            if outside && Ridge::Vertex(vertex).is_nearest(self.surface, core - at) {
                into.extend(self.tell(KINDS[0] | u64::from(vertex), (Spot::vertex(vertex), at), strand, (span, share)));
            }
        }
        for (number, edge, ends) in self.surface.edges_in(self.region) {
            for span in 0..strand.spans() {
                let (share, at) = near_segments(strand.ends(span).map(|ball| ball.centre), ends);
                if !(LEAN_SHARE..=1.0 - LEAN_SHARE).contains(&at) || (share == 1.0 && span + 1 < strand.spans()) {
                    continue;
                }
                let (point, ball) = (ends[0].lerp(ends[1], at), on_span(strand, span, share));
                let outside = edge.iter().all(|vertex| {
                    self.normals.get(*vertex as usize).is_none_or(|normal| normal.dot(ball.centre - point) >= 0.0)
                });
                if outside && Ridge::Edge(number, ends).is_nearest(self.surface, ball.centre - point) {
                    let key = KINDS[1] | number << PART_SHIFT | span as u64;
                    into.extend(self.tell(key, (Spot::edge(edge, at), point), strand, (span, share)));
                }
            }
        }
        for (number, triangle, corners) in self.surface.triangles_in(self.region) {
            for node in 0..strand.count() {
                let ball = strand.ball(node);
                let Some((spot, point)) = self.surface.inside(triangle, corners, ball.centre) else { continue };
                let span = node.min(strand.spans() - 1);
                let key = KINDS[2] | number << PART_SHIFT | node as u64;
                into.extend(self.tell(key, (spot, point), strand, (span, (node - span) as f64)));
            }
        }
    }

    /// The place between a spot and a strand, unless it is too far.
    fn tell(
        &self,
        key: u64,
        (spot, point): (Spot, DVec3),
        strand: &Strand<'_>,
        (span, share): (usize, f64),
    ) -> Option<Touch> {
        let ball = on_span(strand, span, share);
        let way = point - ball.centre;
        let out = if spot.shares[2] > 0.0 && self.surface.form.closed { self.out_of(spot) } else { None };
        // a core that lies exactly in the skin of a closed body counts as outside it
        let inward = || spot.out(self.normals).and_then(DVec3::try_normalize).map(|out| -out);
        let across = || self.out_of(spot).or_else(inward).unwrap_or(DVec3::Z);
        let length = way.length();
        let (mut normal, mut distance) = if length > CROSSING_M { (way / length, length) } else { (across(), 0.0) };
        if out.is_some_and(|out| out.dot(normal) > 0.0) {
            // the core is behind the skin: it has to come out where it went in, and under a thin plate it never went in
            if length > 2.0 * ball.radius_m || self.is_before(ball.centre, length) {
                return None;
            }
            (normal, distance) = (-normal, -distance);
        }
        let gap_m = distance - ball.radius_m - self.surface.form.radius_m;
        let half = 0.5 * gap_m;
        let on_b = match strand.place(span, share, ball, normal) {
            Place::Chain { segment, share, .. } => Place::Chain { segment, share, radius_m: distance - half },
            _ => Place::Point(point - normal * half),
        };
        (gap_m <= self.reach_m).then(|| Touch { key, normal, gap_m, on_a: spot.place(), on_b })
    }

    /// Whether a point is in front of a triangle that is nearer than `within_m`.
    fn is_before(&self, point: DVec3, within_m: f64) -> bool {
        self.surface.triangles_in((point - within_m, point + within_m)).any(|(_, _, [a, b, c])| {
            let way = point - near_triangle(point, [a, b, c]);
            way.length() < within_m * (1.0 - LEAN_SHARE) && (b - a).cross(c - a).dot(way) > 0.0
        })
    }

    /// The normal of the triangle of a spot; `None` for a vertex or an edge.
    fn out_of(&self, spot: Spot) -> Option<DVec3> {
        let [a, b, c] = self.surface.corners(spot.vertices);
        (b - a).cross(c - a).try_normalize()
    }
}

/// The ball of a strand at a share of a span.
fn on_span(strand: &Strand<'_>, span: usize, share: f64) -> Ball {
    let [a, b] = strand.ends(span);
    a.toward(b, share)
}

/// The span whose skin is nearest to a point, and the share along it.
fn nearest_span(strand: &Strand<'_>, at: DVec3) -> (usize, f64) {
    let mut best = (0, 0.0, f64::INFINITY);
    for span in 0..strand.spans() {
        let [a, b] = strand.ends(span);
        let way = b.centre - a.centre;
        let length2 = way.length_squared();
        let share = if length2 > 0.0 { ((at - a.centre).dot(way) / length2).clamp(0.0, 1.0) } else { 0.0 };
        let ball = a.toward(b, share);
        let gap = at.distance(ball.centre) - ball.radius_m;
        if gap < best.2 {
            best = (span, share, gap);
        }
    }
    (best.0, best.1)
}
