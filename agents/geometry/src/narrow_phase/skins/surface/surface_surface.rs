//! Contacts between the skins of two soft bodies: which of their places are nearest, and in which direction they push.
//!
//! In: two surfaces. Out: touching places, with normals from the other towards the surface. Never here: blocks, round pieces.
//! Theory: docs/theory/contact.md, eq. 8, 10, 11.

use super::super::voronoi_regions::{Feature, LEAN, LEAN_SHARE};
use super::self_pairs::SelfPairs;
use super::{BarycentricPoint, DEEP_SHARE, Edge, SkinPoint, SurfaceQuery, Triangle, shares, vertex_key};
use crate::narrow_phase::touch_key::{TouchKey, TouchKind};
use crate::solids::capsule_chain::CROSSING_M;
use crate::{Aabb, SurfaceShape, Touch};
use crate::{near_segments, near_triangle};
use glam::DVec3;
use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// A direction whose cosine with the normal of a triangle is above this comes from its face.
const FACE: f64 = 0.999;
/// A face by which a vertex has entered was opposed to its normal by this cosine at least.
const FACING: f64 = 0.1;
/// Edges whose directions have a sine below this have no unique nearest place.
const PARALLEL: f64 = 1e-4;
/// A place that has passed through a skin is pushed out as it came in, unless some face is nearer than this share of that distance: next
/// to the edge of a box it is 0.7.
const HALF: f64 = 0.5;

/// The search depth of a closed skin behind itself, as a share of an edge.
const OWN_DEEP_SHARE: f64 = 0.25;
/// See [`SkinPair::with_itself`].
const CRUSHED: f64 = 4.0;

/// The place of a skin that is nearest to a point.
#[derive(Clone, Copy)]
struct NearestPoint {
    spot: BarycentricPoint,
    at: DVec3,
    /// The normal of its triangle, out of a closed skin; a rope has none.
    face: Option<DVec3>,
}

/// A contact of a place of one skin with another skin: the spot there, the normal from there, and the distance, metres.
struct SkinContact {
    spot: BarycentricPoint,
    normal: DVec3,
    distance_m: f64,
}

/// Two skins that may touch.
pub(super) struct SkinPair<'a> {
    here: &'a SurfaceQuery<'a>,
    there: &'a SurfaceQuery<'a>,
    /// Sum of both half thicknesses, and how deep the two may overlap (`deep_m`), metres.
    thick_m: f64,
    deep_m: f64,
    /// Where both are one skin: its features that never touch.
    own: Option<OwnSkin<'a>>,
}

/// A skin at rest: features that are near each other there never touch.
#[derive(Clone, Copy)]
struct OwnSkin<'a> {
    /// Where the vertices are at rest, metres.
    rest: &'a [DVec3],
    /// Features nearer than this at rest never touch, metres.
    apart_m: f64,
}

impl OwnSkin<'_> {
    /// Whether a vertex and a triangle never touch.
    fn is_one(&self, vertex: u32, triangle: [u32; 3]) -> bool {
        let at = |vertex: u32| self.rest[vertex as usize];
        triangle.contains(&vertex) || near_triangle(at(vertex), triangle.map(at)).distance(at(vertex)) < self.apart_m
    }

    /// Whether two edges without a common vertex never touch.
    fn is_crossed(&self, first: [u32; 2], second: [u32; 2]) -> bool {
        let at = |vertex: u32| self.rest[vertex as usize];
        is_near(first.map(at), second.map(at), self.apart_m)
    }
}

/// Whether two segments are nearer to each other than `within_m`.
fn is_near(first: [DVec3; 2], second: [DVec3; 2], within_m: f64) -> bool {
    let (s, t) = near_segments(first, second);
    first[0].lerp(first[1], s).distance(second[0].lerp(second[1], t)) < within_m
}

impl<'a> SkinPair<'a> {
    pub fn new(here: &'a SurfaceQuery<'a>, there: &'a SurfaceQuery<'a>) -> Self {
        let (a, b) = (here.surface.form, there.surface.form);
        let deep_m = DEEP_SHARE * a.edge_m.min(b.edge_m);
        Self { here, there, thick_m: a.radius_m + b.radius_m, deep_m, own: None }
    }

