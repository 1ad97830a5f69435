//! Contacts of strands with strands: tubes, capsules and balls, in double precision.
//!
//! In: two strands. Out: the places where their spans face each other. A grid finds candidate pairs of spans in linear time.
//! Never here: blocks. Theory: `docs/theory/contact.md`, eq. 4.

use crate::narrow_phase::primitives::{Strand, StrandPoint};
use crate::narrow_phase::touch_key::{TouchKey, TouchKind};
use crate::solids::capsule_chain::facing;
use crate::solids::signed_distance;
use crate::solids::signed_distance::Ball;
use crate::{Aabb, Grid, Touch, near_segments};
use glam::DVec3;

/// Up to this many spans of the shorter strand all pairs are tested: a capsule against a tube needs no grid.
const FEW: usize = 4;
/// Between tubes a crossing counts in addition to the feet of nodes if it is nearer by this share of the radii: parallel strands
/// are represented by their nodes, which stay where they are while a crossing jumps from end to end.
const CROSSING_SHARE: f64 = 1e-3;
/// The place of a crossing in keys, after those of nodes.
const CROSSING: u32 = 4;
/// Maximum number of rounds of the search for the nearest places of tapered spans: for nearly parallel spans each round brings them only
/// a little nearer.
const TAPER_ROUNDS: usize = 200;
/// The search ends where a round moves them by less than this share.
const TAPER_SHARE: f64 = 1e-9;
/// The search for a gap starts within this many times the radii, and widens by this factor each time.
const WIDENING: f64 = 4.0;

/// Storage for candidate pairs.
#[derive(Default)]
pub(crate) struct ChainScratch {
    grid: Grid,
    span_bounds: Vec<SpanBounds>,
    /// Span of the first strand in the upper half, of the second in the lower half.
    pairs: Vec<u64>,
    /// How many pairs the last search tested.
    #[cfg(test)]
    pub tried: usize,
}

/// A span as the grid stores it.
struct SpanBounds {
    middle: DVec3,
    /// Radius of the ball that encloses it.
    ball_m: f64,
    span: u32,
    second: bool,
}

impl ChainScratch {
    /// Every place within `reach_m`.
    pub fn touches(&mut self, a: &Strand<'_>, b: &Strand<'_>, reach_m: f64, into: &mut Vec<Touch>) {
        self.find(a, b, reach_m);
        for pair in &self.pairs {
            let spans = [(pair >> 32) as usize, *pair as u32 as usize];
            SpanPair { strands: [a, b], spans, reach_m }.visit(into);
        }
    }

    /// The nearest place: its normal from b towards a, and a lower bound of the gap.
    pub fn gap(&mut self, a: &Strand<'_>, b: &Strand<'_>, reach_m: f64) -> Option<(DVec3, f64)> {
        let mut look_m = (WIDENING * (a.widest_m + b.widest_m)).min(reach_m);
        loop {
            self.find(a, b, look_m);
            let bounds =
                self.pairs.iter().map(|pair| bound(a.ends((pair >> 32) as usize), b.ends(*pair as u32 as usize)));
            let least = bounds.min_by(|p, q| p.distance_m.total_cmp(&q.distance_m));
            let least = least.filter(|least| least.distance_m <= look_m);
            if least.is_some() || look_m >= reach_m || look_m.is_nan() {
                return least.map(|least| (least.normal, least.distance_m));
            }
            look_m = (WIDENING * look_m).min(reach_m);
        }
    }

