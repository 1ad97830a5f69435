//! Contacts of soft bodies' skins with any other piece: their vertices, edges and triangles.
//!
//! In: a surface and another piece. Out: touching places, with the normal towards the surface; a lower bound of the gap.
//! Theory: docs/theory/contact.md, eq. 7–11.
//!
//! A place is reported by the vertex, edge or triangle in whose region the other lies ([`crate::narrow_phase::skins::voronoi_regions`]): a part of
//! a flat skin that lies ahead is no wall. On a round piece each node over a triangle and each edge that it crosses is a place. A place of
//! the other side is reported in the surface itself, so that both sides are pushed at one point.

mod self_pairs;
mod surface_box;
mod surface_convex;
mod surface_surface;

use super::skin_tree::KnownForm;
use super::voronoi_regions::{Feature, LEAN, LEAN_SHARE};
use crate::narrow_phase::primitives::{Piece, Strand, StrandPoint, Surface};
use crate::narrow_phase::touch_key::{TouchKey, TouchKind};
use crate::solids::capsule_chain::CROSSING_M;
use crate::solids::signed_distance::Ball;
use crate::{Aabb, Place, SurfaceShape, Touch};
use crate::{near_segments, near_triangle};
use glam::DVec3;
use self_pairs::SelfPairs;
use surface_surface::SkinPair;

/// Two soft skins that have passed each other by more than this share of an edge are ignored: they came from elsewhere.
const DEEP_SHARE: f64 = 0.5;

/// By how much more than the reach asked for the features of a skin are found that may touch it, as a share of an
/// edge's length.
const ROOM_SHARE: f64 = 0.25;

/// Storage that searches keep.
#[derive(Default)]
pub(crate) struct SurfaceScratch {
    /// The patches of either surface that are near the other.
    patches: [Vec<u32>; 2],
    /// The pairs of each skin that was searched against itself.
    own: Vec<KnownPairs>,
}

/// The features of a skin that may touch it, as long as the skin is in use.
struct KnownPairs {
    form: KnownForm,
    pairs: SelfPairs,
}

/// A point of a surface: three vertices with shares.
#[derive(Clone, Copy)]
struct BarycentricPoint {
    vertices: [u32; 3],
    shares: [f64; 3],
}

impl BarycentricPoint {
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

    /// Whether it is a point of this triangle, its border included.
    fn is_on(self, triangle: &[u32; 3]) -> bool {
        self.vertices.into_iter().zip(self.shares).all(|(vertex, share)| share == 0.0 || triangle.contains(&vertex))
    }

    /// Whether it is a point of a triangle, not of a vertex or an edge.
    fn is_of_triangle(self) -> bool {
        self.vertices[1] != self.vertices[2]
    }

    fn place(self) -> Place {
        Place::Surface { vertices: self.vertices, shares: self.shares }
    }
}

/// A spot and its position, metres.
#[derive(Clone, Copy)]
struct SkinPoint {
    spot: BarycentricPoint,
    position: DVec3,
}

impl SkinPoint {
    fn vertex(vertex: u32, position: DVec3) -> Self {
        Self { spot: BarycentricPoint::vertex(vertex), position }
    }
}

/// A point of a strand.
#[derive(Clone, Copy)]
struct StrandSpot<'s, 'a> {
    strand: &'s Strand<'a>,
    point: StrandPoint,
}

/// A normal from a strand's core to a point of a skin, and the distance along it, metres.
struct Apart {
    normal: DVec3,
    distance_m: f64,
}

/// An edge of a skin, and where its ends are.
#[derive(Clone, Copy)]
struct Edge {
    number: u32,
    vertices: [u32; 2],
    ends: [DVec3; 2],
}

impl Edge {
    /// The point at this share of the way from the first end to the second.
    fn at(&self, share: f64) -> SkinPoint {
        SkinPoint {
            spot: BarycentricPoint::edge(self.vertices, share),
            position: self.ends[0].lerp(self.ends[1], share),
        }
    }

    fn feature(&self) -> Feature {
        Feature::Edge(self.number, self.ends)
    }
}

