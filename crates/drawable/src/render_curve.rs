//! The skeleton of a tube's picture: a C¹ curve through its nodes, cut into intervals ε with rotation-minimising frames.
//!
//! In: a [`CurveState`] and the interval ε. Out: one [`SkinFrame`] at each end of an interval, between which a cylinder patch
//! ([`metachron_geometry::patch`]) is bent. Never here: triangles, the GPU, allocation once the sizes settle.
//! Between nodes the curve is the cubic of Hermite with the tangents of the parabola through three nodes, so it is C¹ and reproduces
//! parabolas; frames follow by double reflection (WJZL08, §4), whose error is O(ε⁴).

use glam::{DQuat, DVec2, DVec3};
use metachron_core::CurveState;

/// Most intervals of a skeleton: beyond, a single tube exceeds the budget of any frame.
pub const INTERVALS_MAX: usize = 1 << 16;

/// Highest sampling density in a bend, relative to a straight stretch.
const SPREAD_MAX: f64 = 3.0;

/// The curve at one end of an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkinFrame {
    /// Rest arc length of this material point, metres.
    pub arc_m: f64,
    /// Position, metres.
    pub position: DVec3,
    /// Derivative of the position by rest arc length: the tangent times the stretch.
    pub slope: DVec3,
    /// Unit vector across the curve, rotation-minimising along it.
    pub normal: DVec3,
    /// Angle about the tangent from `normal` to the section's own x director, radians; without jumps along the curve.
    pub twist_rad: f64,
    /// Outer radius, metres.
    pub radius_m: f64,
    /// Derivative of the radius by rest arc length.
    pub radius_slope: f64,
    /// By how much the radius is larger along cos 2φ and sin 2φ, φ from `normal`, metres; zero of a round section.
    pub flattening_m: DVec2,
}

/// Cuts curves into intervals; its storage is reused.
#[derive(Debug, Clone, Default)]
pub struct Skeleton {
    slopes: Vec<DVec3>,
    radius_slopes: Vec<f64>,
    /// Running integral of the sampling density over the nodes.
    spread: Vec<f64>,
    frames: Vec<SkinFrame>,
}

/// The number of intervals of ε = `eps_m` on a curve of `length_m`: ⌈L/ε⌉, at least one, at most [`INTERVALS_MAX`].
#[must_use]
pub fn intervals(length_m: f64, eps_m: f64) -> usize {
    let wanted = libm::ceil(length_m / eps_m);
    // a NaN ratio fails both comparisons and gives one interval
    if wanted >= INTERVALS_MAX as f64 {
        INTERVALS_MAX
    } else if wanted > 1.0 {
        wanted as usize
    } else {
        1
    }
}

impl Skeleton {
    /// The frames of the last [`Skeleton::rebuild`]: one more than there are intervals, none for an empty curve.
    #[must_use]
    pub fn frames(&self) -> &[SkinFrame] {
        &self.frames
    }

    /// Cuts `curve` into ⌈L/ε⌉ intervals, denser where it bends, and returns the frames between them.
    pub fn rebuild(&mut self, curve: &CurveState, eps_m: f64) -> &[SkinFrame] {
        self.frames.clear();
        let nodes = curve.positions.len();
        if nodes < 2 || curve.arc_m.len() != nodes || curve.radii_m.len() != nodes {
            return &self.frames;
        }
        self.find_slopes(curve);
        self.find_density(curve);
        self.place(curve, intervals(curve.arc_m[nodes - 1], eps_m));
        turn_least(&mut self.frames, start_normal(curve));
        follow_twist(&mut self.frames, curve);
        &self.frames
    }

    /// Tangents of position and radius at every node, of the parabola through it and its neighbours.
    fn find_slopes(&mut self, curve: &CurveState) {
        parabolic_slopes(&curve.arc_m, &curve.positions, &mut self.slopes);
        parabolic_slopes(&curve.arc_m, &curve.radii_m, &mut self.radius_slopes);
    }

