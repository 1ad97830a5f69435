//! The edges of a geodesic ball, used for the struts of a dome (MB97, §8).
//!
//! In: nothing. Out: 120 pairs of points on the unit ball. Never here: the struts themselves.

use glam::DVec3;

/// Above the edges of the ball (0.547 and 0.618), below any other distance of its corners.
const EDGE_MAX: f64 = 0.65;
/// Above the edge of the icosahedron in the unit ball (1.051), below any other distance of its corners.
const LONG_EDGE_MAX: f64 = 1.1;

/// The edges of an icosahedron with each face divided into four and its corners projected to the unit ball: 120, 60 of each of two lengths.
#[must_use]
pub fn geodesic_edges() -> Vec<[DVec3; 2]> {
    let golden = 0.5 * (1.0 + libm::sqrt(5.0));
    let mut corners = Vec::new();
    for [a, b] in [[1.0, golden], [1.0, -golden], [-1.0, golden], [-1.0, -golden]] {
        corners.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)].map(DVec3::normalize));
    }
    let middles: Vec<DVec3> = pairs(&corners, LONG_EDGE_MAX).iter().map(|[a, b]| (*a + *b).normalize()).collect();
    corners.extend(middles);
    pairs(&corners, EDGE_MAX)
}

/// Pairs of points closer to each other than `longest`.
fn pairs(points: &[DVec3], longest: f64) -> Vec<[DVec3; 2]> {
    let of = |i: usize| points[i + 1..].iter().map(move |b| [points[i], *b]);
    (0..points.len()).flat_map(of).filter(|[a, b]| a.distance(*b) < longest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dome_has_120_edges_of_two_lengths() {
        let edges = geodesic_edges();
        let lengths: Vec<f64> = edges.iter().map(|[a, b]| a.distance(*b)).collect();
        assert_eq!(edges.len(), 120);
        // chords of half of 63.43° and of 36° (between neighbouring midpoints)
        let near = |x: f64| lengths.iter().filter(|l| (**l - x).abs() < 1e-9).count();
        let half = 2.0 * (0.25 * 63.434_948_822_922_f64.to_radians()).sin();
        let mid = 2.0 * 18_f64.to_radians().sin();
        assert_eq!((near(half), near(mid)), (60, 60), "{half} {mid}");
    }
}
