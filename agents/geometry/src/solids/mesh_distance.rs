//! Distances from a triangle mesh: the walls that a ball touches, and the convex edges that a span touches.
//!
//! A surface point counts in addition to a nearer one only if it is in front of the nearer one's tangent plane (eq. 2): a flat floor of
//! many triangles gives one contact, a corner gives one per wall, and the far side of a thin plate none.
//! The normals decide on which side a point is; a mesh is also detected from behind, as deep as the search reaches.

use super::parry_shapes::Triangles;
use super::signed_distance::{Ball, Touch, Touches};
use crate::solids::signed_distance;
use crate::space::closest_points::{near_segments, near_triangle};
use glam::{DVec3, Vec3};
use rapier3d::parry::bounding_volume::Aabb;
use rapier3d::parry::partitioning::{Bvh, BvhBuildStrategy, BvhNode, TraversalAction};
use std::collections::BTreeMap;

/// A mesh in world axes.
#[derive(Debug, Clone)]
pub struct MeshField {
    faces: Vec<Face>,
    face_tree: Bvh,
    edges: Vec<Edge>,
    edge_tree: Bvh,
    bounds: crate::Aabb,
}

#[derive(Debug, Clone)]
struct Face {
    corners: [DVec3; 3],
    normal: DVec3,
    /// Whether the edge from corner i to corner i + 1 is a border: no triangle on its other side.
    rim: [bool; 3],
}

/// A convex edge, or the border of an open mesh.
#[derive(Debug, Clone)]
struct Edge {
    ends: [DVec3; 2],
    normals: [DVec3; 2],
}

/// The nearest point of one triangle.
#[derive(Debug, Clone, Copy)]
struct Place {
    /// The number of the triangle.
    face: u32,
    point: DVec3,
    distance: f64,
    /// Sine of the angle between the direction to the query point and the triangle's plane; negative behind it.
    side: f64,
    normal: DVec3,
}

/// Least distance of a further surface point in front of an accepted tangent plane, as a fraction of the reach: larger than the steps
/// between the triangles of a smooth hollow.
const FRONT_SHARE: f64 = 1e-3;
/// Relative difference below which distances count as equal: the triangles around an edge share their nearest point.
const SAME_SHARE: f64 = 1e-9;
/// Above this sine the direction counts as normal: the query point is above the inside of a triangle (angle to the normal below 1e-3 of a
/// radian).
const SQUARE: f64 = 1.0 - 1e-6;
/// Sine of the angle above which a convex edge counts: 1°.
const SHARP_SINE: f64 = 0.017;
/// Boxes of the trees are single precision: this fraction of their coordinates covers the rounding.
const BOX_MARGIN: f32 = 1e-6;

impl MeshField {
    /// The field of triangles given in world axes.
    pub fn new(mesh: Triangles) -> Self {
        let mut faces: Vec<Face> = mesh
            .triangles
            .iter()
            .map(|t| t.map(|i| mesh.points[i as usize]))
            .map(|corners| Face { corners, normal: face_normal(corners), rim: [false; 3] })
            .collect();
        let edges = standing_edges(&mut faces);
        let face_tree = tree(faces.iter().map(|f| f.corners.as_slice()));
        let edge_tree = tree(edges.iter().map(|e| e.ends.as_slice()));
        let bounds = crate::Aabb::of(&mesh.points);
        Self { faces, face_tree, edges, edge_tree, bounds }
    }

    /// Distance of `point` from the bounding box of all triangles, metres; 0 inside.
    pub fn distance_from_bounds(&self, point: DVec3) -> f64 {
        let crate::Aabb { low, high } = self.bounds;
        (low - point).max(point - high).max(DVec3::ZERO).length()
    }

    /// Visits the triangles whose boxes meet `region`: number, corners and normal.
    pub fn triangles_in(&self, region: crate::Aabb, mut visit: impl FnMut(u32, [DVec3; 3], DVec3)) {
        let (middle, half) = ((region.low + region.high) * 0.5, (region.high - region.low) * 0.5);
        self.face_tree.traverse(|node| {
            if misses(node, middle, half) {
                return TraversalAction::Prune;
            }
            if let Some(leaf) = node.leaf_data() {
                let face = &self.faces[leaf as usize];
                visit(leaf, face.corners, face.normal);
            }
            TraversalAction::Continue
        });
    }