/// A triangle of a skin, and where its corners are.
#[derive(Clone, Copy)]
struct Triangle {
    number: u32,
    vertices: [u32; 3],
    corners: [DVec3; 3],
}

impl Triangle {
    /// Its point nearest to `point`; `None` unless it is inside.
    fn inside(&self, point: DVec3) -> Option<SkinPoint> {
        let position = near_triangle(point, self.corners);
        let shares = shares(position, self.corners)?;
        let deep = shares.into_iter().all(|share| share > LEAN_SHARE);
        deep.then_some(SkinPoint { spot: BarycentricPoint { vertices: self.vertices, shares }, position })
    }
}

impl Triangle {
    /// The foot of a point on its plane, if that is inside it or on its border.
    fn under(&self, point: DVec3) -> Option<SkinPoint> {
        let shares = shares(point, self.corners)?;
        let [a, b, c] = self.corners;
        let position = a * shares[0] + b * shares[1] + c * shares[2];
        let within = shares.into_iter().all(|share| share >= -LEAN_SHARE);
        within.then_some(SkinPoint { spot: BarycentricPoint { vertices: self.vertices, shares }, position })
    }
}

impl Surface<'_> {
    fn at(&self, vertex: u32) -> DVec3 {
        self.positions[vertex as usize]
    }

    fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|vertex| self.at(vertex))
    }

    /// The normal of a triangle, out of a closed skin; `None` for one without area.
    fn out(&self, triangle: [u32; 3]) -> Option<DVec3> {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).try_normalize()
    }

    fn edge(&self, number: u32) -> Edge {
        let vertices = self.form.edges[number as usize];
        Edge { number, vertices, ends: vertices.map(|vertex| self.at(vertex)) }
    }

    fn triangle(&self, number: u32) -> Triangle {
        let vertices = self.form.triangles[number as usize];
        Triangle { number, vertices, corners: self.corners(vertices) }
    }

    /// Visits the edges that meet a region, in any order.
    fn each_edge(&self, region: Aabb, visit: impl FnMut(Edge)) {
        let patches = self.skin.patches(|around| around.meets(region));
        self.edges_of(patches, region).for_each(visit);
    }

    /// Visits the triangles that meet a region, in any order.
    fn each_triangle(&self, region: Aabb, visit: impl FnMut(Triangle)) {
        let patches = self.skin.patches(|around| around.meets(region));
        self.triangles_of(patches, region).for_each(visit);
    }

    /// The edges of patches that meet a region.
    fn edges_of(&self, patches: impl Iterator<Item = u32>, region: Aabb) -> impl Iterator<Item = Edge> {
        let edges = patches.flat_map(|patch| self.skin.edges(patch)).map(|number| self.edge(*number));
        edges.filter(move |edge| Aabb::of(&edge.ends).meets(region))
    }

    /// The triangles of patches that meet a region.
    fn triangles_of(&self, patches: impl Iterator<Item = u32>, region: Aabb) -> impl Iterator<Item = Triangle> {
        let triangles = patches.flat_map(|patch| self.skin.triangles(patch)).map(|number| self.triangle(*number));
        triangles.filter(move |triangle| Aabb::of(&triangle.corners).meets(region))
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
    pub(crate) fn touches(&mut self, surface: &Surface<'_>, other: &Piece<'_>, reach_m: f64, into: &mut Vec<Touch>) {
        let [first, second] = &mut self.patches;
        let region = other.bounds().grown(reach_m + surface.form.radius_m);
        let look_m = look_m(surface, other, reach_m);
        let near = surface.skin.patches(|around| other.is_in(around.grown(look_m)));
        first.clear();
        first.extend(near);
        let query = SurfaceQuery { surface, reach_m, region, patches: first };
        match other {
            Piece::Strand(strand) => query.strand(strand, into),
            Piece::Block(block) => {
                let Some(field) = block.field else { return };
                match field.half_extents_m() {
                    Some(half_m) if surface.form.closed && !block.pierces => query.box_touches(block, half_m, into),
                    _ => query.block(block, field, into),
                }
            }
            Piece::Surface(there) => {
                let region = surface.bounds.grown(reach_m + surface.form.radius_m + there.form.radius_m);
                let near = there.skin.patches(|around| surface.skin.meets(around.grown(look_m)));
                second.clear();
                second.extend(near);
                let back = SurfaceQuery { surface: there, reach_m, region, patches: second };
                SkinPair::new(&query, &back).touches(into);
            }
        }
    }

    /// Every place within `reach_m` of a surface with itself; `rest` holds its vertices at rest.
    pub(crate) fn self_touches(&mut self, surface: &Surface<'_>, rest: &[DVec3], reach_m: f64, into: &mut Vec<Touch>) {
        let Self { patches: [patches, _], own } = self;
        patches.clear();
        patches.extend(surface.skin.patches(|_| true));
        let query = SurfaceQuery { surface, reach_m, region: surface.bounds, patches };
        let pair = SkinPair::with_itself(&query, rest);
        let at = own.iter().position(|known| known.form.is_that_of(surface.form)).unwrap_or_else(|| {
            own.retain(|known| known.form.is_had());
            own.push(KnownPairs { form: KnownForm::new(surface.form), pairs: SelfPairs::default() });
            own.len() - 1
        });
        let pairs = &mut own[at].pairs;
        let asked_m = pair.within_m();
        if !pairs.has_all(rest, surface.positions, asked_m) {
            let within_m = asked_m + ROOM_SHARE * surface.form.edge_m;
            pairs.clear(rest, surface.positions, within_m);
            pair.find_pairs(within_m, pairs);
        }
        pair.self_touches(pairs, into);
    }
}

