//! Distance between two convex parts and its normal, in double precision (GJK, then EPA where they overlap).
//!
//! In: two placed parts. Out: the normal, the gap and the facing points. Never here: manifolds, lists of parts.
//! Theory: (ERI05, ch. 9). Where they overlap, [`crate::narrow_phase::blocks::epa`] takes over.

use super::epa::Hull;
use glam::{DQuat, DVec3};
use rapier3d::parry::shape::Shape;

/// A convex part of a block.
#[derive(Clone, Copy)]
pub(crate) struct Part<'a> {
    /// Its number in the block.
    pub number: u32,
    /// Its parry shape.
    pub shape: &'a dyn Shape,
    /// Where its axes' origin is.
    pub origin: DVec3,
    /// From its axes to the world's.
    pub rotation: DQuat,
}

/// Separation of two parts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Separation {
    /// Unit normal, from the second to the first.
    pub normal: DVec3,
    /// The widest slab between them, or the shortest way out where they overlap, metres: never more than the true gap.
    pub gap_m: f64,
    /// The facing points, metres from the first part's origin.
    pub on: [DVec3; 2],
}

/// A corner of the difference of two parts, and the points it comes from, metres from the first part's origin.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Corner {
    /// The point of the first less that of the second.
    pub way: DVec3,
    /// Both points.
    pub on: [DVec3; 2],
}

/// Maximum rounds of the search; boxes take six, round shapes more.
const ROUNDS: usize = 64;
/// The gap is found when it is this share above its lower bound.
const GAP_SHARE: f64 = 1e-10;
/// Rounding of sums of coordinates, as a share of them.
const ROUNDING: f64 = 1e-15;
/// Closer than this share of the sizes, parts count as overlapping: the vector between them has no direction any more.
const TOUCHING_SHARE: f64 = 1e-12;

/// Beyond the reach a search goes on until its bound of the distance is this share of it: a pair known to be far is not searched for long.
const FAR_SHARE: f64 = 0.7;

/// The result of a search.
pub(crate) enum Found {
    Apart(Separation),
    /// They are farther than the reach, by at least so much apart, metres; or not finite, and at least 0 m apart.
    Far(f64),
    Overlap,
}

/// How two parts lie to each other where the distance beyond a reach counts too.
pub(crate) enum Parting {
    Within(Separation),
    /// At least so far apart, metres.
    Beyond(f64),
}

/// The difference of two parts: it holds the origin where they overlap.
pub(crate) struct Difference<'a> {
    parts: [&'a dyn Convex; 2],
}

/// A convex shape.
pub(crate) trait Convex {
    /// A point near it, metres.
    fn origin(&self) -> DVec3;

    /// The point farthest along `way`, metres from `from`.
    fn support(&self, way: DVec3, from: DVec3) -> DVec3;
}

/// The hull of three balls: a triangle, a span or a ball.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rounded {
    /// Their centres, metres.
    pub corners: [DVec3; 3],
    /// Their radii, metres, ≥ 0.
    pub radii_m: [f64; 3],
}

impl Convex for Rounded {
    fn origin(&self) -> DVec3 {
        self.corners[0]
    }

    fn support(&self, way: DVec3, from: DVec3) -> DVec3 {
        let Self { corners, radii_m } = self;
        let way = if radii_m.iter().all(|radius_m| *radius_m == 0.0) { way } else { way.normalize_or_zero() };
        let far = |i: usize| (corners[i] - from).dot(way) + radii_m[i];
        let best = [1, 2].into_iter().fold(0, |best, next| if far(next) > far(best) { next } else { best });
        corners[best] - from + way * radii_m[best]
    }
}

