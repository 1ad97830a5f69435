//! Signed distance and normal of a static solid: the geometry of contact with obstacles.
//!
//! In: an [`Obstacle`], balls and spans between balls. Out: the points where they touch it, or nearly do.
//! Never here: velocities, forces. Theory: `docs/theory/contact.md`, eq. 1–3.

use super::mesh_distance::MeshField;
use super::parry_shapes::{hull_triangles, mesh_triangles};
use crate::{Aabb, Obstacle, ShapeError, Solid};
use glam::{DQuat, DVec2, DVec3};

/// A point of an obstacle's surface near a query point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Unit normal of the surface, out of the obstacle.
    pub normal: DVec3,
    /// Distance of the query point from the surface, metres; negative inside.
    pub distance_m: f64,
}

impl Touch {
    /// Whether the surface point touched by the inner `ball` of a span is behind the tangent plane of this one, which the span's `end`
    /// already touches (eq. 2).
    pub fn hides(self, end: Ball, ball: Ball, touch: Self) -> bool {
        let wall = end.centre - self.normal * self.distance_m;
        let place = ball.centre - touch.normal * touch.distance_m;
        self.distance_m <= end.radius_m
            && (place - wall).dot(self.normal) <= 0.0
            && self.normal.dot(touch.normal) > FLAT
    }
}

/// Most contact points of one ball with one obstacle: a corner of a room has three.
pub const TOUCHES_MAX: usize = 4;

/// Up to [`TOUCHES_MAX`] contact points, nearest first.
#[derive(Debug, Clone, Copy, Default)]
pub struct Touches {
    places: [Option<Touch>; TOUCHES_MAX],
    count: usize,
    /// Lower bound of the distance to any surface, metres, independent of the reach.
    pub clear_m: f64,
}

impl Touches {
    /// Adds a contact point; a full list stays unchanged.
    pub fn push(&mut self, touch: Touch) {
        if self.count < TOUCHES_MAX {
            self.places[self.count] = Some(touch);
            self.count += 1;
        }
    }

    /// Whether the list is full.
    pub fn is_full(&self) -> bool {
        self.count == TOUCHES_MAX
    }

    /// The contact points, nearest first.
    pub fn iter(&self) -> impl Iterator<Item = Touch> + '_ {
        self.places.iter().flatten().copied()
    }
}

/// A ball on a curve: a node with the curve's radius there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Centre, metres.
    pub centre: DVec3,
    /// Radius, metres, ≥ 0.
    pub radius_m: f64,
}

impl Ball {
    /// The ball interpolated at `s` towards `other`.
    pub fn toward(self, other: Self, s: f64) -> Self {
        Self {
            centre: self.centre.lerp(other.centre, s),
            radius_m: self.radius_m + (other.radius_m - self.radius_m) * s,
        }
    }
}

/// A solid as a field of distances, at its pose.
#[derive(Debug, Clone)]
pub struct Field {
    kind: Kind,
    position: DVec3,
    rotation: DQuat,
}

#[derive(Debug, Clone)]
enum Kind {
    Ball(f64),
    Box(DVec3),
    Capsule(f64, f64),
    Cylinder(f64, f64),
    Plane,
    /// Triangles, already in world axes: an obstacle never moves.
    Mesh(std::boxed::Box<MeshField>),
}

/// The lowest point inside a span.
struct Lowest {
    share: f64,
    touch: Touch,
    /// Height of the intersection of the tangents: a lower bound of the gap, metres.
    floor_m: f64,
}

/// Normals whose cosine is above this belong to the same wall: 0.8°.
const FLAT: f64 = 0.9999;
/// Iterations of the search for the lowest point of a span: tangents converge much faster on smooth shapes.
const SPAN_TRIES: usize = 16;
/// Tolerance between the lowest point and the lower bound of the tangents, as a fraction of the span.
const LOWEST_SHARE: f64 = 1e-6;
/// Below this tilt a cylinder rests on its whole rim: no point of the rim is the nearest.
const UPRIGHT: f64 = 1e-3;
/// A lowest point closer to an end than this, as a fraction of the span, belongs to that end's own ball.
const SPAN_END_SHARE: f64 = 0.02;