    /// Whether a triangle meets both a box and the ball around it.
    pub fn is_in(&self, region: crate::Aabb) -> bool {
        let (middle, half) = ((region.low + region.high) * 0.5, (region.high - region.low) * 0.5);
        let mut is_in = false;
        self.face_tree.traverse(|node| {
            if misses(node, middle, half) {
                return TraversalAction::Prune;
            }
            let Some(leaf) = node.leaf_data() else { return TraversalAction::Continue };
            let near = near_triangle(middle, self.faces[leaf as usize].corners);
            is_in = near.distance_squared(middle) <= half.length_squared();
            if is_in { TraversalAction::EarlyExit } else { TraversalAction::Continue }
        });
        is_in
    }

    /// Every wall within `reach_m` of `centre`, nearest first (eq. 2).
    pub fn touches(&self, centre: DVec3, reach_m: f64, found: &mut Touches) {
        let mut planes = [(DVec3::ZERO, DVec3::ZERO); signed_distance::TOUCHES_MAX];
        let mut count = 0;
        while !found.is_full() {
            let Some(place) = self.nearest(centre, reach_m, &planes[..count], None) else { return };
            let touch = place.touch(centre);
            planes[count] = (place.point, touch.normal);
            count += 1;
            found.push(touch);
        }
    }

    /// The nearest wall within `reach_m` of `centre`. `last` is the triangle that was nearest to a point near by, if any, and then that of
    /// this one: the search is shorter, with the same end.
    pub fn touch(&self, centre: DVec3, reach_m: f64, last: &mut Option<u32>) -> Option<Touch> {
        let place = self.nearest(centre, reach_m, &[], *last)?;
        *last = Some(place.face);
        Some(place.touch(centre))
    }

    /// The nearest surface point in front of all `planes`. Where there are none, it is no farther than that of the triangle `last`.
    fn nearest(&self, centre: DVec3, reach_m: f64, planes: &[(DVec3, DVec3)], last: Option<u32>) -> Option<Place> {
        let front_m = FRONT_SHARE * reach_m;
        let counts = |place: &Place| !place.behind_rim(&self.faces[place.face as usize]) && place.distance <= reach_m;
        let known = last.map(|face| self.place(face, centre)).filter(counts);
        let far_m = known.map_or(reach_m, |place| place.distance * (1.0 + SAME_SHARE));
        let mut best: Option<Place> = None;
        self.face_tree.traverse(|node| {
            let bound = best.map_or(far_m, |b| b.distance * (1.0 + SAME_SHARE));
            let hidden = |&(point, normal): &(DVec3, DVec3)| front_of_box(node, point, normal) <= front_m;
            if distance2_to_box(node, centre) > bound * bound || planes.iter().any(hidden) {
                return TraversalAction::Prune;
            }
            if let Some(leaf) = node.leaf_data() {
                let place = self.place(leaf, centre);
                let seen = |&(point, normal): &(DVec3, DVec3)| (place.point - point).dot(normal) > front_m;
                if counts(&place) && planes.iter().all(seen) && best.is_none_or(|b| place.before(&b)) {
                    best = Some(place);
                }
            }
            TraversalAction::Continue
        });
        best
    }

    /// The point of a triangle that is nearest to `centre`.
    fn place(&self, face: u32, centre: DVec3) -> Place {
        let Face { corners, normal, .. } = self.faces[face as usize];
        let point = near_triangle(centre, corners);
        let way = centre - point;
        let distance = way.length();
        let side = if distance > 0.0 { way.dot(normal) / distance } else { 1.0 };
        Place { face, point, distance, side, normal }
    }

