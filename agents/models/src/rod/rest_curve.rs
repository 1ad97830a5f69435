//! The initial centre line of a tube, normally stress-free: a C¹ curve through the path's points, measured by arc length, with twist-free
//! frames.
//!
//! In: the path, and how it strains the tube. Out: position, tangent, frame and curvature at any arc length. Never here: segments, motion.
//! Between points the curve is a cubic Hermite with centripetal Catmull–Rom tangents (YSK11); at the ends it leaves
//! along the first and last chord. Two points are joined by an exactly straight line. Theory: docs/theory/rod.md, eq. 1.

use super::rotation::{shortest_arc, unit};
use glam::{DMat3, DQuat, DVec3};

/// Number of bins per span between two path points, for the arc-length table and the frames.
const BINS: usize = 32;
/// Nodes and weights of Gauss's rule of order 10 on 0 … 1: the relative error of a bin's arc length is below 1e-12.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_5, 0.239_314_335_249_683_2),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_2),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];
/// Newton steps for the parameter at an arc length: each doubles the number of correct digits from a start inside the right bin.
const INVERSIONS: usize = 4;

/// One cubic between two path points, with parameter 0 … 1.
#[derive(Debug, Clone, Copy)]
struct Span {
    from: DVec3,
    to: DVec3,
    slope_start: DVec3,
    slope_end: DVec3,
}

/// A frame at the start of a bin.
#[derive(Debug, Clone, Copy)]
struct FrameSample {
    arc_m: f64,
    frame: DQuat,
}

/// The initial centre line.
#[derive(Debug, Clone)]
pub struct RestCurve {
    spans: Vec<Span>,
    samples: Vec<FrameSample>,
    straight: bool,
    unbent: bool,
    twist_rad: f64,
}

/// A point of the centre line.
#[derive(Debug, Clone, Copy)]
pub struct Station {
    /// Position, metres.
    pub position: DVec3,
    /// Unit tangent.
    pub tangent: DVec3,
    /// The untwisted frame; its third axis is the tangent.
    pub frame: DQuat,
}

impl Span {
    fn at(&self, w: f64) -> DVec3 {
        let (w2, w3) = (w * w, w * w * w);
        let s = 3.0 * w2 - 2.0 * w3;
        self.from + (self.to - self.from) * s + self.slope_start * (w3 - 2.0 * w2 + w) + self.slope_end * (w3 - w2)
    }

    fn slope(&self, w: f64) -> DVec3 {
        let w2 = w * w;
        (self.to - self.from) * (6.0 * (w - w2))
            + self.slope_start * (3.0 * w2 - 4.0 * w + 1.0)
            + self.slope_end * (3.0 * w2 - 2.0 * w)
    }

    fn length(&self, a: f64, b: f64) -> f64 {
        GAUSS.iter().map(|(x, weight)| weight * self.slope(a + (b - a) * x).length()).sum::<f64>() * (b - a)
    }
}

impl RestCurve {
    /// The curve through `path`: at least two points, adjacent ones distinct, without reversals.
    pub fn new(path: &[DVec3]) -> Self {
        let spans = spans_of(path);
        let straight = path.len() == 2;
        let tangent = |i: usize| {
            let span = &spans[(i / BINS).min(spans.len() - 1)];
            let w = if i / BINS == spans.len() { 1.0 } else { (i % BINS) as f64 / BINS as f64 };
            span.slope(w).normalize()
        };
        let mut samples = vec![FrameSample { arc_m: 0.0, frame: first_frame(tangent(0)) }];
        for i in 0..spans.len() * BINS {
            let (span, bin) = (&spans[i / BINS], i % BINS);
            let (a, b) = (bin as f64 / BINS as f64, (bin + 1) as f64 / BINS as f64);
            let from = samples[i];
            let frame = transport(from.frame, span.at(b) - span.at(a), tangent(i), tangent(i + 1));
            // a line is measured as a whole: sums of bins would round its length
            let arc_m = if straight { (path[1] - path[0]).length() * b } else { from.arc_m + span.length(a, b) };
            samples.push(FrameSample { arc_m, frame });
        }
        Self { spans, samples, straight, unbent: straight, twist_rad: 0.0 }
    }

    /// The same for a tube that the path strains: one that is straight when unloaded, or whose sections are twisted
    /// about the curve, evenly from 0 at the start to `twist_rad` at the end.
    pub fn strained(self, straight: bool, twist_rad: f64) -> Self {
        Self { unbent: straight || self.straight, twist_rad, ..self }
    }

    /// Whether the unloaded tube is straight.
    pub fn is_unbent(&self) -> bool {
        self.unbent
    }

    /// Twist of the section at `arc_m` about the curve, relative to its untwisted frames, radians.
    pub fn twist_at(&self, arc_m: f64) -> f64 {
        self.twist_rad * (arc_m / self.length_m())
    }

    /// Whether the path has two points: the line between them has no curvature at all.
    pub fn is_straight(&self) -> bool {
        self.straight
    }

    /// Rest length, metres.
    pub fn length_m(&self) -> f64 {
        self.samples[self.samples.len() - 1].arc_m
    }