/// How far from a part of the other the vertices, edges and triangles of a surface are tested, beyond the box of [`Piece::is_in`], metres.
fn look_m(surface: &Surface<'_>, other: &Piece<'_>, reach_m: f64) -> f64 {
    let SurfaceShape { radius_m, edge_m, .. } = *surface.form;
    match other {
        Piece::Strand(_) => radius_m + reach_m,
        // a corner of the block may be that deep behind a triangle
        Piece::Block(_) => radius_m + reach_m.max(DEEP_SHARE * edge_m) + LEAN_SHARE * edge_m,
        Piece::Surface(there) => SkinPair::look_m([surface.form, there.form], reach_m),
    }
}

/// A lower bound of the gap by the boxes around both, and a direction from the other to the surface.
pub(crate) fn gap(surface: &Surface<'_>, other: &Piece<'_>) -> (DVec3, f64) {
    let (here, there) = (surface.bounds, other.bounds());
    let apart = (here.low - there.high).max(DVec3::ZERO) - (there.low - here.high).max(DVec3::ZERO);
    let between = 0.5 * (here.low + here.high) - 0.5 * (there.low + there.high);
    let normal = apart.try_normalize().or(between.try_normalize()).unwrap_or(DVec3::Z);
    (normal, apart.length() - surface.form.radius_m)
}

/// A surface and another piece that may touch.
struct SurfaceQuery<'a> {
    surface: &'a Surface<'a>,
    reach_m: f64,
    /// Nothing outside this box and these patches is near.
    region: Aabb,
    patches: &'a [u32],
}