    /// The convex or border edge nearest to the inside of a span, and the fraction of the span at which it is.
    pub fn touches_span(&self, ends: [Ball; 2], reach_m: f64) -> Option<(f64, Touch)> {
        let [a, b] = ends.map(|e| e.centre);
        let widest = ends[0].radius_m.max(ends[1].radius_m) + reach_m;
        let (middle, half) = ((a + b) * 0.5, (b - a).abs() * 0.5 + DVec3::splat(widest));
        let mut best: Option<(f64, f64, Touch)> = None;
        self.edge_tree.traverse(|node| {
            if misses(node, middle, half) {
                return TraversalAction::Prune;
            }
            if let Some(leaf) = node.leaf_data()
                && let Some((share, touch)) = self.edges[leaf as usize].touch([a, b])
            {
                let gap = touch.distance_m - ends[0].toward(ends[1], share).radius_m;
                if gap <= best.map_or(reach_m, |b| b.0) {
                    best = Some((gap, share, touch));
                }
            }
            TraversalAction::Continue
        });
        best.map(|(_, share, touch)| (share, touch))
    }

    /// Distance of the surface from a segment, and the normal out of the surface; 0 where the segment intersects it.
    pub fn nearest_to_span(&self, span: [DVec3; 2], reach_m: f64) -> Option<Touch> {
        let [a, b] = span;
        let (middle, half) = ((a + b) * 0.5, (b - a).abs() * 0.5);
        let mut best: Option<Touch> = None;
        self.face_tree.traverse(|node| {
            let bound_m = best.map_or(reach_m, |b| b.distance_m);
            if misses(node, middle, half + DVec3::splat(bound_m)) {
                return TraversalAction::Prune;
            }
            if let Some(leaf) = node.leaf_data() {
                let face = &self.faces[leaf as usize];
                let (on_span, on_face) = face.near_span(span);
                let distance_m = on_span.distance(on_face);
                if distance_m <= bound_m {
                    let normal = (on_span - on_face).try_normalize().unwrap_or(face.normal);
                    best = Some(Touch { normal, distance_m });
                }
            }
            TraversalAction::Continue
        });
        best
    }
}

/// Whether a box around a span, `half` to each side of `middle`, misses the box of a node.
fn misses(node: &BvhNode, middle: DVec3, half: DVec3) -> bool {
    let apart =
        (middle - (node.mins() + node.maxs()).as_dvec3() * 0.5).abs() - (node.maxs() - node.mins()).as_dvec3() * 0.5;
    apart.cmpgt(half).any()
}

impl Face {
    /// The nearest points of a segment and this triangle: the segment's, and the triangle's.
    fn near_span(&self, span: [DVec3; 2]) -> (DVec3, DVec3) {
        let [a, b] = span;
        let (high, low) = ((a - self.corners[0]).dot(self.normal), (b - self.corners[0]).dot(self.normal));
        if high * low < 0.0 {
            let cut = a.lerp(b, high / (high - low));
            let foot = near_triangle(cut, self.corners);
            if cut.distance_squared(foot) <= SAME_SHARE * SAME_SHARE * a.distance_squared(b) {
                return (cut, foot);
            }
        }
        let ends = [(a, near_triangle(a, self.corners)), (b, near_triangle(b, self.corners))];
        let edges = [0, 1, 2].map(|i| {
            let edge = [self.corners[i], self.corners[(i + 1) % 3]];
            let (s, t) = near_segments(span, edge);
            (a.lerp(b, s), edge[0].lerp(edge[1], t))
        });
        let apart = |(p, q): (DVec3, DVec3)| p.distance_squared(q);
        let nearer = |best, next| if apart(next) < apart(best) { next } else { best };
        edges.into_iter().fold(nearer(ends[0], ends[1]), nearer)
    }
}

impl Place {
    /// Whether this surface point takes precedence over `other`: nearer, or equally near with a direction closer to the normal.
    fn before(&self, other: &Self) -> bool {
        let same = (self.distance - other.distance).abs() <= SAME_SHARE * other.distance;
        if same { self.side.abs() > other.side.abs() } else { self.distance < other.distance }
    }

