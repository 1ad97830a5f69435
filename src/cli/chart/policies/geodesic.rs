//! The domes of (MB97) in numbers: struts along the edges of a ball of triangles, which spin and swing to and fro.
//!
//! In: a frame. Out: the pixels that every strut covers, and what its pictures and the ball lack. Never here: who chooses.
//! Six pictures a strut and the nominal cost of 3840 are the paper's; eight domes of 120 struts, their places and motion are ours.

use super::scene::SCREEN;
use crate::compositor::Camera;
use glam::{DQuat, DVec3};
use metachron_geometry::geodesic_edges;

/// Domes, and struts of each.
pub(super) const DOMES: usize = 8;
pub(super) const STRUTS: usize = 120;
/// Radius of a strut to that of its dome, which is 1 m.
const STRUT: f64 = 0.05;

/// Pixels that every strut covers in a frame, dome by dome.
pub(super) fn pixels(frame: usize) -> Vec<f64> {
    let camera = Camera::looking(DVec3::ZERO, DVec3::X, 60_f64.to_radians());
    let edges = geodesic_edges();
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

/// The part of a round strut's outline that a prism of so many sides in it lacks: 1 − sin(2π/k) k/2π of its cross-section.
pub(super) fn prism_error(sides: f64) -> f64 {
    let part = std::f64::consts::TAU / sides;
    1.0 - libm::sin(part) / part
}

/// What a ball fills in between struts that lie at random over its disc, as a part of what they cover: e⁻ˣ/(1 − e⁻ˣ), x their area over
/// the disc's.
pub(super) fn ball_error() -> f64 {
    use std::f64::consts::PI;
    let length: f64 = geodesic_edges().iter().map(|[a, b]| a.distance(*b)).sum();
    // the mean of a length seen from all sides is π/4 of it
    let x = 0.25 * PI * length * 2.0 * STRUT / PI;
    1.0 / (libm::exp(x) - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prism_of_many_sides_is_round() {
        assert!((prism_error(4.0) - (1.0 - 2.0 / std::f64::consts::PI)).abs() < 1e-12);
        assert!(prism_error(1000.0) < 1e-5);
    }
}