impl Field {
    /// The field of an obstacle.
    ///
    /// # Errors
    /// [`ShapeError`] in the cases of [`Solid::to_shared_shape`].
    pub fn new(obstacle: &Obstacle) -> Result<Self, ShapeError> {
        Self::placed(&obstacle.solid, obstacle.position, obstacle.rotation.normalize())
    }

    /// The field of a solid in its own axes, for solids that move.
    ///
    /// # Errors
    /// Like [`Field::new`].
    pub fn of(solid: &Solid) -> Result<Self, ShapeError> {
        Self::placed(solid, DVec3::ZERO, DQuat::IDENTITY)
    }

    fn placed(solid: &Solid, position: DVec3, rotation: DQuat) -> Result<Self, ShapeError> {
        solid.check()?;
        let in_world = |p: &DVec3| position + rotation * *p;
        let kind = match solid {
            Solid::Ball { radius_m } => Kind::Ball(*radius_m),
            Solid::Box { half_extents_m } => Kind::Box(*half_extents_m),
            Solid::Capsule { radius_m, half_height_m } => Kind::Capsule(*radius_m, *half_height_m),
            Solid::Cylinder { radius_m, half_height_m } => Kind::Cylinder(*radius_m, *half_height_m),
            Solid::Plane => Kind::Plane,
            Solid::Compound { .. } => {
                let why = "has a field of its own, and the compound has none".to_owned();
                return Err(ShapeError::BadPart { index: 0, why });
            }
            Solid::Hull { points_m } => {
                let mut hull = hull_triangles(points_m)?;
                hull.points.iter_mut().for_each(|p| *p = in_world(p));
                Kind::Mesh(MeshField::new(hull).into())
            }
            Solid::Mesh { points_m, triangles } => {
                let mut mesh = mesh_triangles(points_m, triangles)?;
                mesh.points.iter_mut().for_each(|p| *p = in_world(p));
                Kind::Mesh(MeshField::new(mesh).into())
            }
        };
        Ok(Self { kind, position, rotation })
    }

    /// The triangles of a mesh or hull, in the axes of the field; `None` for a primitive.
    pub fn mesh(&self) -> Option<&MeshField> {
        if let Kind::Mesh(mesh) = &self.kind { Some(mesh) } else { None }
    }

    /// Contact points of `point` within `reach_m` of the surface, nearest first.
    ///
    /// A convex primitive has one, at any depth. A mesh or hull has one for each wall of a corner, and is detected only to the depth
    /// `reach_m` behind its surface.
    pub fn touches(&self, point: DVec3, reach_m: f64) -> Touches {
        let mut found = Touches::default();
        if let Kind::Mesh(mesh) = &self.kind {
            let around_m = mesh.distance_from_bounds(point);
            if around_m <= reach_m {
                mesh.touches(point, reach_m, &mut found);
            }
            let nearest = found.iter().next();
            found.clear_m = nearest.map_or(reach_m.max(around_m), |t| t.distance_m);
        } else {
            let touch = self.nearest(point);
            found.clear_m = touch.distance_m;
            if touch.distance_m <= reach_m {
                found.push(touch);
            }
        }
        found
    }

    /// The nearest contact point of `point` within `reach_m`: the first of [`Self::touches`].
    pub fn touch(&self, point: DVec3, reach_m: f64) -> Option<Touch> {
        self.touch_by(point, reach_m, &mut None)
    }

    /// The same, after one of a point near by, and before others: `last` is the triangle of a mesh that was nearest last.
    pub fn touch_by(&self, point: DVec3, reach_m: f64, last: &mut Option<u32>) -> Option<Touch> {
        match &self.kind {
            Kind::Mesh(mesh) if mesh.distance_from_bounds(point) <= reach_m => mesh.touch(point, reach_m, last),
            Kind::Mesh(_) => None,
            _ => Some(self.nearest(point)).filter(|touch| touch.distance_m <= reach_m),
        }
    }

    /// Whether the surface may be in a box, or the box is inside it; of a mesh that, only where a point counts as inside to the depth `deep_m`.
    pub fn is_in(&self, around: Aabb, deep_m: f64) -> bool {
        let (middle, half) = ((around.low + around.high) * 0.5, (around.high - around.low) * 0.5);
        match &self.kind {
            Kind::Mesh(mesh) => mesh.is_in(around) || self.inside(middle, deep_m).is_some(),
            _ => {
                // a convex solid is in front of its tangent plane
                let touch = self.nearest(middle);
                touch.distance_m <= touch.normal.abs().dot(half)
            }
        }
    }

