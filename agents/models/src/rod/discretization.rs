//! Division of a tube: positions of its nodes along the rest length, and the stress-free state there.
//!
//! In: the skeleton and a density of nodes. Out: rest lengths, rest strains and rest bends of every segment and joint.
//! Never here: the present state ([`super::remesh`] transfers that). Theory: docs/theory/rod.md, eq. 1–4, 25.

use super::rest_curve::RestCurve;
use super::rotation::{exp, log, shortest_arc};
use glam::{DQuat, DVec3};

/// The fewest segments of any tube: one alone has no joint and cannot bend.
pub const SEGMENTS_MIN: usize = 2;
/// The most segments of any tube: past it a step takes longer than a controller can wait (0.7 ms on one core).
pub const SEGMENTS_MAX: usize = 4096;
/// The largest angle of the stress-free curve that one segment may span, radians: past it chords no longer resemble the curve.
const TURN_MAX_RAD: f64 = std::f64::consts::FRAC_PI_3;
/// Density of nodes in the sharpest bend, relative to a straight stretch. Mild: neighbouring lengths must stay similar for second order.
const DENSER_MAX: f64 = 2.0;
/// Excess of L/ε over an integer that counts as rounding and adds no segment.
const CEIL_SLACK: f64 = 1e-9;

/// The rest shape of a divided tube of N segments.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub struct Discretization {
    /// Rest arc length of each node, metres: 0 … L, N + 1 entries.
    pub arc_m: Vec<f64>,
    /// Stress-free node positions, metres; N + 1 entries.
    pub place: Vec<DVec3>,
    /// Rest length of each segment, metres; N entries.
    pub length: Vec<f64>,
    /// Chord over arc of each stress-free segment: its rest strain along the director, ≤ 1 (eq. 2).
    pub chord: Vec<f64>,
    /// Frames at the start: stress-free except for the twist of the skeleton; N entries.
    pub frame: Vec<DQuat>,
    /// 1/l̄ of the joint before each segment and of the end: N + 1 entries; 2/l at the ends (eq. 4).
    pub joint: Vec<f64>,
    /// Stress-free rotation vector of each joint, in the axes of the segment (or wall) before it: N + 1 entries (eq. 3).
    pub bend: Vec<DVec3>,
    /// Frames of the walls to which clamped ends are held: start, end.
    pub wall: [DQuat; 2],
}

/// Number of segments of this skeleton at spacing `eps_m`: ⌈L/ε⌉ within the limits.
pub fn segments_for(skeleton: &RestCurve, eps_m: f64) -> usize {
    let wanted = libm::ceil(skeleton.length_m() / eps_m - CEIL_SLACK);
    let count = if wanted >= SEGMENTS_MAX as f64 { SEGMENTS_MAX } else { wanted.max(0.0) as usize };
    limit(skeleton, count)
}

/// The nearest number of segments that can represent this skeleton.
pub fn limit(skeleton: &RestCurve, count: usize) -> usize {
    let turns = libm::ceil(skeleton.turning_rad() / TURN_MAX_RAD) as usize;
    count.clamp(SEGMENTS_MIN.max(turns).min(SEGMENTS_MAX), SEGMENTS_MAX)
}

/// Distributes `count` segments over the rest length in proportion to `density` (one per interval of `arcs`, per metre; eq. 25).
///
/// `arcs` are the arc lengths at which the density changes, from 0 to L.
pub fn place_nodes(arcs: &[f64], density: &[f64], count: usize, into: &mut Vec<f64>) {
    let last = arcs.len() - 1;
    let total: f64 = density.iter().zip(arcs.windows(2)).map(|(d, s)| d * (s[1] - s[0])).sum();
    let (mut left, mut gone) = (0, 0.0);
    into.clear();
    into.push(0.0);
    for k in 1..count {
        let goal = total * k as f64 / count as f64;
        while left + 1 < last && gone + density[left] * (arcs[left + 1] - arcs[left]) < goal {
            gone += density[left] * (arcs[left + 1] - arcs[left]);
            left += 1;
        }
        into.push(arcs[left] + (goal - gone) / density[left]);
    }
    into.push(arcs[last]);
}

/// The density of nodes for curvatures `bend` (1/m) of segments of these lengths: 1 … 2, smoothed (eq. 25).
///
/// A chord misses its arc by κ l²/8, so equal errors require √κ; 1/L keeps the noise of a straight tube from dominating.
pub fn densities(bend: &mut [f64], length: &[f64]) {
    let total: f64 = length.iter().sum();
    let turned: f64 = bend.iter().zip(length).map(|(b, l)| b * l).sum();
    let scale = (turned + 1.0) / total;
    bend.iter_mut().for_each(|b| *b = 1.0 + (*b / scale).sqrt().min(DENSER_MAX - 1.0));
    // a few passes smooth jumps, so that no two adjacent lengths differ much
    for _ in 0..4 {
        let mut before = bend[0];
        for k in 0..bend.len() {
            let after = bend[(k + 1).min(bend.len() - 1)];
            let here = bend[k];
            bend[k] = 0.25 * before + 0.5 * here + 0.25 * after;
            before = here;
        }
    }
}

impl Discretization {
    /// The initial division of the skeleton: even where it is straight, denser where it bends.
    pub fn first(skeleton: &RestCurve, count: usize) -> Self {
        let mut division = Self::default();
        let length = skeleton.length_m();
        let mut arcs: Vec<f64> = (0..=count).map(|k| length * k as f64 / count as f64).collect();
        arcs[count] = length;
        if !skeleton.is_straight() {
            let tangents: Vec<DVec3> = arcs.iter().map(|&s| skeleton.at(s).tangent).collect();
            let even = length / count as f64;
            let mut bend: Vec<f64> = tangents.windows(2).map(|t| (t[1] - t[0]).length() / even).collect();
            densities(&mut bend, &vec![even; count]);
            let coarse = arcs.clone();
            place_nodes(&coarse, &bend, count, &mut arcs);
        }
        division.rebuild(skeleton, &arcs);
        division
    }

