//! The corners of a convex hull, as few as a tolerance allows.
//!
//! In: points, a tolerance. Out: the points that are corners. Never here: faces that last, shapes.
//!
//! Faces are raised to the farthest point above them until none is farther than the tolerance, as by Quickhull (Barber, Dobkin, Huhdanpaa
//! 1996): further corners cost every search time and change the shape by less.

use crate::Aabb;
use crate::solids::parry_shapes::hull_triangles;
use glam::DVec3;

/// A subset of `points`, in their order, above the faces of whose hull no other point is higher than `tolerance_m` metres (≥ 0; below a
/// millionth of their extent single precision tells nothing apart). All of them where they span no volume or one is not finite.
#[must_use]
pub fn hull_corners(points: &[DVec3], tolerance_m: f64) -> Vec<DVec3> {
    if points.is_empty() || !points.iter().all(|point| point.is_finite()) {
        return points.to_vec();
    }
    // faces are found in single precision
    let Aabb { low, high } = Aabb::of(points);
    let centred: Vec<DVec3> = points.iter().map(|point| *point - (low + high) * 0.5).collect();
    let tolerance_m = tolerance_m.max(1e-6 * low.distance(high));
    let Some(mut kept) = seed(&centred) else { return points.to_vec() };
    let mut outside: Vec<usize> = (0..points.len()).collect();
    loop {
        let corners: Vec<DVec3> = kept.iter().map(|&at| centred[at]).collect();
        let Ok(hull) = hull_triangles(&corners) else { return points.to_vec() };
        let faces = hull.triangles.iter().filter_map(|triangle| {
            let [a, b, c] = triangle.map(|corner| hull.points[corner as usize]);
            Some(Face { corner: a, normal: (b - a).cross(c - a).try_normalize()?, farthest: None })
        });
        let mut faces: Vec<_> = faces.collect();
        // a hull only grows: a point inside this one is inside the next; corners stay where they are
        outside.retain(|at| kept.binary_search(at).is_err());
        outside.retain(|&at| faces.iter_mut().fold(false, |is_outside, face| face.note(at, centred[at]) | is_outside));
        let highest_m = faces.iter().filter_map(|face| Some(face.farthest?.height_m)).fold(0.0, f64::max);
        if highest_m <= tolerance_m {
            return kept.iter().map(|&at| points[at]).collect();
        }
        // lower ones may be inside once these are corners
        let from_m = tolerance_m.max(RAISED_FIRST * highest_m);
        let high = faces.iter().filter_map(|face| face.farthest.filter(|above| above.height_m > from_m));
        kept.extend(high.map(|above| above.point));
        kept.sort_unstable();
        kept.dedup();
    }
}

/// Points lower than this share of the highest one wait for it.
const RAISED_FIRST: f64 = 0.5;

/// A face, and the point that is farthest above it.
struct Face {
    corner: DVec3,
    normal: DVec3,
    farthest: Option<Above>,
}

#[derive(Clone, Copy)]
struct Above {
    point: usize,
    height_m: f64,
}

impl Face {
    /// Notes a point; whether it is above.
    fn note(&mut self, point: usize, position: DVec3) -> bool {
        let height_m = (position - self.corner).dot(self.normal);
        if height_m > self.farthest.map_or(0.0, |known| known.height_m) {
            self.farthest = Some(Above { point, height_m });
        }
        height_m > 0.0
    }
}

/// The indices, sorted, of a few points that span a volume; `None` where all lie in a plane.
fn seed(points: &[DVec3]) -> Option<Vec<usize>> {
    let component = |k: i32| f64::from(k % 3 - 1);
    let directions = (0..27).map(|k| DVec3::new(component(k), component(k / 3), component(k / 9)));
    let mut found: Vec<_> = directions.filter_map(|direction| farthest(points, |p| p.dot(direction))).collect();
    // these may lie in a plane where others do not
    let from = points[*found.first()?];
    let along = points[farthest(points, |p| p.distance_squared(from))?] - from;
    let across = points[farthest(points, |p| (p - from).cross(along).length_squared())?] - from;
    let normal = along.cross(across).try_normalize()?;
    found.extend([normal, -normal].into_iter().filter_map(|normal| farthest(points, |p| p.dot(normal))));
    found.sort_unstable();
    found.dedup();
    Some(found)
}

fn farthest(points: &[DVec3], how_far: impl Fn(DVec3) -> f64) -> Option<usize> {
    (0..points.len()).max_by(|&a, &b| how_far(points[a]).total_cmp(&how_far(points[b])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How far a point is above a face of the hull of `corners` at most.
    fn above_m(corners: &[DVec3], points: &[DVec3]) -> f64 {
        let middle = corners[0];
        let hull = hull_triangles(&corners.iter().map(|corner| *corner - middle).collect::<Vec<_>>()).unwrap();
        let heights = hull.triangles.iter().flat_map(|triangle| {
            let [a, b, c] = triangle.map(|corner| hull.points[corner as usize]);
            let normal = (b - a).cross(c - a).normalize();
            points.iter().map(move |point| (*point - middle - a).dot(normal))
        });
        heights.fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn what_a_later_corner_leaves_above_a_face_is_found_again() {
        // a wedge so thin that a point beyond its edge is hardly above either face, until another corner makes the edge blunt
        let mut points: Vec<_> = (0..40).map(|k| DVec3::new(f64::from(k % 2), 0.0, 1e-3 * f64::from(k / 2))).collect();
        points.extend((0..20).map(|k| DVec3::new(0.5, 0.02 + 1e-4 * f64::from(k), 1e-2 + 1e-4 * f64::from(k))));
        for tolerance_m in [1e-5, 1e-4, 1e-3] {
            let corners = hull_corners(&points, tolerance_m);
            assert!(above_m(&corners, &points) <= tolerance_m * (1.0 + 1e-2), "{tolerance_m} m");
        }
    }

    #[test]
    fn a_box_of_many_points_has_eight_corners() {
        let part = |k: i32| f64::from(k % 11) * 0.1;
        let lattice: Vec<_> = (0..1331).map(|k| DVec3::new(part(k), part(k / 11), part(k / 121))).collect();
        assert_eq!(hull_corners(&lattice, 0.0).len(), 8);
    }

    #[test]
    fn a_tilted_lens_whose_farthest_points_are_its_rim_is_simplified() {
        let turn = glam::DQuat::from_rotation_arc(DVec3::Z, DVec3::new(0.3, 0.5, 0.8).normalize());
        let lens: Vec<_> = (0..3600)
            .map(|k| {
                let (angle, r) = (0.1 * f64::from(k % 63), f64::from(k / 63) / 57.0);
                turn * DVec3::new(r * libm::cos(angle), r * libm::sin(angle), 2e-2 * (1.0 - r * r))
            })
            .collect();
        let corners = hull_corners(&lens, 1e-4);
        assert!(corners.len() < 900 && above_m(&corners, &lens) <= 1.01e-4, "{} corners", corners.len());
    }

    #[test]
    fn points_in_one_plane_are_left_as_they_are() {
        let flat: Vec<_> = (0..9).map(|k| DVec3::new(f64::from(k % 3), f64::from(k / 3), 0.5)).collect();
        assert_eq!(hull_corners(&flat, 0.1), flat);
        assert_eq!(hull_corners(&flat[..2], 0.1).len(), 2);
        assert!(hull_corners(&[], 0.1).is_empty());
    }
}
