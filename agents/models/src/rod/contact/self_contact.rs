//! The near pairs of segments of a tube: a list that stays valid for several steps.
//!
//! In: the skin of a tube and its motion. Out: near pairs of segments and where they face each other.
//! Never here: how a pair is found and measured ([`metachron_geometry::narrow_phase`]), forces. Theory: `docs/theory/contact.md`, eq. 16–18.

use super::Skin;
use glam::DVec3;
use metachron_geometry::narrow_phase::{FacingPoints, SegmentPairs};

/// How far beyond contact a pair is listed: this share of the radius and this many margins (eq. 17).
/// Wider lists last longer, but the cost of building and reading them grows with the square of the reach in a packed tube.
const LIST_RADII: f64 = 0.3;
/// See [`LIST_RADII`].
const LIST_MARGINS: f64 = 2.0;

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

/// The near pairs of a tube, reused while they are valid.
#[derive(Debug, Clone, Default)]
pub(super) struct Pairs {
    near: SegmentPairs,
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
            let nearest = skin.chain().nearest([pair.first, pair.second]);
            (pair.gap_m, pair.measured_at_m) = (nearest.gap_m, travel_m);
            if nearest.gap_m <= margin_m {
                skin.chain().visit_places(nearest, margin_m, &mut visit);
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
        let (chain, Self { near, list, .. }) = (skin.chain(), self);
        list.clear();
        list.extend(near.near(&chain, reach_m).filter_map(|[first, second]| {
            let gap_m = chain.nearest([first, second]).gap_m;
            (gap_m <= reach_m).then_some(Pair { first, second, gap_m, measured_at_m: 0.0 })
        }));
    }
}