impl Convex for Part<'_> {
    fn origin(&self) -> DVec3 {
        self.origin
    }

    fn support(&self, way: DVec3, from: DVec3) -> DVec3 {
        let way = self.rotation.conjugate() * way;
        let corner = if let Some(cuboid) = self.shape.as_cuboid() {
            cuboid.half_extents.as_dvec3().copysign(way)
        } else if let Some(round) = self.shape.as_cylinder() {
            let out = DVec3::new(way.x, 0.0, way.z).normalize_or_zero() * f64::from(round.radius);
            out.with_y(f64::from(round.half_height).copysign(way.y))
        } else if let Some(hull) = self.shape.as_convex_polyhedron() {
            let (mut farthest, mut farthest_m) = (DVec3::ZERO, f64::NEG_INFINITY);
            for corner in hull.points().iter().map(|p| p.as_dvec3()) {
                let along_m = corner.dot(way);
                if along_m > farthest_m {
                    (farthest, farthest_m) = (corner, along_m);
                }
            }
            farthest
        } else {
            self.shape.as_support_map().map_or(DVec3::ZERO, |map| map.local_support_point(way.as_vec3()).as_dvec3())
        };
        self.rotation * corner + (self.origin - from)
    }
}

impl<'a> Difference<'a> {
    /// The difference first − second.
    pub fn new(first: &'a dyn Convex, second: &'a dyn Convex) -> Self {
        Self { parts: [first, second] }
    }

    /// The corner farthest along `way`.
    pub fn support(&self, way: DVec3) -> Corner {
        let [a, b] = &self.parts;
        let on = [a.support(way, a.origin()), b.support(-way, a.origin())];
        Corner { way: on[0] - on[1], on }
    }

    /// Separation of the parts; `None` farther than `reach_m` apart.
    pub fn apart(&self, reach_m: f64, hull: &mut Hull) -> Option<Separation> {
        match self.search(reach_m) {
            Found::Apart(separation) => Some(separation),
            Found::Far(_) => None,
            Found::Overlap => hull.way_out(self),
        }
    }

    /// Separation of the parts; farther than `reach_m` apart a bound of how far, to about a third.
    pub fn parting(&self, reach_m: f64, hull: &mut Hull) -> Parting {
        match self.seek(reach_m, Some(FAR_SHARE)) {
            Found::Apart(separation) => Parting::Within(separation),
            Found::Far(least_m) => Parting::Beyond(least_m),
            Found::Overlap => hull.way_out(self).map_or(Parting::Beyond(0.0), Parting::Within),
        }
    }

    /// The same; `None` where they overlap, too.
    pub fn parted(&self, reach_m: f64) -> Option<Separation> {
        if let Found::Apart(separation) = self.search(reach_m) { Some(separation) } else { None }
    }

    /// The same, also whether the two overlap or are beyond the reach.
    pub fn search(&self, reach_m: f64) -> Found {
        self.seek(reach_m, None)
    }

    /// The same; beyond the reach it ends with a bound that is this share of the distance.
    fn seek(&self, reach_m: f64, far_share: Option<f64>) -> Found {
        let start = self.parts[0].origin() - self.parts[1].origin();
        let mut simplex = Simplex::of(self.support(-start.normalize_or(DVec3::X)));
        let mut best: Option<Separation> = None;
        for _ in 0..ROUNDS {
            let near = simplex.nearest();
            let distance = near.way.length();
            if simplex.holds_origin || distance <= TOUCHING_SHARE * simplex.size() {
                return Found::Overlap;
            }
            let normal = near.way / distance;
            let corner = self.support(-normal);
            let floor_m = corner.way.dot(normal);
            if floor_m > reach_m && far_share.is_none_or(|share| floor_m >= share * distance) {
                return Found::Far(floor_m);
            }
            if best.is_none_or(|best| floor_m > best.gap_m) {
                best = Some(Separation { normal, gap_m: floor_m, on: near.on });
            }
            let rounding = ROUNDING * simplex.size();
            if distance - floor_m <= GAP_SHARE * distance + rounding || !simplex.add(corner) {
                break;
            }
        }
        match best.filter(|best| best.gap_m.is_finite()) {
            Some(best) if best.gap_m <= reach_m => Found::Apart(best),
            far => Found::Far(far.map_or(0.0, |far| far.gap_m)),
        }
    }
}

/// Up to four corners and the shares with which they make the point nearest to the origin.
#[derive(Debug, Clone, Copy, Default)]
struct Simplex {
    corners: [Corner; 4],
    shares: [f64; 4],
    count: usize,
    holds_origin: bool,
}