    /// The contact point of a point that is inside by at most `deep_m`.
    pub fn inside(&self, point: DVec3, deep_m: f64) -> Option<Touch> {
        let is_apart = |mesh: &MeshField| mesh.distance_from_bounds(point) > 0.0;
        if self.mesh().is_some_and(is_apart) {
            return None;
        }
        self.touch(point, deep_m).filter(|touch| touch.distance_m < 0.0)
    }

    /// Whether the inside of a span can come nearer than both of its ends: never with an infinite plane.
    pub fn needs_span_tests(&self) -> bool {
        !matches!(self.kind, Kind::Plane)
    }

    /// The contact point where the inside of a span comes nearer than its ends, and its fraction of the span; `None` where the contact
    /// points of the ends suffice, or the span stays farther than `reach_m` beyond its own radius.
    pub fn touches_span(&self, ends: [Ball; 2], reach_m: f64) -> Option<(f64, Touch)> {
        self.lowest_of_span(ends, reach_m).filter(|(share, _)| (SPAN_END_SHARE..=1.0 - SPAN_END_SHARE).contains(share))
    }

    /// The same, however close to an end of the span.
    pub fn lowest_of_span(&self, ends: [Ball; 2], reach_m: f64) -> Option<(f64, Touch)> {
        match &self.kind {
            Kind::Mesh(mesh) => mesh.touches_span(ends, reach_m),
            _ => self.lowest(ends, reach_m).map(|lowest| (lowest.share, lowest.touch)),
        }
    }

    /// Half the lengths of a box, metres; `None` for other solids.
    pub fn half_extents_m(&self) -> Option<DVec3> {
        if let Kind::Box(half) = self.kind { Some(half) } else { None }
    }