    /// A skin with itself. A sheet bent to the radius of its own skin comes back to itself after π times its half
    /// thickness; features nearer at rest touch only through it. A feature within the search depth behind a closed skin
    /// must not be on the skin's own other side: that is farther at rest, and stays so unless it is crushed to a
    /// quarter.
    pub fn with_itself(query: &'a SurfaceQuery<'a>, rest: &'a [DVec3]) -> Self {
        let form = query.surface.form;
        let deep_m = if form.closed { OWN_DEEP_SHARE * form.edge_m } else { 0.0 };
        let apart_m = (PI * form.radius_m).max(deep_m * CRUSHED);
        let own = Some(OwnSkin { rest, apart_m });
        Self { here: query, there: query, thick_m: 2.0 * form.radius_m, deep_m, own }
    }

    /// No feature of two skins farther than this from a place of the other is asked for, metres.
    pub fn look_m([a, b]: [&SurfaceShape; 2], reach_m: f64) -> f64 {
        let deep_m = DEEP_SHARE * a.edge_m.min(b.edge_m);
        reach_m.max(deep_m) + a.radius_m + b.radius_m + CROSSING_M
    }

    /// Every place of a skin with itself within reach.
    pub fn self_touches(&self, pairs: &SelfPairs, into: &mut Vec<Touch>) {
        let surface = self.here.surface;
        into.extend(pairs.vertices.iter().filter_map(|vertex| self.vertex_here(*vertex, surface.at(*vertex))));
        let edges = pairs.edges.iter().map(|pair| pair.map(|number| surface.edge(number)));
        into.extend(edges.filter_map(|[edge, other]| self.edge_touch(&edge, &other)));
        into.retain(|touch| touch.gap_m <= self.here.reach_m);
    }

    /// The vertices of a skin from which other features of it are not farther than `within_m`, and the pairs of its edges that are not; none
    /// that are one at rest.
    pub fn find_pairs(&self, within_m: f64, pairs: &mut SelfPairs) {
        let Self { here, own, .. } = *self;
        let Some(own) = own else { return };
        let near = here.vertices().filter(|(vertex, at)| {
            here.nearest(*at, within_m, None, |triangle| !own.is_one(*vertex, triangle)).is_some()
        });
        pairs.vertices.extend(near.map(|(vertex, _)| vertex));
        for edge in here.edges() {
            here.surface.each_edge(Aabb::of(&edge.ends).grown(within_m), |other| {
                // most that are near have a vertex in common
                let is_joined = || edge.vertices.iter().any(|vertex| other.vertices.contains(vertex));
                if edge.number < other.number
                    && !is_joined()
                    && is_near(edge.ends, other.ends, within_m)
                    && !own.is_crossed(edge.vertices, other.vertices)
                {
                    pairs.edges.push([edge.number, other.number]);
                }
            });
        }
    }

    /// Every place within reach.
    pub fn touches(&self, into: &mut Vec<Touch>) {
        self.vertices_here(into);
        self.vertices_there(into);
        self.edges(into);
        into.retain(|touch| touch.gap_m <= self.here.reach_m);
    }

    fn vertices_here(&self, into: &mut Vec<Touch>) {
        into.extend(self.here.vertices().filter_map(|(vertex, at)| self.vertex_here(vertex, at)));
    }

    fn vertex_here(&self, vertex: u32, at: DVec3) -> Option<Touch> {
        let SkinContact { spot, normal, distance_m } = self.vertex(self.here, self.there, vertex, at)?;
        let (on_a, on_b) = (BarycentricPoint::vertex(vertex).place(), spot.place());
        Some(Touch { key: vertex_key(vertex), normal, gap_m: distance_m - self.thick_m, on_a, on_b })
    }

    fn vertices_there(&self, into: &mut Vec<Touch>) {
        let Self { here, there, thick_m, .. } = *self;
        for (vertex, at) in there.vertices() {
            let Some(SkinContact { spot, normal, distance_m }) = self.vertex(there, here, vertex, at) else { continue };
            let (on_a, on_b, gap_m) = (spot.place(), BarycentricPoint::vertex(vertex).place(), distance_m - thick_m);
            let key = TouchKey::new(TouchKind::SecondVertex, [vertex, 0]);
            into.push(Touch { key, normal: -normal, gap_m, on_a, on_b });
        }
    }

    fn edges(&self, into: &mut Vec<Touch>) {
        let within_m = self.within_m();
        for edge in self.here.edges() {
            let around = Aabb::of(&edge.ends).grown(within_m);
            self.there.surface.each_edge(around, |other| into.extend(self.edge_touch(&edge, &other)));
        }
    }

