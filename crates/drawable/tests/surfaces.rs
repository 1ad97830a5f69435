//! Generated meshes as surfaces: none branches, and their hulls keep the few corners that a tolerance asks for.

use glam::DVec3;
use metachron_drawable::{Generator, generate, generate_surface};
use metachron_geometry::{branch, hull_corners, hull_triangles};

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
fn a_ball_of_many_points_keeps_the_few_that_its_tolerance_asks_for() {
    let ball = generate_surface(Generator::Sphere, 0, 20_000).points;
    let mut last = usize::MAX;
    // a cap of height h on a ball of radius r is √(2 r h) wide: corners go as 1/h
    for tolerance_m in [1e-4, 1e-3, 1e-2] {
        let corners = hull_corners(&ball, tolerance_m);
        assert!(above_m(&corners, &ball) <= tolerance_m * (1.0 + 1e-3), "{tolerance_m} m");
        assert!(corners.iter().all(|corner| ball.contains(corner)) && corners.len() < last);
        last = corners.len();
    }
    // triangles of such caps would need 250
    assert!(last < 750, "{last} corners");
}

#[test]
fn far_from_the_origin_a_part_keeps_as_many() {
    let part = generate_surface(Generator::Blob, 3, 4000).points;
    let at = |place: DVec3| part.iter().map(|point| *point * 0.01 + place).collect::<Vec<_>>();
    let [here, there] = [DVec3::ZERO, DVec3::splat(1024.0)].map(|place| hull_corners(&at(place), 1e-5).len());
    // the points themselves are rounded there
    assert!(here > 50 && here.abs_diff(there) <= here / 10, "{here} and {there} corners");
}

#[test]
fn no_generated_mesh_branches() {
    for kind in Generator::ALL {
        for triangles in [12, 700, 5000] {
            let mesh = generate(kind, 3, triangles);
            let points: Vec<DVec3> = mesh.vertices.iter().map(|v| v.core.as_dvec3()).collect();
            assert_eq!(branch(&points, &mesh.triangles, |_| 0), None, "{kind:?} {triangles}");
        }
    }
}
