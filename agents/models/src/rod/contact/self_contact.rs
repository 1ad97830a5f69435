//! Broad phase of self-contact: capsules in a uniform hash grid, and a pair list that stays valid for several steps.
//!
//! In: the skin of a tube and its motion. Out: near pairs of segments and where they are nearest.
//! Never here: forces. Theory: `docs/theory/contact.md`, eq. 15–18.

use super::Skin;
use glam::DVec3;
use metachron_geometry::capsule_chain::{facing, foot};
use metachron_geometry::{Grid, near_segments};
use std::f64::consts::PI;

/// How far beyond contact a pair is listed: this share of the radius and this many margins (eq. 17).
/// Wider lists last longer, but the cost of building and reading them grows with the square of the reach in a packed tube.
const LIST_RADII: f64 = 0.3;
/// See [`LIST_RADII`].
const LIST_MARGINS: f64 = 2.0;

/// A segment as stored in the grid.
#[derive(Debug, Clone, Copy)]
struct Capsule {
    middle: DVec3,
    /// Radius of its bounding ball.
    ball_m: f64,
    /// Rest arc length of its middle, and half the arc length within which no pairs are formed (eq. 15).
    arc_m: f64,
    neighbourhood_m: f64,
}

/// Two segments and the last gap measured between them.
#[derive(Debug, Clone, Copy)]
struct Pair {
    first: u32,
    second: u32,
    gap_m: f64,
    /// The sum of both segments' [`Motion::travel_m`] when the gap was measured.
    measured_at_m: f64,
}

/// Motion of a segment relative to the mean of all nodes.
#[derive(Debug, Clone, Copy, Default)]
struct Motion {
    /// Distance travelled by its faster end since the list was built, plus any widening, metres; non-decreasing.
    travel_m: f64,
    /// Distance that its faster end travels within the step, metres.
    ahead_m: f64,
}

/// A place where two segments face each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FacingPoints {
    /// The segments; the first has the lower number.
    pub segments: [u32; 2],
    /// Index among the places of this pair, below [`PLACES`]; identifies the contact together with the segments.
    pub place: u32,
    /// The facing points, as shares of the segments.
    pub shares: [f64; 2],
    /// Unit vector from the second segment to the first.
    pub normal: DVec3,
    /// Distance of the surfaces, metres; negative where they overlap.
    pub gap_m: f64,
    /// Radii at the facing points, metres.
    pub radii_m: [f64; 2],
}

/// Number of places of a pair: the first node of either segment, the last node of the tube, a crossing.
pub(super) const PLACES: u32 = 4;
/// Segments cross if the sine of their angle is above this. Below it their nodes are accurate enough: at 0.2 the axes of a crossing
/// are (0.1 l)²/2d nearer than the nodes, 40 µm for l = 15 mm and d = 30 mm.
const CROSSING_SINE: f64 = 0.2;

/// The near pairs of a tube, reused while they are valid.
#[derive(Debug, Clone, Default)]
pub(super) struct Pairs {
    grid: Grid,
    capsules: Vec<Capsule>,
    keys: Vec<u64>,
    list: Vec<Pair>,
    motions: Vec<Motion>,
    /// How far beyond contact the list reaches.
    reach_m: f64,
    last: Vec<DVec3>,
    last_radius_m: f64,
}

impl Pairs {
    /// Discards the list: the tube was divided anew.
    pub fn forget(&mut self) {
        self.last.clear();
    }

    /// Visits every pair whose surfaces may come within `slack_m` of each other during the step, in order of segment numbers (eq. 17).
    pub fn visit(&mut self, skin: &Skin<'_>, slack_m: f64, mut visit: impl FnMut(FacingPoints)) {
        self.follow(skin);
        let most = |of: fn(&Motion) -> f64| self.motions.iter().map(of).fold(0.0, f64::max);
        if slack_m + 2.0 * most(|m| m.travel_m + m.ahead_m) > self.reach_m {
            let margin_m = slack_m + 2.0 * most(|m| m.ahead_m);
            self.rebuild(skin, LIST_RADII * skin.widest_m() + LIST_MARGINS * margin_m);
        }
        for pair in &mut self.list {
            let [a, b] = [pair.first, pair.second].map(|k| self.motions[k as usize]);
            let margin_m = slack_m + a.ahead_m + b.ahead_m;
            let travel_m = a.travel_m + b.travel_m;
            if pair.gap_m - (travel_m - pair.measured_at_m) > margin_m {
                continue;
            }
            let nearest = nearest(skin, [pair.first, pair.second]);
            (pair.gap_m, pair.measured_at_m) = (nearest.gap_m, travel_m);
            if nearest.gap_m <= margin_m {
                visit_places(skin, nearest, margin_m, &mut visit);
            }
        }
    }

    /// Accumulates the segments' motion relative to the mean, and the tube's widening.
    fn follow(&mut self, skin: &Skin<'_>) {
        let nodes = skin.positions;
        let (widest, count) = (skin.widest_m(), nodes.len() as f64);
        self.motions.resize(skin.segments(), Motion::default());
        let known = self.last.len() == nodes.len();
        if !known {
            self.reach_m = f64::NEG_INFINITY;
            self.last.clear();
            self.last.extend_from_slice(nodes);
        }
        let mean_way = nodes.iter().zip(&self.last).map(|(now, last)| *now - *last).sum::<DVec3>() / count;
        let mean_speed = (0..nodes.len()).map(|i| skin.velocity(i)).sum::<DVec3>() / count;
        let node = |i: usize| {
            let way = nodes[i] - self.last[i] - mean_way;
            (way.length_squared(), (skin.velocity(i) - mean_speed).length_squared())
        };
        let widened = if known { (widest - self.last_radius_m).max(0.0) } else { 0.0 };
        let mut left = node(0);
        for (k, motion) in self.motions.iter_mut().enumerate() {
            let right = node(k + 1);
            motion.travel_m += left.0.max(right.0).sqrt() + widened;
            motion.ahead_m = left.1.max(right.1).sqrt() * skin.h_s;
            left = right;
        }
        self.last.copy_from_slice(nodes);
        self.last_radius_m = widest;
    }