    /// Where two edges cross.
    fn edge_touch(&self, edge: &Edge, other: &Edge) -> Option<Touch> {
        let inner = LEAN_SHARE..=1.0 - LEAN_SHARE;
        let (s, t) = near_segments(edge.ends, other.ends);
        if !(inner.contains(&s) && inner.contains(&t)) {
            return None;
        }
        let (a, b) = (edge.at(s), other.at(t));
        let (normal, distance_m) = self.crossing([a, b], [edge.feature(), other.feature()])?;
        // in a fold of one skin its layers turn along each other, and vertices alone let them sink
        let stand_out = self.own.is_some()
            || edge.feature().stands_out(self.here.surface, -normal)
                && other.feature().stands_out(self.there.surface, normal);
        if !stand_out {
            return None;
        }
        let key = TouchKey::new(TouchKind::Edge, [edge.number, other.number]);
        Some(Touch { key, normal, gap_m: distance_m - self.thick_m, on_a: a.spot.place(), on_b: b.spot.place() })
    }

    /// Search radius: nothing farther from a place is tested, metres.
    pub fn within_m(&self) -> f64 {
        let closed = self.here.surface.form.closed || self.there.surface.form.closed;
        self.here.reach_m.max(if closed { self.deep_m } else { 0.0 }) + self.thick_m
    }

    /// Where a vertex of the skin `a` touches the skin `b`.
    fn vertex(&self, a: &SurfaceQuery<'_>, b: &SurfaceQuery<'_>, vertex: u32, at: DVec3) -> Option<SkinContact> {
        let out = BarycentricPoint::vertex(vertex).out(a.normals()).and_then(DVec3::try_normalize);
        let others = |triangle: [u32; 3]| self.own.is_none_or(|own| !own.is_one(vertex, triangle));
        let near = b.nearest(at, self.within_m(), None, others)?;
        // it is pushed out through a face that it can have come in by
        let way_out = || {
            let NearestPoint { spot, at: foot, face } = b.nearest(at, self.deep_m, out, others)?;
            let distance_m = at.distance(foot);
            let normal = if distance_m > CROSSING_M { (foot - at) / distance_m } else { face? };
            Some(SkinContact { spot, normal, distance_m: -distance_m })
        };
        if b.is_behind(near, at) {
            return way_out();
        }
        let NearestPoint { spot, at: foot, face } = near;
        let distance_m = at.distance(foot);
        if distance_m <= CROSSING_M {
            let Some(NearestPoint { spot, face, .. }) = b.nearest(at, distance_m + CROSSING_M, out, others) else {
                // in a side wall of a closed skin: it has come in by another face
                let behind =
                    |contact: &SkinContact| b.out_of(contact.spot).is_some_and(|face| face.dot(contact.normal) > 0.0);
                return way_out().filter(|contact| b.surface.form.closed && behind(contact));
            };
            let away = out.map(|out| -out);
            // an open skin may be meant from either side
            let normal = face.map(|face| if away.is_some_and(|away| face.dot(away) < 0.0) { -face } else { face });
            return Some(SkinContact { spot, normal: normal.or(away)?, distance_m: 0.0 });
        }
        let normal = (at - foot) / distance_m;
        let is_face = face.is_some_and(|face| face.dot(normal).abs() > FACE);
        if out.is_some_and(|out| out.dot(normal) > 0.0) {
            // the normal points away: an open skin has gone into it, or it is on the far side
            let least_m = if is_face { 0.0 } else { HALF * distance_m };
            let passed = !b.surface.form.closed
                && distance_m <= self.deep_m
                && Feature::Vertex(vertex).out(a.surface, normal).is_some()
                && a.holds(foot, least_m..=distance_m)
                && a.nearest(foot, distance_m, Some(normal), |_| true).is_none();
            return passed.then_some(SkinContact { spot, normal: -normal, distance_m: -distance_m });
        }
        let out_here = Feature::Vertex(vertex).out(a.surface, -normal)?;
        if let Some(face) = face.filter(|_| is_face) {
            let normal = face * face.dot(normal).signum();
            return Some(SkinContact { spot, normal, distance_m: normal.dot(at - foot) });
        }
        // ropes that run beside each other touch at one node after the other
        let here = Feature::Vertex(vertex);
        let nearest = if a.is_rope() {
            here.faces(a.surface, -normal, LEAN)
        } else {
            here.is_nearest(a.surface, -normal * distance_m)
        };
        nearest.then_some(SkinContact { spot, normal: -out_here, distance_m: -out_here.dot(normal) * distance_m })
    }