    /// Number of segments.
    pub fn segments(&self) -> usize {
        self.length.len()
    }

    /// The length that belongs to each node, metres: half of each segment beside it.
    pub fn node_lengths_m(&self) -> impl Iterator<Item = f64> + '_ {
        let of = |segment: Option<usize>| segment.and_then(|k| self.length.get(k)).copied().unwrap_or(0.0);
        (0..=self.segments()).map(move |node| 0.5 * (of(node.checked_sub(1)) + of(Some(node))))
    }

    /// Total rest length, metres.
    pub fn total_m(&self) -> f64 {
        self.arc_m[self.segments()]
    }

    /// The segment that contains the material point at `arc_m`, and the point's share of it, 0 … 1.
    pub fn locate(&self, arc_m: f64) -> (usize, f64) {
        let right = self.arc_m.partition_point(|&s| s < arc_m).clamp(1, self.segments());
        let share = (arc_m - self.arc_m[right - 1]) / self.length[right - 1];
        (right - 1, share.clamp(0.0, 1.0))
    }

    /// Rest arc length of the middle of a segment, metres.
    pub fn middle_m(&self, segment: usize) -> f64 {
        0.5 * (self.arc_m[segment] + self.arc_m[segment + 1])
    }

    /// Divides the skeleton at `arcs` (0 … L, rising), reusing the storage.
    pub fn rebuild(&mut self, skeleton: &RestCurve, arcs: &[f64]) {
        let count = arcs.len() - 1;
        self.arc_m.clear();
        self.arc_m.extend_from_slice(arcs);
        self.place.clear();
        self.place.extend(arcs.iter().map(|&s| skeleton.at(s).position));
        self.length.clear();
        self.length.extend(arcs.windows(2).map(|s| s[1] - s[0]));
        self.frame.clear();
        self.chord.clear();
        for k in 0..count {
            let station = skeleton.at(self.middle_m(k));
            let chord = self.place[k + 1] - self.place[k];
            let direction = if skeleton.is_straight() { station.tangent } else { chord.normalize() };
            let strain = chord.length() / self.length[k];
            self.frame.push(shortest_arc(station.tangent, direction) * station.frame);
            self.chord.push(if skeleton.is_straight() { 1.0 } else { strain });
        }
        self.wall = [skeleton.at(0.0).frame, skeleton.at(skeleton.length_m()).frame];
        self.rebuild_joints(skeleton.is_unbent());
        self.twist(skeleton);
    }

    /// Twists the sections and the end wall about the curve.
    fn twist(&mut self, skeleton: &RestCurve) {
        let turned = |frame: DQuat, arc_m: f64| match skeleton.twist_at(arc_m) {
            0.0 => frame,
            angle => frame * exp(DVec3::Z * angle),
        };
        for k in 0..self.segments() {
            self.frame[k] = turned(self.frame[k], self.middle_m(k));
        }
        self.wall[1] = turned(self.wall[1], self.total_m());
    }

    fn rebuild_joints(&mut self, unbent: bool) {
        let count = self.segments();
        self.joint.clear();
        self.bend.clear();
        for k in 0..=count {
            let before = if k == 0 { self.wall[0] } else { self.frame[k - 1] };
            let after = if k == count { self.wall[1] } else { self.frame[k] };
            let half = |i: usize| 0.5 * self.length[i];
            let dual = if k == 0 { half(0) } else { half(k - 1) + if k == count { 0.0 } else { half(k) } };
            self.joint.push(1.0 / dual);
            let bend = if unbent { DVec3::ZERO } else { before.conjugate() * log(after * before.conjugate()) };
            self.bend.push(bend);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_tube_is_divided_evenly_and_its_lengths_sum_exactly() {
        let division = Discretization::first(&RestCurve::new(&[DVec3::ZERO, DVec3::X]), 64);
        assert_eq!(division.total_m(), 1.0);
        for l in &division.length {
            assert!((l - 1.0 / 64.0).abs() < 1e-15);
        }
        assert!(division.chord.iter().all(|&c| c == 1.0) && division.bend.iter().all(|b| *b == DVec3::ZERO));
    }

    #[test]
    fn bends_are_divided_more_finely_than_straights() {
        let path = [DVec3::ZERO, DVec3::X, DVec3::new(1.1, 0.1, 0.0), DVec3::new(1.1, 1.0, 0.0)];
        let division = Discretization::first(&RestCurve::new(&path), 60);
        let finest = division.length.iter().copied().fold(f64::MAX, f64::min);
        let coarsest = division.length.iter().copied().fold(0.0, f64::max);
        assert!(coarsest / finest > 1.3 && coarsest / finest < 2.1, "{coarsest} / {finest}"); // densities 1 … 2
        for pair in division.length.windows(2) {
            assert!((pair[0] / pair[1] - 1.0).abs() < 0.3, "neighbours {pair:?}");
        }
    }

    #[test]
    fn a_point_is_found_in_its_segment() {
        let division = Discretization::first(&RestCurve::new(&[DVec3::ZERO, DVec3::X]), 4);
        assert_eq!(division.locate(0.0), (0, 0.0));
        let (segment, share) = division.locate(0.625);
        assert!(segment == 2 && (share - 0.5).abs() < 1e-14); // a few roundings over a quarter
        assert_eq!(division.locate(7.0), (3, 1.0));
    }
}
