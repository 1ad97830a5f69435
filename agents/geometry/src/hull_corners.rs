//! The few corners whose convex hull reaches as far as that of many points.
//!
//! In: points, a distance. Out: those of the points that are corners. Never here: faces that last, shapes.
//!
//! Faces are raised to the farthest point above them until none is farther than the distance, as by Quickhull (Barber, Dobkin, Huhdanpaa
//! 1996) with a tolerance: what a scan has beyond it costs a search time and tells nothing apart.

use super::parry_shapes::hull_triangles;
use glam::DVec3;

/// Those of `points` by rising places whose hull has no other point farther than `within_m` metres (≥ 0) above a face; all of them where they
/// span no volume or one is not finite.
#[must_use]
pub fn hull_corners(points: &[DVec3], within_m: f64) -> Vec<DVec3> {
    if !points.iter().all(|point| point.is_finite()) {
        return points.to_vec();
    }
    let mut kept = extremes(points);
    let mut outside: Vec<usize> = (0..points.len()).collect();
    loop {
        let corners: Vec<DVec3> = kept.iter().map(|&at| points[at]).collect();
        let Ok(hull) = hull_triangles(&corners) else { return points.to_vec() };
        let faces = hull.triangles.iter().filter_map(|triangle| {
            let [a, b, c] = triangle.map(|corner| hull.points[corner as usize]);
            Some((a, (b - a).cross(c - a).try_normalize()?))
        });
        let mut farthest: Vec<_> = faces.map(|(corner, normal)| Face { corner, normal, above: None }).collect();
        // a hull only grows: what is inside of this one is inside of the next
        outside.retain(|&at| farthest.iter_mut().fold(false, |any, face| any | face.raise(at, points[at], within_m)));
        let before = kept.len();
        kept.extend(farthest.iter().filter_map(|face| Some(face.above?.point)));
        kept.sort_unstable();
        kept.dedup();
        if kept.len() == before {
            return corners;
        }
    }
}

/// A face, and the point that is farthest above it.
struct Face {
    corner: DVec3,
    normal: DVec3,
    above: Option<Above>,
}

#[derive(Clone, Copy)]
struct Above {
    point: usize,
    height_m: f64,
}

impl Face {
    /// Whether a point is more than `within_m` above it; the farthest is noted.
    fn raise(&mut self, point: usize, position: DVec3, within_m: f64) -> bool {
        let height_m = (position - self.corner).dot(self.normal);
        if height_m > within_m && self.above.is_none_or(|above| height_m > above.height_m) {
            self.above = Some(Above { point, height_m });
        }
        height_m > within_m
    }
}

/// The places of the points that are farthest along the axes and the diagonals between them.
fn extremes(points: &[DVec3]) -> Vec<usize> {
    let part = |k: i32| f64::from(k % 3 - 1);
    let ways = (0..27).map(|k| DVec3::new(part(k), part(k / 3), part(k / 9))).filter(|way| *way != DVec3::ZERO);
    let farthest = |way: DVec3| (0..points.len()).max_by(|&a, &b| points[a].dot(way).total_cmp(&points[b].dot(way)));
    let mut found: Vec<_> = ways.filter_map(farthest).collect();
    found.sort_unstable();
    found.dedup();
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Generator, generate_surface};

    /// How far a point is above the hull of `corners` at most.
    fn above_m(corners: &[DVec3], points: &[DVec3]) -> f64 {
        let hull = hull_triangles(corners).unwrap();
        let heights = hull.triangles.iter().flat_map(|triangle| {
            let [a, b, c] = triangle.map(|corner| hull.points[corner as usize]);
            let normal = (b - a).cross(c - a).normalize();
            points.iter().map(move |point| (*point - a).dot(normal))
        });
        heights.fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn a_ball_of_many_points_keeps_the_few_that_its_tolerance_tells_apart() {
        let ball = generate_surface(Generator::Sphere, 0, 20_000).points;
        let mut last = usize::MAX;
        // a cap of height h on a ball of radius r is √(2 r h) wide: corners go as 1/h
        for within_m in [1e-4, 1e-3, 1e-2] {
            let corners = hull_corners(&ball, within_m);
            assert!(above_m(&corners, &ball) <= within_m * (1.0 + 1e-3), "{within_m} m");
            assert!(corners.iter().all(|corner| ball.contains(corner)) && corners.len() < last);
            last = corners.len();
        }
        assert!(last < 300, "{last} corners");
    }

    #[test]
    fn a_box_of_many_points_has_eight_corners() {
        let part = |k: i32| f64::from(k % 11) * 0.1;
        let lattice: Vec<_> = (0..1331).map(|k| DVec3::new(part(k), part(k / 11), part(k / 121))).collect();
        assert_eq!(hull_corners(&lattice, 1e-6).len(), 8);
    }

    #[test]
    fn points_in_one_plane_are_left_as_they_are() {
        let flat: Vec<_> = (0..9).map(|k| DVec3::new(f64::from(k % 3), f64::from(k / 3), 0.5)).collect();
        assert_eq!(hull_corners(&flat, 0.1), flat);
        assert_eq!(hull_corners(&flat[..2], 0.1).len(), 2);
    }
}