    /// Lists the pairs of spans whose balls come within `reach_m` of each other, by rising numbers.
    fn find(&mut self, a: &Strand<'_>, b: &Strand<'_>, reach_m: f64) {
        let Self { grid, span_bounds, pairs, .. } = self;
        pairs.clear();
        span_bounds.clear();
        // of long strands that cross few spans are near the other, and fewer near these
        span_bounds.extend(span_bounds_of(a, false).filter(|spot| spot.is_near(b.bounds, b.widest_m + reach_m)));
        let near = region(span_bounds.iter());
        span_bounds.extend(span_bounds_of(b, true).filter(|spot| spot.is_near(near, reach_m)));
        let near = region(span_bounds.iter().filter(|spot| spot.second));
        span_bounds.retain(|spot| spot.second || spot.is_near(near, reach_m));
        let first = span_bounds.partition_point(|spot| !spot.second);
        let mut tried = 0;
        let mut try_pair = |i: usize, j: usize| {
            tried += 1;
            let (p, q) = (&span_bounds[i.min(j)], &span_bounds[i.max(j)]);
            let within = p.ball_m + q.ball_m + reach_m;
            if p.second != q.second && p.middle.distance_squared(q.middle) <= within * within {
                pairs.push(u64::from(p.span) << 32 | u64::from(q.span));
            }
        };
        if first.min(span_bounds.len() - first) <= FEW {
            (0..first).for_each(|i| (first..span_bounds.len()).for_each(|j| try_pair(i, j)));
        } else {
            let widest = span_bounds.iter().map(|spot| spot.ball_m).fold(0.0, f64::max);
            grid.fill(span_bounds.iter().map(|spot| spot.middle), 2.0 * widest + reach_m);
            grid.near_pairs(|i, j| try_pair(i as usize, j as usize));
        }
        pairs.sort_unstable();
        #[cfg(test)]
        {
            self.tried = tried;
        }
    }
}

/// The spans of a strand.
fn span_bounds_of(strand: &Strand<'_>, second: bool) -> impl Iterator<Item = SpanBounds> {
    (0..strand.spans()).map(move |span| {
        let [a, b] = strand.ends(span);
        let ball_m = 0.5 * a.centre.distance(b.centre) + a.radius_m.max(b.radius_m);
        SpanBounds { middle: (a.centre + b.centre) * 0.5, ball_m, span: span as u32, second }
    })
}

/// The box around the balls of some spans; of none it is near nothing.
fn region<'a>(spans: impl Iterator<Item = &'a SpanBounds>) -> Aabb {
    let none = Aabb { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
    spans.map(|spot| Aabb::about(spot.middle, spot.ball_m)).fold(none, Aabb::union)
}

impl SpanBounds {
    /// Whether the ball comes within `reach_m` of a box.
    fn is_near(&self, Aabb { low, high }: Aabb, reach_m: f64) -> bool {
        let apart = (low - self.middle).max(self.middle - high).max(DVec3::ZERO).length();
        apart <= self.ball_m + reach_m
    }
}

/// Two spans that are near each other.
struct SpanPair<'a> {
    strands: [&'a Strand<'a>; 2],
    spans: [usize; 2],
    reach_m: f64,
}

/// The places of one pair of spans, so that none is added twice: the first and last node of either, and a crossing.
#[derive(Default)]
struct ReportedContact {
    shares: [[f64; 2]; 5],
    count: usize,
    least_m: f64,
}

impl SpanPair<'_> {
    /// Adds the places of the pair (eq. 4): nodes over the other's span, and the crossing where it is nearer.
    fn visit(&self, into: &mut Vec<Touch>) {
        let ([a, b], [i, j]) = (self.strands, self.spans);
        let (ends_a, ends_b) = (a.ends(i), b.ends(j));
        let (s, t) = near_segments(ends_a.map(|e| e.centre), ends_b.map(|e| e.centre));
        let taper = |ends: [Ball; 2]| (ends[0].radius_m - ends[1].radius_m).abs();
        let (nearest, _) = facing(ends_a, ends_b, [s, t]);
        if nearest.distance_m > self.reach_m + taper(ends_a) + taper(ends_b) {
            return;
        }
        let mut reported = ReportedContact { least_m: f64::INFINITY, ..ReportedContact::default() };
        for (place, node) in own_nodes(a, i) {
            if let Some(t) =
                b.foot(a.ball(node).centre, j).filter(|&t| is_own_place(a, node, b, StrandPoint { span: j, share: t }))
            {
                self.report(place, [(node - i) as f64, t], &mut reported, into);
            }
        }
        for (place, node) in own_nodes(b, j) {
            if let Some(s) =
                a.foot(b.ball(node).centre, i).filter(|&s| is_own_place(b, node, a, StrandPoint { span: i, share: s }))
            {
                self.report(place + 1, [s, (node - j) as f64], &mut reported, into);
            }
        }
        let inside = [s, t].iter().all(|&share| share > 0.0 && share < 1.0);
        let rigid = a.spans().min(b.spans()) == 1;
        let margin_m = if rigid { 0.0 } else { CROSSING_SHARE * (a.widest_m + b.widest_m) };
        if inside && nearest.distance_m < reported.least_m - margin_m {
            self.report(CROSSING, [s, t], &mut reported, into);
        }
    }

    /// Adds a place, unless it is too far or already added.
    fn report(&self, place: u32, shares: [f64; 2], reported: &mut ReportedContact, into: &mut Vec<Touch>) {
        let ([a, b], [i, j], [s, t]) = (self.strands, self.spans, shares);
        if reported.shares[..reported.count].contains(&shares) {
            return;
        }
        reported.shares[reported.count] = shares;
        reported.count += 1;
        let (ends_a, ends_b) = (a.ends(i), b.ends(j));
        let (touch, _) = facing(ends_a, ends_b, shares);
        reported.least_m = reported.least_m.min(touch.distance_m);
        if touch.distance_m <= self.reach_m {
            into.push(Touch {
                key: TouchKey { place, ..TouchKey::new(TouchKind::Spans, [i as u32, j as u32]) },
                normal: touch.normal,
                gap_m: touch.distance_m,
                on_a: a.place(i, s, ends_a[0].toward(ends_a[1], s), touch.normal),
                on_b: b.place(j, t, ends_b[0].toward(ends_b[1], t), -touch.normal),
            });
        }
    }
}