    /// Integrates the sampling density 1 + √(κ/(κ̄ + 1/L)) along the nodes, κ̄ the mean curvature.
    ///
    /// A chord deviates from an arc by κ ε²/8, so equal errors require a density of √κ; the 1 keeps straight stretches sampled, and 1/L
    /// keeps the noise of an almost straight curve from dominating the density.
    fn find_density(&mut self, curve: &CurveState) {
        let last = curve.arc_m.len() - 1;
        let bend = |i: usize| {
            let h = curve.arc_m[i + 1] - curve.arc_m[i];
            if h > 0.0 { (self.slopes[i + 1] - self.slopes[i]).length() / h } else { 0.0 }
        };
        let length = curve.arc_m[last];
        let turned: f64 = (0..last).map(|i| bend(i) * (curve.arc_m[i + 1] - curve.arc_m[i])).sum();
        let scale = (turned + 1.0) / length.max(f64::MIN_POSITIVE);
        let mut sum = 0.0;
        self.spread.clear();
        self.spread.push(sum);
        for i in 0..last {
            let density = 1.0 + (bend(i) / scale).sqrt().min(SPREAD_MAX - 1.0);
            sum += density * (curve.arc_m[i + 1] - curve.arc_m[i]);
            self.spread.push(sum);
        }
    }

    /// Puts `count + 1` frames at equal fractions of the integrated density; normals and twist are set later.
    fn place(&mut self, curve: &CurveState, count: usize) {
        let last = curve.arc_m.len() - 1;
        let total = self.spread[last];
        let mut left = 0;
        for k in 0..=count {
            let goal = total * k as f64 / count as f64;
            while left + 1 < last && self.spread[left + 1] < goal {
                left += 1;
            }
            let share = self.spread[left + 1] - self.spread[left];
            let w = if share > 0.0 { ((goal - self.spread[left]) / share).clamp(0.0, 1.0) } else { 0.0 };
            self.frames.push(self.evaluate(curve, left, w));
        }
    }

    /// The cubic between nodes `left` and `left + 1` at the fraction `w`.
    fn evaluate(&self, curve: &CurveState, left: usize, w: f64) -> SkinFrame {
        let right = left + 1;
        let h = curve.arc_m[right] - curve.arc_m[left];
        let (a, b, c, d) = hermite(w);
        let (da, db, dc, dd) = hermite_slope(w);
        let (p, r) = (&curve.positions, &curve.radii_m);
        let position = p[left] * a + p[right] * b + (self.slopes[left] * c + self.slopes[right] * d) * h;
        let slope = if h > 0.0 {
            (p[left] * da + p[right] * db) / h + self.slopes[left] * dc + self.slopes[right] * dd
        } else {
            self.slopes[left]
        };
        let (m, n) = (self.radius_slopes[left], self.radius_slopes[right]);
        let radius_slope = if h > 0.0 { (r[left] * da + r[right] * db) / h + m * dc + n * dd } else { m };
        SkinFrame {
            arc_m: curve.arc_m[left] + w * h,
            position,
            slope,
            normal: DVec3::ZERO,
            twist_rad: 0.0,
            radius_m: (r[left] * a + r[right] * b + (m * c + n * d) * h).max(0.0),
            radius_slope,
            flattening_m: match (curve.flattening_m.get(left), curve.flattening_m.get(right)) {
                (Some(left), Some(right)) => left.lerp(*right, w),
                _ => DVec2::ZERO,
            },
        }
    }
}

/// The weights of Hermite's cubic at `w`: of the left value, the right value, the left slope and the right slope.
#[must_use]
pub fn hermite(w: f64) -> (f64, f64, f64, f64) {
    let v = 1.0 - w;
    (v * v * (1.0 + 2.0 * w), w * w * (3.0 - 2.0 * w), w * v * v, -w * w * v)
}

/// The derivatives of [`hermite`]'s weights.
#[must_use]
pub fn hermite_slope(w: f64) -> (f64, f64, f64, f64) {
    let bulge = 6.0 * w * (1.0 - w);
    (-bulge, bulge, (1.0 - w) * (1.0 - 3.0 * w), w * (3.0 * w - 2.0))
}

