//! Contacts of a tube with itself: pairs of its segments in a grid, and the places where two segments face each other.
//!
//! In: nodes, radii and the arc lengths of the nodes at rest. Out: near pairs of segments, facing points, contacts.
//! Never here: motion, lists that last. Theory: `docs/theory/contact.md`, eq. 4–6.

use crate::narrow_phase::touch_key::{TouchKey, TouchKind};
use crate::solids::capsule_chain::{facing, foot};
use crate::solids::signed_distance::Ball;
use crate::{Grid, Place, Touch, near_segments};
use glam::DVec3;
use std::f64::consts::PI;

/// A tube at its place, and how long it is at rest.
#[derive(Debug, Clone, Copy)]
pub struct RestedChain<'a> {
    /// Node positions, metres.
    pub positions: &'a [DVec3],
    /// Outer radius at each node, metres.
    pub radii_m: &'a [f64],
    /// Arc length of each node at rest, metres.
    pub arc_m: &'a [f64],
}

/// Two points at which two segments of a tube face each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacingPoints {
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
pub const PLACES: u32 = 4;
/// Segments cross if the sine of their angle is above this. Below it their nodes are accurate enough: at 0.2 the axes of a crossing
/// are (0.1 l)²/2d nearer than the nodes, 40 µm for l = 15 mm and d = 30 mm.
const CROSSING_SINE: f64 = 0.2;

/// Storage for the search of near segments.
#[derive(Debug, Clone, Default)]
pub struct SegmentPairs {
    grid: Grid,
    capsules: Vec<Capsule>,
    /// The first segment in the upper half, the second in the lower half.
    pairs: Vec<u64>,
}

/// A segment as stored in the grid.
#[derive(Debug, Clone, Copy)]
struct Capsule {
    middle: DVec3,
    /// Radius of its bounding ball.
    ball_m: f64,
    /// Rest arc length of its middle, and half the arc length within which no pairs are formed (eq. 5).
    arc_m: f64,
    neighbourhood_m: f64,
}

impl SegmentPairs {
    /// The pairs of segments whose surfaces may be within `reach_m` of each other, by rising numbers, the lower one first; none that are
    /// neighbours along the tube (eq. 5, 6).
    pub fn near(&mut self, chain: &RestedChain<'_>, reach_m: f64) -> impl Iterator<Item = [u32; 2]> {
        let Self { grid, capsules, pairs } = self;
        capsules.clear();
        capsules.extend((0..chain.segments()).map(|k| Capsule::new(chain, k)));
        let widest = capsules.iter().map(|c| c.ball_m).fold(0.0, f64::max);
        pairs.clear();
        let cell_m = 2.0 * widest + reach_m;
        if cell_m.is_finite() {
            grid.fill(capsules.iter().map(|c| c.middle), cell_m);
            grid.near_pairs(|i, j| {
                let (a, b) = (&capsules[i as usize], &capsules[j as usize]);
                let within = a.ball_m + b.ball_m + reach_m;
                if !a.is_neighbour(b) && a.middle.distance_squared(b.middle) < within * within {
                    pairs.push(u64::from(i.min(j)) << 32 | u64::from(i.max(j)));
                }
            });
        }
        pairs.sort_unstable();
        let pairs = pairs.iter().map(|pair| [(pair >> 32) as u32, *pair as u32]);
        pairs.filter(|[first, second]| first.abs_diff(*second) > 1)
    }

    /// Every place within `reach_m`, by rising keys.
    pub(crate) fn touches(&mut self, chain: &RestedChain<'_>, reach_m: f64, into: &mut Vec<Touch>) {
        for segments in self.near(chain, reach_m) {
            let nearest = chain.nearest(segments);
            if nearest.gap_m <= reach_m {
                chain.visit_places(nearest, reach_m, &mut |facing| into.push(facing.touch()));
            }
        }
    }
}

impl Capsule {
    fn new(chain: &RestedChain<'_>, k: usize) -> Self {
        let rest = chain.arc_m[k + 1] - chain.arc_m[k];
        let radius = chain.radii_m[k].max(chain.radii_m[k + 1]);
        Self {
            middle: (chain.positions[k] + chain.positions[k + 1]) * 0.5,
            ball_m: 0.5 * chain.positions[k].distance(chain.positions[k + 1]) + radius,
            arc_m: 0.5 * (chain.arc_m[k] + chain.arc_m[k + 1]),
            neighbourhood_m: 0.5 * rest + 0.5 * PI * radius,
        }
    }

