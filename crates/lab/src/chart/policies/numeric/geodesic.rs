//! The domes of (MB97) in numbers: struts along the edges of a geodesic ball, which spin and swing to and fro.
//!
//! In: a frame. Out: the pixels that every strut covers, and the errors of its levels and of the ball. Never here: selection.
//! Six levels per strut and the nominal cost of 3840 are the paper's; eight domes of 120 struts, their positions and motion are our own.

use super::scene::SCREEN;
use glam::{DQuat, DVec3};
use metachron_drawable::geodesic_edges;
use metachron_render::Camera;

/// Domes, and struts of each.
pub(crate) const DOMES: usize = 8;
pub(crate) const STRUTS: usize = 120;
/// Radius of a strut, as a share of the radius of its dome, which is 1 m.
const STRUT: f64 = 0.05;

/// Pixels that every strut covers in a frame, dome by dome.
pub(crate) fn pixels(frame: usize) -> Vec<f64> {
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
    let neighbour_of = middle.normalize();
    let scale = camera.pixels_per_metre(middle.dot(camera.forward()), SCREEN);
    let across = (b - a) - neighbour_of * (b - a).dot(neighbour_of);
    across.length() * 2.0 * STRUT * scale * scale
}

/// Share of a round strut's cross-section that an inscribed prism of so many sides lacks: 1 − sin(2π/k) k/2π.
pub(crate) fn prism_error(sides: f64) -> f64 {
    let part = std::f64::consts::TAU / sides;
    1.0 - libm::sin(part) / part
}

/// Area that a ball fills between struts placed at random over its disc, as a share of the area that they cover: e⁻ˣ/(1 − e⁻ˣ), with x
/// their area over the disc's.
pub(crate) fn ball_error() -> f64 {
    use std::f64::consts::PI;
    let length: f64 = geodesic_edges().iter().map(|[a, b]| a.distance(*b)).sum();
    // the mean projection of a length over all directions is π/4 of it
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