/// Slopes of the parabolas through each value and its two neighbours; at the ends, of the nearest such parabola.
fn parabolic_slopes<T>(at: &[f64], values: &[T], slopes: &mut Vec<T>)
where
    T: Copy + std::ops::Sub<Output = T> + std::ops::Add<Output = T> + std::ops::Mul<f64, Output = T>,
{
    let last = values.len() - 1;
    let chord = |i: usize| {
        let h = at[i + 1] - at[i];
        (values[i + 1] - values[i]) * if h > 0.0 { 1.0 / h } else { 0.0 }
    };
    slopes.clear();
    if last == 1 {
        slopes.extend([chord(0), chord(0)]);
        return;
    }
    let middle = |i: usize| {
        let (before, after) = (at[i] - at[i - 1], at[i + 1] - at[i]);
        let w = if before + after > 0.0 { before / (before + after) } else { 0.5 };
        chord(i - 1) * (1.0 - w) + chord(i) * w
    };
    slopes.push(chord(0) * 2.0 - middle(1));
    slopes.extend((1..last).map(middle));
    slopes.push(chord(last - 1) * 2.0 - middle(last - 1));
}

/// The x director of the first section, or any direction where there is none.
fn start_normal(curve: &CurveState) -> DVec3 {
    curve.frames.first().map_or(DVec3::X, |q| *q * DVec3::X)
}

/// The part of `v` across the unit vector `t`, as a unit vector; any such vector if nothing is left of `v`.
fn across(v: DVec3, t: DVec3) -> DVec3 {
    (v - t * v.dot(t)).try_normalize().unwrap_or_else(|| t.any_orthonormal_vector())
}

/// Transports `normal` along the frames by double reflection (WJZL08, §4): first at the chord's bisecting plane, then so that the reflected
/// tangent becomes the next frame's tangent.
fn turn_least(frames: &mut [SkinFrame], normal: DVec3) {
    let tangent = |f: &SkinFrame| f.slope.try_normalize();
    let mut t = frames.iter().find_map(tangent).unwrap_or(DVec3::Z);
    let mut r = across(normal, t);
    let mut from = frames.first().map_or(DVec3::ZERO, |f| f.position);
    for frame in frames {
        let next = tangent(frame).unwrap_or(t);
        let (chord, mut r_l, mut t_l) = (frame.position - from, r, t);
        let c1 = chord.length_squared();
        if c1 > 0.0 {
            r_l -= chord * (2.0 / c1 * chord.dot(r));
            t_l -= chord * (2.0 / c1 * chord.dot(t));
        }
        let step = next - t_l;
        let c2 = step.length_squared();
        if c2 > 0.0 {
            r_l -= step * (2.0 / c2 * step.dot(r_l));
        }
        r = across(r_l, next);
        (t, from) = (next, frame.position);
        frame.normal = r;
    }
}

/// Computes the angle of the section's x director from each frame's normal, without jumps of 2π.
fn follow_twist(frames: &mut [SkinFrame], curve: &CurveState) {
    if curve.frames.len() + 1 != curve.arc_m.len() {
        return;
    }
    let mut segment = 0;
    let mut before = 0.0;
    for frame in frames {
        let turn = section_at(curve, frame.arc_m, &mut segment);
        let t = frame.slope.normalize_or_zero();
        let x = turn * DVec3::X;
        let angle = libm::atan2(x.dot(t.cross(frame.normal)), x.dot(frame.normal));
        let turns = libm::round((before - angle) / std::f64::consts::TAU);
        frame.twist_rad = angle + turns * std::f64::consts::TAU;
        // from the section's own axes to the frame's
        let (sin, cos) = libm::sincos(2.0 * angle);
        frame.flattening_m = DVec2::new(cos, sin).rotate(frame.flattening_m);
        before = frame.twist_rad;
    }
}