    /// Whether two segments are so close along the tube that they overlap by its own thickness (eq. 5): a tube bent to the
    /// radius of its own skin, its sharpest bend, meets itself after π r.
    fn is_neighbour(&self, other: &Self) -> bool {
        (self.arc_m - other.arc_m).abs() < self.neighbourhood_m + other.neighbourhood_m
    }
}

impl RestedChain<'_> {
    /// Whether there is a segment, and a radius and an arc length for each node.
    pub(crate) fn is_whole(&self) -> bool {
        let nodes = self.positions.len();
        nodes > 1 && self.radii_m.len() == nodes && self.arc_m.len() == nodes
    }

    fn segments(&self) -> usize {
        self.positions.len() - 1
    }

    fn ball(&self, node: usize) -> Ball {
        Ball { centre: self.positions[node], radius_m: self.radii_m[node] }
    }

    /// Whether two segments are excluded from contact.
    #[must_use]
    pub fn is_neighbour(&self, [i, j]: [u32; 2]) -> bool {
        let capsule = |k: u32| Capsule::new(self, k as usize);
        i.abs_diff(j) <= 1 || capsule(i).is_neighbour(&capsule(j))
    }

    /// Visits the places of a near pair whose gap is at most `margin_m` (eq. 4).
    ///
    /// The nearest points alone are not enough: between parallel strands they jump from end to end at the slightest tilt,
    /// and the tube rocks for ever. Nodes and their projections stay in place.
    pub fn visit_places(&self, nearest: FacingPoints, margin_m: f64, visit: &mut impl FnMut(FacingPoints)) {
        let [first, second] = nearest.segments;
        let [i, j] = [first as usize, second as usize];
        let positions = self.positions;
        let mut try_at = |place: u32, shares: [f64; 2]| {
            let facing = self.at([first, second], place, shares);
            if facing.gap_m <= margin_m {
                visit(facing);
            }
        };
        if let Some(t) = foot(positions[i], positions, j) {
            try_at(0, [0.0, t]);
        }
        if let Some(s) = foot(positions[j], positions, i) {
            try_at(1, [s, 0.0]);
        }
        if j + 1 == self.segments()
            && let Some(s) = foot(positions[j + 1], positions, i)
        {
            try_at(2, [s, 1.0]);
        }
        let inside = nearest.shares.iter().all(|s| (1e-3..=1.0 - 1e-3).contains(s));
        let [u, v] = [i, j].map(|k| positions[k + 1] - positions[k]);
        let sine2 = u.cross(v).length_squared() / (u.length_squared() * v.length_squared());
        if inside && sine2 > CROSSING_SINE * CROSSING_SINE {
            visit(nearest);
        }
    }

    /// Where two segments are nearest (eq. 4).
    #[must_use]
    pub fn nearest(&self, segments: [u32; 2]) -> FacingPoints {
        let [a, b] = segments.map(|k| [self.positions[k as usize], self.positions[k as usize + 1]]);
        let (s, t) = near_segments(a, b);
        self.at(segments, PLACES - 1, [s, t])
    }

    /// The facing of two given points.
    fn at(&self, segments: [u32; 2], place: u32, shares: [f64; 2]) -> FacingPoints {
        let [a, b] = segments.map(|k| [self.ball(k as usize), self.ball(k as usize + 1)]);
        let (facing, radii_m) = facing(a, b, shares);
        FacingPoints { segments, place, shares, normal: facing.normal, gap_m: facing.distance_m, radii_m }
    }
}

impl FacingPoints {
    /// The same as a contact of the tube with itself: its first side is the segment of the lower number.
    fn touch(&self) -> Touch {
        let place = |side: usize| Place::Chain {
            segment: self.segments[side],
            share: self.shares[side],
            radius_m: self.radii_m[side],
        };
        Touch {
            key: TouchKey { place: self.place, ..TouchKey::new(TouchKind::Spans, self.segments) },
            normal: self.normal,
            gap_m: self.gap_m,
            on_a: place(0),
            on_b: place(1),
        }
    }
}