impl SurfaceQuery<'_> {
    /// For a closed surface the outward normal at each vertex, of any length; none for an open one.
    fn normals(&self) -> &[DVec3] {
        self.surface.skin.normals()
    }

    /// The vertices near the other, and where they are.
    fn vertices(&self) -> impl Iterator<Item = (u32, DVec3)> {
        let Aabb { low, high } = self.region;
        let all = self.patches.iter().flat_map(|patch| self.surface.skin.vertices(*patch));
        let placed = all.map(|vertex| (*vertex, self.surface.at(*vertex)));
        placed.filter(move |(_, at)| at.cmple(high).all() && at.cmpge(low).all())
    }

    /// The edges near the other.
    fn edges(&self) -> impl Iterator<Item = Edge> {
        self.surface.edges_of(self.patches.iter().copied(), self.region)
    }

    /// The triangles near the other.
    fn triangles(&self) -> impl Iterator<Item = Triangle> {
        self.surface.triangles_of(self.patches.iter().copied(), self.region)
    }

    fn strand(&self, strand: &Strand<'_>, into: &mut Vec<Touch>) {
        for (vertex, at) in self.vertices() {
            let nearest = nearest_on(strand, at);
            let core = ball_at(strand, nearest).centre;
            // a point behind the skin of a closed body is pushed out by its triangles
            let outside = self.normals().get(vertex as usize).is_none_or(|normal| normal.dot(core - at) >= 0.0);
            let (key, point) = (vertex_key(vertex), SkinPoint::vertex(vertex, at));
            if self.is_rope() {
                into.extend(self.beside_rope(key, point, strand, nearest));
            } else if outside && Feature::Vertex(vertex).is_nearest(self.surface, core - at) {
                into.extend(self.strand_contact(key, point, strand, nearest));
            }
        }
        let within_m = self.reach_m + self.surface.form.radius_m;
        for span in 0..strand.spans() {
            let [a, b] = strand.ends(span);
            let around = Aabb::of(&[a.centre, b.centre]).grown(within_m + a.radius_m.max(b.radius_m));
            self.surface.each_edge(around, |edge| into.extend(self.edge_beside(&edge, strand, span)));
        }
        for node in 0..strand.count() {
            self.node_over(strand, node, into);
        }
    }

    /// An edge beside a span of a strand.
    fn edge_beside(&self, edge: &Edge, strand: &Strand<'_>, span: usize) -> Option<Touch> {
        let (share, at) = near_segments(strand.ends(span).map(|ball| ball.centre), edge.ends);
        if !(LEAN_SHARE..=1.0 - LEAN_SHARE).contains(&at) || (share == 1.0 && span + 1 < strand.spans()) {
            return None;
        }
        let here = StrandPoint { span, share };
        let (point, ball) = (edge.at(at), ball_at(strand, here));
        let way = ball.centre - point.position;
        let faces = |vertex: &u32| self.normals().get(*vertex as usize).is_none_or(|normal| normal.dot(way) >= 0.0);
        let outside = edge.vertices.iter().all(faces);
        let key = TouchKey::new(TouchKind::Edge, [edge.number, span as u32]);
        let is_nearest = outside && edge.feature().is_nearest(self.surface, way);
        is_nearest.then(|| self.strand_contact(key, point, strand, here)).flatten()
    }

    /// A node of a strand over each triangle, or over the line between two.
    fn node_over(&self, strand: &Strand<'_>, node: usize, into: &mut Vec<Touch>) {
        let Ball { centre, radius_m } = strand.ball(node);
        let within_m = (radius_m + self.reach_m + self.surface.form.radius_m).max(2.0 * radius_m);
        let key = |triangle: u32| TouchKey::new(TouchKind::Triangle, [triangle, node as u32]);
        // of two lines as near as each other that of the lesser triangle, in whatever order they are visited
        let (mut is_over, mut beside) = (false, None::<(f64, u32, SkinPoint)>);
        self.surface.each_triangle(Aabb::about(centre, within_m), |triangle| {
            if let Some(point) = triangle.inside(centre) {
                is_over = true;
                into.extend(self.strand_contact(key(triangle.number), point, strand, strand.node(node)));
            } else if let Some(point) = triangle.under(centre) {
                let (distance_m, number) = (point.position.distance(centre), triangle.number);
                if beside.is_none_or(|(least_m, first, _)| (distance_m, number) < (least_m, first)) {
                    beside = Some((distance_m, number, point));
                }
            }
        });
        if let (false, Some((_, number, point))) = (is_over, beside) {
            into.extend(self.strand_contact(key(number), point, strand, strand.node(node)));
        }
    }

    fn is_rope(&self) -> bool {
        self.surface.form.triangles.is_empty()
    }

    /// The contact of a vertex of a rope with a strand that may run beside it, and then touch it at one node after the other: its normal
    /// is across the rope, so that none of them is a wall to the next.
    fn beside_rope(&self, key: TouchKey, here: SkinPoint, strand: &Strand<'_>, there: StrandPoint) -> Option<Touch> {
        let ball = ball_at(strand, there);
        let way = (ball.centre - here.position).try_normalize()?;
        let feature = Feature::Vertex(here.spot.vertices[0]);
        let out = feature.out(self.surface, way).filter(|_| feature.faces(self.surface, way, LEAN))?;
        let distance_m = out.dot(ball.centre - here.position);
        self.strand_touch(key, here, StrandSpot { strand, point: there }, Apart { normal: -out, distance_m })
    }

    /// The contact between a point of the skin and one of a strand, unless they are too far.
    fn strand_contact(&self, key: TouchKey, here: SkinPoint, strand: &Strand<'_>, there: StrandPoint) -> Option<Touch> {
        let SkinPoint { spot, position: point } = here;
        let ball = ball_at(strand, there);
        let way = point - ball.centre;
        let out = if spot.is_of_triangle() && self.surface.form.closed { self.out_of(spot) } else { None };
        // a core that lies exactly in the skin of a closed body counts as outside it
        let inward = || spot.out(self.normals()).and_then(DVec3::try_normalize).map(|out| -out);
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
        self.strand_touch(key, here, StrandSpot { strand, point: there }, Apart { normal, distance_m: distance })
    }

    /// The touch of a point of the skin and one of a strand that are so far apart, unless that is too far.
    fn strand_touch(
        &self,
        key: TouchKey,
        here: SkinPoint,
        there: StrandSpot<'_, '_>,
        Apart { normal, distance_m }: Apart,
    ) -> Option<Touch> {
        let StrandSpot { strand, point: there } = there;
        let ball = ball_at(strand, there);
        let gap_m = distance_m - ball.radius_m - self.surface.form.radius_m;
        let half = 0.5 * gap_m;
        let on_b = match strand.place(there.span, there.share, ball, normal) {
            Place::Chain { segment, share, .. } => Place::Chain { segment, share, radius_m: distance_m - half },
            _ => Place::Point(here.position - normal * half),
        };
        (gap_m <= self.reach_m).then(|| Touch { key, normal, gap_m, on_a: here.spot.place(), on_b })
    }

    /// Whether a point is in front of a triangle that is nearer than `within_m`.
    fn is_before(&self, point: DVec3, within_m: f64) -> bool {
        let mut is_before = false;
        self.surface.each_triangle(Aabb::about(point, within_m), |Triangle { corners: [a, b, c], .. }| {
            let way = point - near_triangle(point, [a, b, c]);
            is_before |= way.length() < within_m * (1.0 - LEAN_SHARE) && (b - a).cross(c - a).dot(way) > 0.0;
        });
        is_before
    }

    /// The normal of the triangle of a spot; `None` for a vertex or an edge.
    fn out_of(&self, spot: BarycentricPoint) -> Option<DVec3> {
        self.surface.out(spot.vertices)
    }
}

/// The key of the place of a vertex.
fn vertex_key(vertex: u32) -> TouchKey {
    TouchKey::new(TouchKind::Vertex, [vertex, 0])
}

/// The ball of a strand at a point of it.
fn ball_at(strand: &Strand<'_>, point: StrandPoint) -> Ball {
    let [a, b] = strand.ends(point.span);
    a.toward(b, point.share)
}

/// The point of a strand whose skin is nearest to `at`.
fn nearest_on(strand: &Strand<'_>, at: DVec3) -> StrandPoint {
    let (mut nearest, mut least_m) = (StrandPoint { span: 0, share: 0.0 }, f64::INFINITY);
    for span in 0..strand.spans() {
        let [a, b] = strand.ends(span);
        let way = b.centre - a.centre;
        let length2 = way.length_squared();
        let share = if length2 > 0.0 { ((at - a.centre).dot(way) / length2).clamp(0.0, 1.0) } else { 0.0 };
        let ball = a.toward(b, share);
        let gap_m = at.distance(ball.centre) - ball.radius_m;
        if gap_m < least_m {
            (nearest, least_m) = (StrandPoint { span, share }, gap_m);
        }
    }
    nearest
}