impl Simplex {
    fn of(corner: Corner) -> Self {
        let mut simplex = Self { count: 1, ..Self::default() };
        simplex.corners[0] = corner;
        simplex.shares[0] = 1.0;
        simplex
    }

    /// How far its corners are from the origin and the first part's, metres.
    fn size(&self) -> f64 {
        self.corners[..self.count].iter().map(|c| c.way.length() + c.on[0].length()).fold(0.0, f64::max)
    }

    /// Adds a corner and drops the corners that the nearest point does not need; false for a corner that was there
    /// before.
    fn add(&mut self, corner: Corner) -> bool {
        if self.corners[..self.count].iter().any(|known| known.way == corner.way) {
            return false;
        }
        self.corners[self.count] = corner;
        self.count += 1;
        let ways = self.corners.map(|c| c.way);
        (self.shares, self.holds_origin) = match self.count {
            2 => (on_edge(ways, [0, 1]), false),
            3 => (on_face(ways, [0, 1, 2]), false),
            _ => inside(ways),
        };
        let mut kept = 0;
        for i in 0..self.count {
            if self.shares[i] > 0.0 {
                (self.corners[kept], self.shares[kept]) = (self.corners[i], self.shares[i]);
                kept += 1;
            }
        }
        self.count = kept;
        true
    }

    /// The point nearest to the origin.
    fn nearest(&self) -> Corner {
        let parts = self.corners.iter().zip(self.shares).take(self.count);
        parts.fold(Corner::default(), |sum, (corner, share)| Corner {
            way: sum.way + corner.way * share,
            on: [sum.on[0] + corner.on[0] * share, sum.on[1] + corner.on[1] * share],
        })
    }
}

fn point(ways: [DVec3; 4], shares: [f64; 4]) -> DVec3 {
    ways.iter().zip(shares).map(|(way, share)| *way * share).sum()
}

/// The shares of the place on an edge that is nearest to the origin.
fn on_edge(ways: [DVec3; 4], [i, j]: [usize; 2]) -> [f64; 4] {
    let along = ways[j] - ways[i];
    let length2 = along.length_squared();
    let share = if length2 > 0.0 { (-ways[i].dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
    let mut shares = [0.0; 4];
    shares[i] = 1.0 - share;
    shares[j] = share;
    shares
}

/// The shares of the place on a face that is nearest to the origin: over its inside, or on an edge.
fn on_face(ways: [DVec3; 4], [i, j, k]: [usize; 3]) -> [f64; 4] {
    let (a, b, c) = (ways[i], ways[j], ways[k]);
    let normal = (b - a).cross(c - a);
    let areas = [b.cross(c).dot(normal), c.cross(a).dot(normal), a.cross(b).dot(normal)];
    let whole: f64 = areas.iter().sum();
    if whole > 0.0 && areas.iter().all(|&area| area > 0.0) {
        let mut shares = [0.0; 4];
        for (corner, area) in [i, j, k].into_iter().zip(areas) {
            shares[corner] = area / whole;
        }
        return shares;
    }
    nearest_of([[i, j], [j, k], [k, i]].map(|edge| on_edge(ways, edge)), ways)
}

/// The same for a tetrahedron, and whether it contains the origin.
fn inside(ways: [DVec3; 4]) -> ([f64; 4], bool) {
    let faces = [[1, 2, 3, 0], [0, 2, 3, 1], [0, 1, 3, 2], [0, 1, 2, 3]];
    // the origin is on the same side of each face as the opposite corner
    let holds = faces.iter().all(|&[i, j, k, against]| {
        let normal = (ways[j] - ways[i]).cross(ways[k] - ways[i]);
        -ways[i].dot(normal) * (ways[against] - ways[i]).dot(normal) > 0.0
    });
    (nearest_of(faces.map(|[i, j, k, _]| on_face(ways, [i, j, k])), ways), holds)
}

fn nearest_of<const N: usize>(all: [[f64; 4]; N], ways: [DVec3; 4]) -> [f64; 4] {
    let distance2 = |shares: &[f64; 4]| point(ways, *shares).length_squared();
    all.into_iter().min_by(|p, q| distance2(p).total_cmp(&distance2(q))).unwrap_or([1.0, 0.0, 0.0, 0.0])
}