    /// The point at `arc_m`, clamped to the curve.
    pub fn at(&self, arc_m: f64) -> Station {
        let arc_m = arc_m.clamp(0.0, self.length_m());
        if self.straight {
            let Span { from, to, .. } = self.spans[0];
            let (tangent, frame) = ((to - from).normalize(), self.samples[0].frame);
            return Station { position: from.lerp(to, arc_m / self.length_m()), tangent, frame };
        }
        let right = self.samples.partition_point(|k| k.arc_m <= arc_m).clamp(1, self.samples.len() - 1);
        let sample = self.samples[right - 1];
        let (span, bin) = (&self.spans[(right - 1) / BINS], (right - 1) % BINS);
        let start = bin as f64 / BINS as f64;
        let size = self.samples[right].arc_m - sample.arc_m;
        let mut w = start + (arc_m - sample.arc_m) / size / BINS as f64;
        for _ in 0..INVERSIONS {
            w -= (span.length(start, w) - (arc_m - sample.arc_m)) / span.slope(w).length();
        }
        let w = w.clamp(0.0, 1.0);
        let tangent = span.slope(w).normalize();
        let frame = unit(shortest_arc(sample.frame * DVec3::Z, tangent) * sample.frame).normalize();
        Station { position: span.at(w), tangent, frame }
    }

    /// The angle that frames sweep along the whole curve, radians: turning of the tangent plus twist.
    pub fn turning_rad(&self) -> f64 {
        let tangents = self.samples.iter().map(|k| k.frame * DVec3::Z);
        let bends = tangents.clone().zip(tangents.skip(1)).map(|(a, b)| libm::atan2(a.cross(b).length(), a.dot(b)));
        bends.sum::<f64>() + self.twist_rad.abs()
    }
}

/// Centripetal Catmull–Rom tangents: knot spacings are the square roots of the chords (YSK11).
fn spans_of(path: &[DVec3]) -> Vec<Span> {
    let chords: Vec<DVec3> = path.windows(2).map(|p| p[1] - p[0]).collect();
    let steps: Vec<f64> = chords.iter().map(|c| c.length().sqrt()).collect();
    let slope = |i: usize| {
        if i == 0 {
            chords[0] / steps[0]
        } else if i == chords.len() {
            chords[i - 1] / steps[i - 1]
        } else {
            let (a, b) = (steps[i - 1], steps[i]);
            chords[i - 1] / a - (chords[i - 1] + chords[i]) / (a + b) + chords[i] / b
        }
    };
    (0..chords.len())
        .map(|i| Span {
            from: path[i],
            to: path[i + 1],
            slope_start: slope(i) * steps[i],
            slope_end: slope(i + 1) * steps[i],
        })
        .collect()
}

/// An arbitrary frame whose third axis is `tangent`.
fn first_frame(tangent: DVec3) -> DQuat {
    shortest_arc(DVec3::Z, tangent)
}

/// Transports `frame` along a step of the curve without twist, by double reflection (WJZL08, §4).
fn transport(frame: DQuat, step: DVec3, from: DVec3, to: DVec3) -> DQuat {
    let c1 = step.length_squared();
    if c1 == 0.0 {
        return frame;
    }
    let normal = frame * DVec3::X;
    let reflected = normal - step * (2.0 / c1 * step.dot(normal));
    let turned = from - step * (2.0 / c1 * step.dot(from));
    let v = to - turned;
    let c2 = v.length_squared();
    let x = if c2 > 0.0 { reflected - v * (2.0 / c2 * v.dot(reflected)) } else { reflected };
    let x = (x - to * x.dot(to)).normalize();
    DQuat::from_mat3(&DMat3::from_cols(x, to.cross(x), to)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_points_make_an_exactly_straight_line() {
        let line = RestCurve::new(&[DVec3::X, DVec3::X * 3.0]);
        assert_eq!(line.length_m(), 2.0);
        for s in [0.0, 0.3, 1.0, 1.9, 2.0] {
            let at = line.at(s);
            assert!((at.position - DVec3::X * (1.0 + s)).length() < 1e-15); // a few roundings of 2
            assert!((at.tangent - DVec3::X).length() < 1e-15);
        }
    }

    #[test]
    fn a_circle_of_points_has_nearly_its_length_and_turning() {
        let count = 64;
        let angle = |i: usize| std::f64::consts::TAU * i as f64 / f64::from(count);
        let path: Vec<_> = (0..=count as usize).map(|i| DVec3::new(angle(i).cos(), angle(i).sin(), 0.0)).collect();
        let circle = RestCurve::new(&path);
        // the error of Catmull–Rom is of fourth order in the spacing, at the two ends of second order: 2 (2π/64)³/24 of the length
        assert!((circle.length_m() - std::f64::consts::TAU).abs() < 1e-4, "{}", circle.length_m());
        assert!((circle.at(circle.length_m() / 4.0).position - DVec3::Y).length() < 1e-4);
        assert!((circle.turning_rad() - std::f64::consts::TAU).abs() < 0.11); // one chord's angle less at the ends
    }

    #[test]
    fn arc_length_is_the_distance_gone_and_the_curve_meets_its_points() {
        let path = [DVec3::ZERO, DVec3::new(0.2, 0.05, 0.0), DVec3::new(0.3, 0.0, 0.1), DVec3::new(0.3, -0.2, 0.1)];
        let curve = RestCurve::new(&path);
        let (mut gone, steps) = (0.0, 20_000);
        let at = |i: usize| curve.at(curve.length_m() * i as f64 / steps as f64);
        for i in 0..steps {
            gone += (at(i + 1).position - at(i).position).length();
        }
        assert!((gone - curve.length_m()).abs() < 1e-8 * gone); // chords: (κ h)²/24
        let nearest = (0..=steps).map(|i| (at(i).position - path[2]).length()).fold(f64::MAX, f64::min);
        assert!(nearest < curve.length_m() / steps as f64);
        assert!((curve.at(curve.length_m()).position - path[3]).length() < 1e-14);
    }
}