    /// The normal where two edges cross, towards the first, and their distance; `None` where a neighbouring part is nearer, and for
    /// parallel edges, whose ends report the same contact.
    fn crossing(&self, points: [SkinPoint; 2], ridges: [Feature; 2]) -> Option<(DVec3, f64)> {
        let [a, b] = points.map(|point| point.position);
        let [here, there] = [self.here, self.there];
        let out = [points[0].spot.out(here.normals()), points[1].spot.out(there.normals())];
        let across = along(ridges[0]).cross(along(ridges[1]));
        if across.length() < PARALLEL {
            return None;
        }
        let (across, way) = (across.normalize(), a - b);
        let distance_m = way.length();
        let toward = if distance_m > CROSSING_M { way } else { out[1].or(out[0].map(|out| -out))? };
        let normal = across * across.dot(toward).signum();
        let fronts = [out[0].map(|out| out.dot(normal) < 0.0), out[1].map(|out| out.dot(normal) > 0.0)];
        let mut fronts = fronts.into_iter().flatten();
        let [first, second] = ridges;
        if fronts.clone().all(|front| front) {
            let nearest = first.is_nearest(here.surface, -way) && second.is_nearest(there.surface, way);
            return nearest.then_some((normal, distance_m));
        }
        let passed = distance_m <= self.deep_m
            && fronts.all(|front| !front)
            && first.is_nearest(here.surface, way)
            && second.is_nearest(there.surface, -way)
            && here.holds(b, HALF * distance_m..=distance_m)
            && there.holds(a, HALF * distance_m..=distance_m);
        passed.then_some((-normal, -distance_m))
    }
}

/// The direction of an edge.
fn along(feature: Feature) -> DVec3 {
    if let Feature::Edge(_, [a, b]) = feature { (b - a).normalize_or_zero() } else { DVec3::ZERO }
}

impl SurfaceQuery<'_> {
    /// The place of the skin that is nearest to a point within `within_m`: of the triangles that `counts` accepts, and only of faces opposed to
    /// the normal `facing`, if one is given. Of places equally near that of the lowest number counts.
    fn nearest(
        &self,
        point: DVec3,
        within_m: f64,
        facing: Option<DVec3>,
        counts: impl Fn([u32; 3]) -> bool,
    ) -> Option<NearestPoint> {
        let region = Aabb::about(point, within_m);
        let mut best: Option<(f64, u32, NearestPoint)> = None;
        let mut offer = |number: u32, near: NearestPoint| {
            let distance2 = near.at.distance_squared(point);
            let nearer =
                best.is_none_or(|(least, before, _)| distance2 < least || (distance2 == least && number < before));
            if distance2 <= within_m * within_m && nearer {
                best = Some((distance2, number, near));
            }
        };
        self.surface.each_triangle(region, |Triangle { number, vertices, corners }| {
            if !counts(vertices) {
                return;
            }
            let Some(face) = (corners[1] - corners[0]).cross(corners[2] - corners[0]).try_normalize() else { return };
            if self.surface.form.closed && facing.is_some_and(|facing| facing.dot(face) > -FACING) {
                return;
            }
            let at = near_triangle(point, corners);
            let Some(shares) = shares(at, corners) else { return };
            offer(number, NearestPoint { spot: BarycentricPoint { vertices, shares }, at, face: Some(face) });
        });
        if self.surface.form.triangles.is_empty() {
            self.surface.each_edge(region, |edge| {
                let along = edge.ends[1] - edge.ends[0];
                let foot = (point - edge.ends[0]).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
                let SkinPoint { spot, position } = edge.at(foot.clamp(0.0, 1.0));
                offer(edge.number, NearestPoint { spot, at: position, face: None });
            });
        }
        best.map(|(.., near)| near)
    }

    /// Whether a point is inside the closed skin whose nearest place this is.
    fn is_behind(&self, near: NearestPoint, point: DVec3) -> bool {
        near.spot.out(self.normals()).is_some_and(|out| out.dot(point - near.at) < 0.0)
    }

    /// Whether a point is inside the skin, at a depth in this range, metres; for an open skin always true.
    pub(super) fn holds(&self, point: DVec3, deep_m: RangeInclusive<f64>) -> bool {
        let deep = |near: NearestPoint| near.at.distance(point) >= *deep_m.start() && self.is_behind(near, point);
        !self.surface.form.closed || self.nearest(point, deep_m.end() + CROSSING_M, None, |_| true).is_some_and(deep)
    }
}
