//! The domes of (MB97) in numbers: struts along the edges of a ball of triangles, which spin and swing to and fro.
//!
//! In: a frame. Out: the pixels that every strut covers, and what its pictures and the ball lack. Never here: who chooses.
//! Six pictures a strut and the nominal cost of 3840 are the paper's; eight domes of 120 struts, their places and motion are ours.

use super::scene::SCREEN;
use crate::compositor::Camera;
use glam::{DQuat, DVec3};

/// Domes, and struts of each.
pub(super) const DOMES: usize = 8;
pub(super) const STRUTS: usize = 120;
/// Radius of a strut to that of its dome, which is 1 m.
const STRUT: f64 = 0.05;
/// Longer than an edge of the ball (0.547 and 0.618), shorter than any other distance of its corners.
const EDGE_MAX: f64 = 0.65;

/// Pixels that every strut covers in a frame, dome by dome.
pub(super) fn pixels(frame: usize) -> Vec<f64> {
    let camera = Camera::looking(DVec3::ZERO, DVec3::X, 60_f64.to_radians());
    let edges = edges();
    let t = frame as f64;
    let dome = |d: usize| {
        let k = d as f64;
        let depth = 5.0 + 1.8 * k + 2.0 * libm::sin(0.05 * t + k);
        let centre = DVec3::new(depth, (k - 3.5) * 0.3 * depth, 0.0);
        let spin = DQuat::from_rotation_z(0.02 * t * (1.0 + 0.2 * k));
        edges.iter().map(move |[a, b]| strut(&camera, centre + spin * *a, centre + spin * *b)).collect::<Vec<_>>()
    };
    (0..DOMES).flat_map(dome).collect()
}

/// Projected length times projected width.
fn strut(camera: &Camera, a: DVec3, b: DVec3) -> f64 {
    let middle = 0.5 * (a + b) - camera.eye();
    let sight = middle.normalize();
    let scale = camera.pixels_per_metre(middle.dot(camera.forward()), SCREEN);
    let across = (b - a) - sight * (b - a).dot(sight);
    across.length() * 2.0 * STRUT * scale * scale
}

/// The edges of an icosahedron's faces cut in four each, its corners brought to the unit ball: 120.
fn edges() -> Vec<[DVec3; 2]> {
    let golden = 0.5 * (1.0 + 5_f64.sqrt());
    let mut corners = Vec::new();
    for [a, b] in [[1.0, golden], [1.0, -golden], [-1.0, golden], [-1.0, -golden]] {
        corners.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)].map(DVec3::normalize));
    }
    let joined = |from: &[DVec3], longest: f64| {
        let of = |i: usize| from[i + 1..].iter().map(move |b| [from[i], *b]).collect::<Vec<_>>();
        let all = (0..from.len()).flat_map(of);
        all.filter(|[a, b]| a.distance(*b) < longest).collect::<Vec<_>>()
    };
    // edges of the icosahedron in the unit ball are 1.051 long
    let middles: Vec<DVec3> = joined(&corners, 1.1).iter().map(|[a, b]| (*a + *b).normalize()).collect();
    corners.extend(middles);
    joined(&corners, EDGE_MAX)
}

/// The part of a round strut's outline that a prism of so many sides in it lacks: 1 − sin(2π/k) k/2π of its cross-section.
pub(super) fn prism_error(sides: f64) -> f64 {
    let part = std::f64::consts::TAU / sides;
    1.0 - libm::sin(part) / part
}

/// What a ball fills in between struts that lie at random over its disc, as a part of what they cover: e⁻ˣ/(1 − e⁻ˣ), x their area over
/// the disc's.
pub(super) fn ball_error() -> f64 {
    use std::f64::consts::PI;
    let length: f64 = edges().iter().map(|[a, b]| a.distance(*b)).sum();
    // the mean of a length seen from all sides is π/4 of it
    let x = 0.25 * PI * length * 2.0 * STRUT / PI;
    1.0 / (libm::exp(x) - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dome_has_120_struts_of_two_lengths() {
        let edges = edges();
        let lengths: Vec<f64> = edges.iter().map(|[a, b]| a.distance(*b)).collect();
        assert_eq!(edges.len(), STRUTS);
        // chords of half of 63.43° and of 36° (a midpoint to its neighbour's)
        let near = |x: f64| lengths.iter().filter(|l| (**l - x).abs() < 1e-9).count();
        let half = 2.0 * (0.25 * 63.434_948_822_922_f64.to_radians()).sin();
        let mid = 2.0 * 18_f64.to_radians().sin();
        assert_eq!((near(half), near(mid)), (60, 60), "{half} {mid}");
    }

    #[test]
    fn a_prism_of_many_sides_is_round() {
        assert!((prism_error(4.0) - (1.0 - 2.0 / std::f64::consts::PI)).abs() < 1e-12);
        assert!(prism_error(1000.0) < 1e-5);
    }
}