    /// Lists the pairs within reach (eq. 16).
    fn rebuild(&mut self, skin: &Skin<'_>, reach_m: f64) {
        self.motions.iter_mut().for_each(|m| m.travel_m = 0.0);
        self.reach_m = reach_m;
        let Self { grid, capsules, keys, list, .. } = self;
        capsules.clear();
        capsules.extend((0..skin.segments()).map(|k| Capsule::new(skin, k)));
        let widest = capsules.iter().map(|c| c.ball_m).fold(0.0, f64::max);
        grid.fill(capsules.iter().map(|c| c.middle), 2.0 * widest + reach_m);
        keys.clear();
        grid.near_pairs(|i, j| {
            let (a, b) = (&capsules[i as usize], &capsules[j as usize]);
            let within = a.ball_m + b.ball_m + reach_m;
            if !a.is_neighbour(b) && a.middle.distance_squared(b.middle) < within * within {
                keys.push(u64::from(i.min(j)) << 32 | u64::from(i.max(j)));
            }
        });
        keys.sort_unstable();
        list.clear();
        list.extend(keys.iter().filter_map(|key| {
            let (first, second) = ((key >> 32) as u32, *key as u32);
            let gap_m = nearest(skin, [first, second]).gap_m;
            let apart = first.abs_diff(second) > 1;
            (apart && gap_m <= reach_m).then_some(Pair { first, second, gap_m, measured_at_m: 0.0 })
        }));
    }
}

impl Capsule {
    fn new(skin: &Skin<'_>, k: usize) -> Self {
        let rest = skin.arc_m[k + 1] - skin.arc_m[k];
        let radius = skin.widest(k);
        Self {
            middle: skin.middle(k),
            ball_m: 0.5 * skin.length(k) + radius,
            arc_m: 0.5 * (skin.arc_m[k] + skin.arc_m[k + 1]),
            neighbourhood_m: 0.5 * rest + 0.5 * PI * radius,
        }
    }

    /// Whether two segments are so close along the tube that they overlap by its own thickness (eq. 15): a tube bent to the
    /// radius of its own skin, its sharpest bend, meets itself after π r.
    fn is_neighbour(&self, other: &Self) -> bool {
        (self.arc_m - other.arc_m).abs() < self.neighbourhood_m + other.neighbourhood_m
    }
}

/// Whether two segments are excluded from contact, for tests.
#[cfg(test)]
pub(super) fn is_neighbour(skin: &Skin<'_>, i: usize, j: usize) -> bool {
    i.abs_diff(j) <= 1 || Capsule::new(skin, i).is_neighbour(&Capsule::new(skin, j))
}

/// Visits the places of a near pair whose gap is within the margin (eq. 18).
///
/// The nearest points alone are not enough: between parallel strands they jump from end to end at the slightest tilt,
/// and the tube rocks for ever. Nodes and their projections stay in place.
pub(super) fn visit_places(
    skin: &Skin<'_>,
    nearest: FacingPoints,
    margin_m: f64,
    visit: &mut impl FnMut(FacingPoints),
) {
    let [first, second] = nearest.segments;
    let [i, j] = [first as usize, second as usize];
    let mut try_at = |place: u32, shares: [f64; 2]| {
        let facing = at(skin, [first, second], place, shares);
        if facing.gap_m <= margin_m {
            visit(facing);
        }
    };
    if let Some(t) = foot(skin.positions[i], skin.positions, j) {
        try_at(0, [0.0, t]);
    }
    if let Some(s) = foot(skin.positions[j], skin.positions, i) {
        try_at(1, [s, 0.0]);
    }
    if j + 1 == skin.segments()
        && let Some(s) = foot(skin.positions[j + 1], skin.positions, i)
    {
        try_at(2, [s, 1.0]);
    }
    let inside = nearest.shares.iter().all(|s| (1e-3..=1.0 - 1e-3).contains(s));
    let [u, v] = [i, j].map(|k| skin.positions[k + 1] - skin.positions[k]);
    let sine2 = u.cross(v).length_squared() / (u.length_squared() * v.length_squared());
    if inside && sine2 > CROSSING_SINE * CROSSING_SINE {
        visit(nearest);
    }
}

/// Where two segments are nearest (eq. 18).
pub(super) fn nearest(skin: &Skin<'_>, segments: [u32; 2]) -> FacingPoints {
    let [a, b] = segments.map(|k| [skin.positions[k as usize], skin.positions[k as usize + 1]]);
    let (s, t) = near_segments(a, b);
    at(skin, segments, PLACES - 1, [s, t])
}

/// The meeting at two given points.
fn at(skin: &Skin<'_>, segments: [u32; 2], place: u32, shares: [f64; 2]) -> FacingPoints {
    let [a, b] = segments.map(|k| [skin.ball(k as usize), skin.ball(k as usize + 1)]);
    let (facing, radii_m) = facing(a, b, shares);
    FacingPoints { segments, place, shares, normal: facing.normal, gap_m: facing.distance_m, radii_m }
}
