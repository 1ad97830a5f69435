//! Which segments of a tube come near each other: capsules in a uniform hash grid, and a list that lasts several steps.
//!
//! In: the skin of a tube and how it moves. Out: near pairs of segments and where they are nearest.
//! Never here: forces. Theory: `docs/theory/contact.md`, eq. 15–18.

use super::{Skin, grid::Grid};
use crate::shape::near_segments;
use glam::DVec3;
use std::f64::consts::PI;

/// How far past touching a pair is listed, as a share of the radius: wider lists last longer and cost more to read.
const LIST_RADII: f64 = 0.5;
/// For how many steps of the present motion a list should last.
const LIST_STEPS: f64 = 8.0;

/// Two segments and the last gap measured between them.
#[derive(Debug, Clone, Copy)]
struct Pair {
    first: u32,
    second: u32,
    gap_m: f64,
    /// [`Pairs::travel_m`] when the gap was measured.
    measured_at_m: f64,
}

/// Where two segments are nearest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Meeting {
    /// The segments; the first has the lower number.
    pub segments: [u32; 2],
    /// The nearest points, as shares of the segments.
    pub shares: [f64; 2],
    /// Unit vector from the second segment to the first.
    pub normal: DVec3,
    /// Distance of the surfaces, metres; negative where they overlap.
    pub gap_m: f64,
    /// Radii at the nearest points, metres.
    pub radii_m: [f64; 2],
}

/// The near pairs of a tube, kept while they hold.
#[derive(Debug, Clone, Default)]
pub(super) struct Pairs {
    grid: Grid,
    list: Vec<Pair>,
    keys: Vec<u64>,
    /// How far nodes have moved against each other's mean since the list was made; it only grows.
    travel_m: f64,
    /// The list holds up to this travel.
    list_lasts_m: f64,
    last: Vec<DVec3>,
    last_radius_m: f64,
}

impl Pairs {
    /// Forgets the list: the tube was divided anew.
    pub fn forget(&mut self) {
        self.last.clear();
    }

    /// Visits every pair whose surfaces may come within `slack_m` of each other during the step, by rising numbers (eq. 17).
    pub fn visit(&mut self, skin: &Skin<'_>, slack_m: f64, mut visit: impl FnMut(Meeting)) {
        // two nodes close in on each other by at most twice the motion against the mean
        let margin_m = slack_m + 2.0 * skin.relative_speed() * skin.h_s;
        self.follow(skin);
        if self.travel_m + 0.5 * margin_m > self.list_lasts_m {
            self.rebuild(skin, margin_m);
        }
        let travel_m = self.travel_m;
        for k in 0..self.list.len() {
            let pair = self.list[k];
            if pair.gap_m - 2.0 * (travel_m - pair.measured_at_m) > margin_m {
                continue;
            }
            let meeting = meet(skin, [pair.first, pair.second]);
            self.list[k] = Pair { gap_m: meeting.gap_m, measured_at_m: travel_m, ..pair };
            if meeting.gap_m <= margin_m && !is_told_by_next(skin, &meeting) {
                visit(meeting);
            }
        }
    }

    /// Adds up how far nodes have moved against their mean, and how much the tube has widened.
    fn follow(&mut self, skin: &Skin<'_>) {
        let nodes = skin.positions;
        let widest = skin.widest_m();
        if self.last.len() == nodes.len() {
            let moves = || nodes.iter().zip(&self.last).map(|(now, last)| *now - *last);
            let mean = moves().sum::<DVec3>() / nodes.len() as f64;
            let most = moves().map(|m| (m - mean).length_squared()).fold(0.0, f64::max).sqrt();
            self.travel_m += most + (widest - self.last_radius_m).max(0.0);
        } else {
            self.list_lasts_m = f64::NEG_INFINITY;
        }
        self.last.clear();
        self.last.extend_from_slice(nodes);
        self.last_radius_m = widest;
    }

    /// Lists the pairs within reach (eq. 16).
    fn rebuild(&mut self, skin: &Skin<'_>, margin_m: f64) {
        let reach_m = LIST_RADII * skin.widest_m() + margin_m * LIST_STEPS;
        self.travel_m = 0.0;
        self.list_lasts_m = 0.5 * reach_m;
        let keys = &mut self.keys;
        keys.clear();
        let longest = (0..skin.segments()).map(|k| skin.length(k)).fold(0.0, f64::max);
        let cell_m = longest + 2.0 * skin.widest_m() + reach_m;
        self.grid.fill((0..skin.segments()).map(|k| skin.middle(k)), cell_m);
        self.grid.near_pairs(|i, j| {
            let (i, j) = (i.min(j), i.max(j));
            let [a, b] = [i, j].map(|k| k as usize);
            let between = skin.middle(a).distance_squared(skin.middle(b));
            let within = 0.5 * (skin.length(a) + skin.length(b)) + skin.widest(a) + skin.widest(b) + reach_m;
            if between < within * within && !is_neighbour(skin, a, b) {
                keys.push(u64::from(i) << 32 | u64::from(j));
            }
        });
        keys.sort_unstable();
        self.list.clear();
        self.list.extend(keys.iter().map(|key| Pair {
            first: (key >> 32) as u32,
            second: *key as u32,
            gap_m: f64::NEG_INFINITY,
            measured_at_m: 0.0,
        }));
    }
}

/// Whether two segments are so near along the tube that they touch through its own thickness (eq. 15): a tube bent as sharply
/// as it can be, to the radius of its own skin, comes back to itself after π r.
pub(super) fn is_neighbour(skin: &Skin<'_>, i: usize, j: usize) -> bool {
    let arc = |k: usize| 0.5 * (skin.arc_m[k] + skin.arc_m[k + 1]);
    let rest = |k: usize| skin.arc_m[k + 1] - skin.arc_m[k];
    let apart = (arc(j) - arc(i)).abs() - 0.5 * (rest(i) + rest(j));
    i.abs_diff(j) <= 1 || apart < 0.5 * PI * (skin.widest(i) + skin.widest(j))
}

/// Whether the next segment along the tube meets the same point: each end is told once.
pub(super) fn is_told_by_next(skin: &Skin<'_>, meeting: &Meeting) -> bool {
    let [i, j] = meeting.segments.map(|s| s as usize);
    let [s, t] = meeting.shares;
    (s >= 1.0 && !is_neighbour(skin, i + 1, j)) || (t >= 1.0 && j + 1 < skin.segments())
}

/// Where two segments are nearest (eq. 18).
pub(super) fn meet(skin: &Skin<'_>, segments: [u32; 2]) -> Meeting {
    let [a, b] = segments.map(|k| [skin.positions[k as usize], skin.positions[k as usize + 1]]);
    let (s, t) = near_segments(a, b);
    let way = a[0].lerp(a[1], s) - b[0].lerp(b[1], t);
    let distance = way.length();
    let radius = |k: u32, share: f64| {
        let [from, to] = [skin.radii_m[k as usize], skin.radii_m[k as usize + 1]];
        from + (to - from) * share
    };
    let radii_m = [radius(segments[0], s), radius(segments[1], t)];
    // axes that cross have no way between them: across both is as good as any
    let along = (a[1] - a[0]).normalize_or(DVec3::Z);
    let across = || along.cross(b[1] - b[0]).try_normalize().unwrap_or_else(|| along.any_orthonormal_vector());
    let normal = if distance > 1e-9 { way / distance } else { across() };
    Meeting { segments, shares: [s, t], normal, gap_m: distance - radii_m[0] - radii_m[1], radii_m }
}