/// The section's rotation at `arc_m`, interpolated between the middles of two segments. `segment` only increases.
fn section_at(curve: &CurveState, arc_m: f64, segment: &mut usize) -> DQuat {
    let middle = |i: usize| 0.5 * (curve.arc_m[i] + curve.arc_m[i + 1]);
    let last = curve.frames.len() - 1;
    while *segment < last && middle(*segment + 1) < arc_m {
        *segment += 1;
    }
    let (left, right) = (*segment, (*segment + 1).min(last));
    let h = middle(right) - middle(left);
    let w = if h > 0.0 { ((arc_m - middle(left)) / h).clamp(0.0, 1.0) } else { 0.0 };
    curve.frames[left].lerp(curve.frames[right], w)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// A helix of radius 1 and pitch 2π·`rise`, by arc length; `turns` of it between `nodes` nodes.
    fn helix(nodes: usize, turns: f64, rise: f64) -> CurveState {
        let speed = (1.0 + rise * rise).sqrt();
        let angle = |i: usize| turns * TAU * i as f64 / (nodes - 1) as f64;
        CurveState {
            arc_m: (0..nodes).map(|i| speed * angle(i)).collect(),
            positions: (0..nodes).map(|i| DVec3::new(angle(i).cos(), angle(i).sin(), rise * angle(i))).collect(),
            velocities: vec![DVec3::ZERO; nodes],
            frames: Vec::new(),
            radii_m: vec![0.1; nodes],
            flattening_m: vec![],
        }
    }

    #[test]
    fn curve_meets_its_nodes_with_one_tangent() {
        let curve = helix(12, 1.5, 0.3);
        let mut skeleton = Skeleton::default();
        skeleton.rebuild(&curve, 0.1);
        for node in 1..11 {
            let (before, after) = (skeleton.evaluate(&curve, node - 1, 1.0), skeleton.evaluate(&curve, node, 0.0));
            // both are values of the same cubics at a shared end, summed in another order: a few ulp of 1
            assert!((before.position - after.position).length() < 1e-14);
            assert!((before.slope - after.slope).length() < 1e-13);
            assert!((before.position - curve.positions[node]).length() < 1e-14);
        }
    }

    #[test]
    fn a_parabola_is_reproduced() {
        // unevenly spaced nodes on (s, s²): the tangents are those of parabolas, so the result is exact
        let arc_m = vec![0.0, 0.1, 0.35, 0.4, 1.0];
        let positions: Vec<_> = arc_m.iter().map(|&s| DVec3::new(s, s * s, 0.0)).collect();
        let curve = CurveState {
            velocities: vec![DVec3::ZERO; 5],
            frames: Vec::new(),
            radii_m: vec![0.1; 5],
            flattening_m: vec![],
            arc_m,
            positions,
        };
        for f in Skeleton::default().rebuild(&curve, 0.01) {
            assert!((f.position - DVec3::new(f.arc_m, f.arc_m * f.arc_m, 0.0)).length() < 1e-14, "{f:?}");
            assert!((f.slope - DVec3::new(1.0, 2.0 * f.arc_m, 0.0)).length() < 1e-13, "{f:?}");
        }
    }

    #[test]
    fn frames_do_not_twist_on_a_plane_curve() {
        // a clothoid-like plane curve: a normal that starts out of the plane must stay perpendicular to it
        let mut curve = helix(40, 1.2, 0.0);
        curve.frames = vec![DQuat::from_rotation_arc(DVec3::X, DVec3::Z); 39];
        for f in Skeleton::default().rebuild(&curve, 0.2) {
            assert!((f.normal - DVec3::Z).length() < 1e-13, "{}", f.normal); // exact by symmetry except for rounding
        }
    }

    #[test]
    fn frames_turn_against_the_torsion_of_a_helix() {
        // closed form: the rotation-minimising frame turns by −∫τ ds against Frenet's frame, τ = rise/(1 + rise²)
        let (rise, turns) = (0.5, 2.0);
        let curve = helix(4000, turns, rise);
        let mut skeleton = Skeleton::default();
        let error = |eps: f64, skeleton: &mut Skeleton| {
            let frames = skeleton.rebuild(&curve, eps);
            let frenet = |f: &SkinFrame| -DVec3::new(f.position.x, f.position.y, 0.0).normalize();
            let angle = |f: &SkinFrame| {
                let (t, m) = (f.slope.normalize(), frenet(f));
                f.normal.dot(t.cross(m)).atan2(f.normal.dot(m))
            };
            let (first, last) = (&frames[0], frames.last().unwrap());
            let turned = angle(last) - angle(first);
            let wanted = -rise / (1.0 + rise * rise) * (last.arc_m - first.arc_m);
            ((turned - wanted + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0).abs()
        };
        let (coarse, fine) = (error(0.4, &mut skeleton), error(0.2, &mut skeleton));
        assert!(fine < 1e-3, "{fine}");
        // order four: halving ε divides the error by 16; 10 leaves room for the higher orders
        assert!(coarse / fine > 10.0, "{coarse} {fine}");
    }

    #[test]
    fn twist_of_the_matter_is_followed_over_many_turns() {
        let n = 200;
        let arc_m: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
        let rate = 40.0; // radians per metre: more than six turns
        let curve = CurveState {
            positions: arc_m.iter().map(|&s| DVec3::new(0.0, 0.0, s)).collect(),
            velocities: vec![DVec3::ZERO; n + 1],
            frames: (0..n).map(|i| DQuat::from_rotation_z(rate * (i as f64 + 0.5) / n as f64)).collect(),
            radii_m: vec![0.01; n + 1],
            flattening_m: vec![],
            arc_m,
        };
        let mut skeleton = Skeleton::default();
        let frames = skeleton.rebuild(&curve, 0.02);
        let turned = frames[40].twist_rad - frames[10].twist_rad;
        // between the middles of segments the rotation is blended as quaternions: good to (rate/n)³
        assert!((turned - rate * (frames[40].arc_m - frames[10].arc_m)).abs() < 1e-2, "{turned}");
    }

    #[test]
    fn bends_get_more_intervals_than_straights() {
        // a straight metre, then a half circle of 5 cm
        let n = 100;
        let mut positions: Vec<_> = (0..=n).map(|i| DVec3::new(i as f64 / n as f64, 0.0, 0.0)).collect();
        let mut arc_m: Vec<_> = (0..=n).map(|i| i as f64 / n as f64).collect();
        for i in 1..=20 {
            let a = std::f64::consts::PI * i as f64 / 20.0;
            positions.push(DVec3::new(1.0 + 0.05 * a.sin(), 0.05 * (1.0 - a.cos()), 0.0));
            arc_m.push(1.0 + 0.05 * a);
        }
        let nodes = positions.len();
        let curve = CurveState {
            arc_m,
            positions,
            velocities: vec![DVec3::ZERO; nodes],
            frames: Vec::new(),
            radii_m: vec![0.01; nodes],
            flattening_m: vec![],
        };
        let mut skeleton = Skeleton::default();
        let frames = skeleton.rebuild(&curve, 0.03);
        assert_eq!(frames.len(), intervals(*curve.arc_m.last().unwrap(), 0.03) + 1);
        let step = |i: usize| frames[i + 1].arc_m - frames[i].arc_m;
        assert!(step(0) > 1.5 * step(frames.len() - 2), "{} {}", step(0), step(frames.len() - 2));
    }

    #[test]
    fn interval_count_is_length_over_spacing_rounded_up() {
        assert_eq!(intervals(1.0, 0.3), 4);
        assert_eq!(intervals(1.0, 5.0), 1);
        assert_eq!(intervals(1.0, f64::NAN), 1);
        assert_eq!(intervals(1.0, 0.0), INTERVALS_MAX);
    }

    #[test]
    fn a_flat_section_lies_where_its_own_axes_say() {
        let arc_m: Vec<f64> = (0..5).map(f64::from).collect();
        // sections turned by 0.3 rad about a straight curve, flattened along their own x
        let curve = CurveState {
            positions: arc_m.iter().map(|&s| DVec3::Z * s).collect(),
            velocities: vec![DVec3::ZERO; 5],
            frames: (0..4).map(|k| DQuat::from_rotation_z(0.3 * f64::from(k))).collect(),
            radii_m: vec![0.1; 5],
            flattening_m: vec![DVec2::new(0.02, 0.0); 5],
            arc_m,
        };
        let mut skeleton = Skeleton::default();
        for frame in skeleton.rebuild(&curve, 0.5) {
            // in the direction of the section's x the radius is larger by all of it
            let (sin, cos) = (libm::sin(2.0 * frame.twist_rad), libm::cos(2.0 * frame.twist_rad));
            assert!((frame.flattening_m - DVec2::new(0.02 * cos, 0.02 * sin)).length() < 1e-15, "{frame:?}");
        }
    }
}