    /// The corners at which a flat face with the normal `way` towards the solid may be nearest: all of a box; of each rim of a cylinder the
    /// nearest point and three at right angles. `None` for solids without corners and meshes.
    pub fn corners(&self, way: DVec3) -> Option<[DVec3; 8]> {
        let sign = |i: usize, bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        match &self.kind {
            Kind::Box(half) => Some(std::array::from_fn(|i| *half * DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2)))),
            Kind::Cylinder(radius_m, half_m) => {
                let across = way.truncate();
                let near = if across.length() > UPRIGHT { -across.normalize() } else { glam::DVec2::X } * *radius_m;
                let quarters = [near, near.perp(), -near, -near.perp()];
                Some(std::array::from_fn(|i| quarters[i & 3].extend(*half_m * sign(i, 2))))
            }
            _ => None,
        }
    }

    /// A lower bound of the gap to a whole span, with the normal of the nearest surface point; `None` beyond `reach_m`.
    ///
    /// Exact to a millionth of the span's length for a convex primitive. For a mesh the whole span has its greatest radius, and where it
    /// overlaps the bound is up to half a span deeper than necessary.
    pub fn gap_of_span(&self, ends: [Ball; 2], reach_m: f64) -> Option<Touch> {
        let at_end = |ball: Ball| {
            let near = self.touch(ball.centre, ball.radius_m + reach_m)?;
            Some(Touch { distance_m: near.distance_m - ball.radius_m, ..near })
        };
        let inside = if let Kind::Mesh(mesh) = &self.kind {
            let radius_m = ends[0].radius_m.max(ends[1].radius_m);
            let near = mesh.nearest_to_span(ends.map(|e| e.centre), reach_m + radius_m);
            near.map(|near| Touch { distance_m: near.distance_m - radius_m, ..near })
        } else {
            self.lowest(ends, reach_m).map(|lowest| Touch { distance_m: lowest.floor_m, ..lowest.touch })
        };
        let length_m = ends[0].centre.distance(ends[1].centre);
        let near = [at_end(ends[0]), at_end(ends[1]), inside].into_iter().flatten();
        let least = near.min_by(|a, b| a.distance_m.total_cmp(&b.distance_m))?;
        // inside a mesh a point between the ends may be deeper than both
        let narrow_m = ends[0].radius_m.min(ends[1].radius_m);
        let is_deep = matches!(self.kind, Kind::Mesh(_)) && least.distance_m <= -narrow_m;
        let slack_m = if is_deep { 0.5 * length_m } else { LOWEST_SHARE * length_m };
        Some(Touch { distance_m: least.distance_m - slack_m, ..least })
    }

    /// The lowest point of the convex function gap(s) inside a span, at the intersection of tangents (eq. 3).
    fn lowest(&self, ends: [Ball; 2], reach_m: f64) -> Option<Lowest> {
        let along = ends[1].centre - ends[0].centre;
        let at = |s: f64| {
            let ball = ends[0].toward(ends[1], s);
            let touch = self.nearest(ball.centre);
            let slope = touch.normal.dot(along) - (ends[1].radius_m - ends[0].radius_m);
            (s, touch.distance_m - ball.radius_m, slope, touch)
        };
        let (mut left, mut right) = (at(0.0), at(1.0));
        let tolerance = LOWEST_SHARE * along.length();
        let mut best = None;
        for _ in 0..SPAN_TRIES {
            if left.2 >= -tolerance || right.2 <= tolerance {
                break;
            }
            let meet = (left.1 - right.1 + right.2 * right.0 - left.2 * left.0) / (right.2 - left.2);
            let floor = left.1 + left.2 * (meet - left.0);
            if floor > reach_m {
                return None;
            }
            let middle = at(meet.clamp(left.0, right.0));
            // where the slope is zero the tangents of the ends give no better bound
            let floor = if middle.2.abs() <= tolerance { middle.1 } else { floor };
            let here = Lowest { share: middle.0, touch: middle.3, floor_m: floor };
            best = Some(here).filter(|_| middle.1 <= reach_m);
            if middle.1 - floor < tolerance {
                break;
            }
            if middle.2 < 0.0 { left = middle } else { right = middle }
        }
        best
    }

    /// The nearest surface point of a convex primitive, from outside or inside (eq. 1).
    fn nearest(&self, point: DVec3) -> Touch {
        let local = self.rotation.conjugate() * (point - self.position);
        let (distance_m, normal) = match self.kind {
            Kind::Ball(radius) => from_point(local, radius),
            Kind::Box(half) => from_box(local, half),
            Kind::Capsule(radius, half) => from_point(local - DVec3::Z * local.z.clamp(-half, half), radius),
            Kind::Cylinder(radius, half) => from_cylinder(local, radius, half),
            Kind::Plane | Kind::Mesh(_) => (local.z, DVec3::Z),
        };
        Touch { normal: self.rotation * normal, distance_m }
    }
}

fn from_point(p: DVec3, radius: f64) -> (f64, DVec3) {
    let length = p.length();
    let normal = if length > 0.0 { p / length } else { DVec3::Z };
    (length - radius, normal)
}

fn from_box(p: DVec3, half: DVec3) -> (f64, DVec3) {
    let beyond = p.abs() - half;
    let outside = beyond.max(DVec3::ZERO);
    let distance = outside.length();
    let sign = DVec3::ONE.copysign(p);
    if distance > 0.0 {
        return (distance, outside / distance * sign);
    }
    let depth = beyond.max_element();
    let axis = if beyond.z == depth {
        DVec3::Z
    } else if beyond.y == depth {
        DVec3::Y
    } else {
        DVec3::X
    };
    (depth, axis * sign)
}

fn from_cylinder(p: DVec3, radius: f64, half: f64) -> (f64, DVec3) {
    let around = DVec2::new(p.x, p.y);
    let out = around.length();
    let radial = if out > 0.0 { (around / out).extend(0.0) } else { DVec3::X };
    let axial = DVec3::Z.copysign(DVec3::splat(p.z)) * DVec3::Z;
    let (beyond_side, beyond_end) = (out - radius, p.z.abs() - half);
    if beyond_side > 0.0 && beyond_end > 0.0 {
        let distance = beyond_side.hypot(beyond_end);
        return (distance, (radial * beyond_side + axial * beyond_end) / distance);
    }
    if beyond_side >= beyond_end { (beyond_side, radial) } else { (beyond_end, axial) }
}