    /// Whether the query point is beyond the border of an open mesh and behind it: no contact there.
    fn behind_rim(&self, face: &Face) -> bool {
        if self.side >= 0.0 || self.side < -SQUARE {
            return false;
        }
        (0..3).any(|i| {
            let (a, b) = (face.corners[i], face.corners[(i + 1) % 3]);
            let off = (b - a).cross(self.point - a).length();
            face.rim[i] && off <= 1e-9 * (b - a).length_squared()
        })
    }

    fn touch(&self, centre: DVec3) -> Touch {
        let sign = if self.side < 0.0 { -1.0 } else { 1.0 };
        let way = (centre - self.point) * sign;
        // at the surface the direction to the query point is undefined
        let square = self.side.abs() > SQUARE || self.distance < 1e-9;
        let normal = if square { self.normal } else { way / self.distance };
        Touch { normal, distance_m: self.distance * sign }
    }
}

impl Edge {
    /// The fraction of the span at which it is nearest to this edge, and the contact, if outside the surface.
    fn touch(&self, span: [DVec3; 2]) -> Option<(f64, Touch)> {
        let (share, along) = near_segments(span, self.ends);
        let point = self.ends[0].lerp(self.ends[1], along);
        let way = span[0].lerp(span[1], share) - point;
        let distance_m = way.length();
        let outside = self.normals.iter().any(|n| n.dot(way) >= 0.0);
        (outside && distance_m > 0.0).then(|| (share, Touch { normal: way / distance_m, distance_m }))
    }
}

fn face_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or(DVec3::Z)
}

/// The position of a corner as a key: coincident corners are one, whatever their indices.
fn key(p: DVec3) -> [u64; 3] {
    (p + DVec3::ZERO).to_array().map(f64::to_bits)
}

/// Marks the borders of `faces` and lists the convex and border edges.
fn standing_edges(faces: &mut [Face]) -> Vec<Edge> {
    let mut sides: BTreeMap<[[u64; 3]; 2], Vec<(usize, usize)>> = BTreeMap::new();
    for (f, face) in faces.iter().enumerate() {
        for i in 0..3 {
            let mut name = [key(face.corners[i]), key(face.corners[(i + 1) % 3])];
            name.sort_unstable();
            sides.entry(name).or_default().push((f, i));
        }
    }
    let mut edges = Vec::new();
    for users in sides.values() {
        let (f, i) = users[0];
        let (a, b) = (faces[f].corners[i], faces[f].corners[(i + 1) % 3]);
        let other = users.get(1).map_or(faces[f].normal, |&(g, _)| faces[g].normal);
        // the turn from one face to the next about the edge: positive where the edge is convex
        let turn = faces[f].normal.cross(other).dot((b - a).normalize_or_zero());
        if users.len() == 1 {
            faces[f].rim[i] = true;
        }
        if users.len() == 1 || turn > SHARP_SINE || faces[f].normal.dot(other) < -1.0 + 1e-6 {
            edges.push(Edge { ends: [a, b], normals: [faces[f].normal, other] });
        }
    }
    edges
}

fn tree<'a>(items: impl Iterator<Item = &'a [DVec3]>) -> Bvh {
    let boxes: Vec<Aabb> = items
        .map(|points| {
            let crate::Aabb { low, high } = crate::Aabb::of(points);
            let slack = Vec3::splat(BOX_MARGIN * (1.0 + low.abs().max(high.abs()).max_element() as f32));
            Aabb::new(low.as_vec3() - slack, high.as_vec3() + slack)
        })
        .collect();
    Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes)
}

fn distance2_to_box(node: &BvhNode, point: DVec3) -> f64 {
    let (low, high) = (node.mins().as_dvec3(), node.maxs().as_dvec3());
    (low - point).max(point - high).max(DVec3::ZERO).length_squared()
}

/// Extent of the box in front of a plane.
fn front_of_box(node: &BvhNode, point: DVec3, normal: DVec3) -> f64 {
    let (low, high) = (node.mins().as_dvec3(), node.maxs().as_dvec3());
    let farthest = DVec3::select(normal.cmpgt(DVec3::ZERO), high, low);
    (farthest - point).dot(normal)
}