/// The nodes that a span reports: its first, and for the last span also the strand's last, with the even one of their two place numbers.
fn own_nodes(strand: &Strand<'_>, span: usize) -> impl Iterator<Item = (u32, usize)> {
    let is_last = strand.count() > 1 && span + 1 == strand.spans();
    [(0, span), (2, span + 1)].into_iter().take(1 + usize::from(is_last))
}

/// Whether a node over a span is a place of its own: past an end of the other strand that end is the place, if its own foot
/// is at this node.
fn is_own_place(strand: &Strand<'_>, node: usize, other: &Strand<'_>, at: StrandPoint) -> bool {
    let end = match at.share {
        0.0 if at.span == 0 => 0,
        1.0 => other.count() - 1,
        _ => return true,
    };
    let (here, point) = (strand.ball(node).centre, other.ball(end).centre);
    let beside = [node.checked_sub(1), Some(node + 1).filter(|&next| next < strand.count())];
    beside.into_iter().flatten().all(|next| (point - here).dot(strand.ball(next).centre - here) <= 0.0)
}

/// A lower bound of the gap between two tapered spans: the gap is a convex function of both shares, so it is nowhere below
/// its tangent plane at the nearest places.
fn bound(a: [Ball; 2], b: [Ball; 2]) -> signed_distance::Touch {
    let (mut s, mut t) = near_segments(a.map(|e| e.centre), b.map(|e| e.centre));
    if a[0].radius_m != a[1].radius_m || b[0].radius_m != b[1].radius_m {
        for _ in 0..TAPER_ROUNDS {
            let before = (s, t);
            s = nearest_share(b[0].toward(b[1], t).centre, a);
            t = nearest_share(a[0].toward(a[1], s).centre, b);
            if (s - before.0).abs().max((t - before.1).abs()) < TAPER_SHARE {
                break;
            }
        }
    }
    let (near, _) = facing(a, b, [s, t]);
    let slope = |ends: [Ball; 2], normal: DVec3| {
        normal.dot(ends[1].centre - ends[0].centre) - (ends[1].radius_m - ends[0].radius_m)
    };
    let fall = |slope: f64, share: f64| (-slope * share).min(slope * (1.0 - share));
    let fall_m = fall(slope(a, near.normal), s) + fall(slope(b, -near.normal), t);
    signed_distance::Touch { distance_m: near.distance_m + fall_m, ..near }
}

/// The share of a span at which its surface is nearest to a point: the foot, moved towards the wider end.
fn nearest_share(point: DVec3, ends: [Ball; 2]) -> f64 {
    let way = ends[1].centre - ends[0].centre;
    let length = way.length();
    let widening = (ends[1].radius_m - ends[0].radius_m) / length;
    if length == 0.0 || widening.abs() >= 1.0 {
        return if ends[1].radius_m > ends[0].radius_m { 1.0 } else { 0.0 };
    }
    let along = (point - ends[0].centre).dot(way) / length;
    let across = (point - ends[0].centre - way * (along / length)).length();
    ((along + across * widening / (1.0 - widening * widening).sqrt()) / length).clamp(0.0, 1.0)
}
