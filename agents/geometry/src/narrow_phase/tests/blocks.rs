//! Boxes, cylinders and hulls against corners and edges, sampling and each other.

use super::*;

const HALF: [DVec3; 2] = [DVec3::new(0.1, 0.15, 0.2), DVec3::new(0.05, 0.2, 0.08)];

/// The distance of two boxes that are apart: the least between a corner and a box or between two edges, in closed form.
fn apart(p: (DVec3, DQuat), q: (DVec3, DQuat)) -> f64 {
    let from_corners =
        |(position, rotation): (DVec3, DQuat), half: DVec3, (centre, turned): (DVec3, DQuat), of: DVec3| {
            let corners = SIGNS.map(|sign| turned.conjugate() * (position + rotation * (sign * half) - centre));
            corners.map(|x| x.distance(x.clamp(-of, of))).into_iter().fold(f64::INFINITY, f64::min)
        };
    let corners = from_corners(p, HALF[0], q, HALF[1]).min(from_corners(q, HALF[1], p, HALF[0]));
    let mine = edges(p, HALF[0]);
    let theirs = edges(q, HALF[1]);
    let between = mine.iter().flat_map(|&u| theirs.iter().map(move |&v| lines_apart(u, v)));
    between.fold(corners, f64::min)
}

const SIGNS: [DVec3; 8] = [
    DVec3::new(-1.0, -1.0, -1.0),
    DVec3::new(-1.0, -1.0, 1.0),
    DVec3::new(-1.0, 1.0, -1.0),
    DVec3::new(-1.0, 1.0, 1.0),
    DVec3::new(1.0, -1.0, -1.0),
    DVec3::new(1.0, -1.0, 1.0),
    DVec3::new(1.0, 1.0, -1.0),
    DVec3::new(1.0, 1.0, 1.0),
];

/// The twelve edges of a box: middle and half the way along.
fn edges((position, rotation): (DVec3, DQuat), half: DVec3) -> Vec<(DVec3, DVec3)> {
    let along = [DVec3::X, DVec3::Y, DVec3::Z].into_iter();
    let of_axis = |axis: DVec3| {
        let across = SIGNS.into_iter().filter(move |sign| sign.dot(axis) > 0.0);
        across.map(move |sign| (position + rotation * ((sign - axis) * half), rotation * (axis * half)))
    };
    along.flat_map(of_axis).collect()
}

/// The distance of two edges where the common perpendicular meets both; infinite elsewhere, where corners are nearest.
fn lines_apart((p, u): (DVec3, DVec3), (q, v): (DVec3, DVec3)) -> f64 {
    let (r, uu, uv, vv) = (q - p, u.dot(u), u.dot(v), v.dot(v));
    let det = uu * vv - uv * uv;
    let (s, t) = ((vv * r.dot(u) - uv * r.dot(v)) / det, (uv * r.dot(u) - uu * r.dot(v)) / det);
    if s.abs() <= 1.0 && t.abs() <= 1.0 { (r + t * v - s * u).length() } else { f64::INFINITY }
}

/// The widest gap between two boxes, the second at `q`, along the fifteen axes that can part them; negative where they overlap.
fn widest_slab(q: DVec3, r: DQuat, s: DQuat) -> f64 {
    let axes = |turned: DQuat| [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| turned * axis);
    let crossed = axes(r).into_iter().flat_map(|u| axes(s).map(|v| u.cross(v)));
    let slab = |axis: DVec3| {
        let radius = |turned: DQuat, half: DVec3| (turned.conjugate() * axis).abs().dot(half);
        q.dot(axis).abs() - radius(r, HALF[0]) - radius(s, HALF[1])
    };
    let all = axes(r).into_iter().chain(axes(s)).chain(crossed);
    all.filter_map(|axis| axis.try_normalize().map(slab)).fold(f64::NEG_INFINITY, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn box_distance_is_that_of_their_corners_and_edges(way in vector(1.0), far in 0.25..0.6, r in turn(), s in turn()) {
        let (first, second) = (cuboid(HALF[0]), cuboid(HALF[1]));
        let q = way.normalize_or(DVec3::X) * far;
        let expected = apart((DVec3::ZERO, r), (q, s));
        prop_assume!(widest_slab(q, r, s) > 1e-3);
        let (normal, gap_m) = nearest(&at(&first, DVec3::ZERO, r), &at(&second, q, s), 1.0).unwrap();
        // corners went through single precision: 2^-24 of 0.2 m each
        prop_assert!((gap_m - expected).abs() < 6e-8, "{gap_m} and {expected}");
        prop_assert!((normal.length() - 1.0).abs() < 1e-12);
        prop_assert!(nearest(&at(&first, DVec3::ZERO, r), &at(&second, q, s), expected - 1e-6).is_none());
    }

    #[test]
    fn boxes_that_overlap_are_parted_along_the_normal(way in vector(1.0), far in 0.0..0.2, r in turn(), s in turn()) {
        let (first, second) = (cuboid(HALF[0]), cuboid(HALF[1]));
        let q = way * far;
        let found = all(&at(&first, DVec3::ZERO, r), &at(&second, q, s), 1e-3);
        prop_assume!(!found.is_empty());
        let deepest = lowest(&found);
        prop_assert!(found.iter().all(|touch| adds_up(touch, &[], &[])));
        // moved out by the depth they no longer overlap, and half way they still do
        let moved = |share: f64| {
            let p = deepest.normal * (-deepest.gap_m * share);
            all(&at(&first, p, r), &at(&second, q, s), 1e-3)
        };
        prop_assert!(moved(1.0).iter().all(|touch| touch.gap_m > -1e-9));
        prop_assert!(deepest.gap_m > -1e-3 || lowest(&moved(0.5)).gap_m < 0.0);
    }

    #[test]
    fn box_overlap_is_that_of_the_fifteen_axis_test(q in vector(0.2), r in turn(), s in turn()) {
        let (first, second) = (cuboid(HALF[0]), cuboid(HALF[1]));
        let expected = widest_slab(q, r, s);
        prop_assume!(expected < 0.0);
        let (normal, gap_m) = nearest(&at(&first, DVec3::ZERO, r), &at(&second, q, s), 0.0).unwrap();
        // corners went through single precision: 2^-24 of 0.2 m
        prop_assert!((gap_m - expected).abs() < 3e-8, "{gap_m} and {expected}");
        prop_assert!(normal.is_normalized());
    }

    #[test]
    fn a_hull_touches_like_the_box_it_is(way in vector(1.0), far in 0.1..0.35, r in turn(), s in turn()) {
        let (smooth, faces, other) = (cuboid(HALF[0]), hull(HALF[0]), cuboid(HALF[1]));
        let q = way.normalize_or(DVec3::X) * far;
        let (a, b) = (at(&smooth, DVec3::ZERO, r), at(&faces, DVec3::ZERO, r));
        let other = at(&other, q, s);
        match (nearest(&a, &other, 0.05), nearest(&b, &other, 0.05)) {
            (Some((_, p)), Some((_, q))) if p > 0.0 => prop_assert!((p - q).abs() < 1e-7, "{p} and {q}"),
            (Some((_, p)), None) | (None, Some((_, p))) => prop_assert!(p > 0.05 - 1e-7),
            _ => {}
        }
    }

    #[test]
    fn no_sampled_points_are_nearer_than_the_gap(q in vector(0.4), r in turn(), s in turn()) {
        let (first, second) = (cylinder(0.1, 0.15), hull(HALF[1]));
        let (a, b) = (at(&first, DVec3::ZERO, r), at(&second, q, s));
        let mut least = f64::INFINITY;
        for i in 0..12 {
            let angle = f64::from(i) * std::f64::consts::TAU / 12.0;
            for z in [-0.15, -0.05, 0.05, 0.15] {
                let p = r * DVec3::new(0.1 * libm::cos(angle), 0.1 * libm::sin(angle), z);
                let inside = s.conjugate() * (p - q);
                least = least.min(inside.distance(inside.clamp(-HALF[1], HALF[1])));
            }
        }
        let found = nearest(&a, &b, 1.0).expect("all is within reach");
        prop_assert!(found.1 <= least, "{} and {least}", found.1);
    }
}

#[test]
fn a_box_on_a_box_rests_on_four_corners_even_far_from_the_origin() {
    let (small, large) = (cuboid(DVec3::splat(0.05)), cuboid(DVec3::new(0.5, 0.5, 0.05)));
    for origin in [DVec3::ZERO, DVec3::new(5e3, -3e3, 1e3)] {
        for turned in [0.0, 0.3, std::f64::consts::FRAC_PI_4] {
            let up = origin + DVec3::new(0.1, 0.05, 0.1001);
            let found =
                all(&at(&small, up, DQuat::from_rotation_z(turned)), &at(&large, origin, DQuat::IDENTITY), 1e-3);
            assert_eq!(found.len(), 4, "{found:?}");
            for touch in &found {
                assert!((touch.normal - DVec3::Z).length() < 1e-6); // single precision
                assert!((touch.gap_m - 1e-4).abs() < 1e-7, "{}", touch.gap_m); // eps of coordinates below 1
            }
        }
    }
}

#[test]
fn boxes_that_match_exactly_touch_at_each_corner_once() {
    let form = cuboid(DVec3::splat(0.05));
    let found = all(&at(&form, DVec3::Z * 0.1, DQuat::IDENTITY), &at(&form, DVec3::ZERO, DQuat::IDENTITY), 1e-3);
    assert_eq!(found.len(), 4, "{found:?}");
}

#[test]
fn a_lying_cylinder_touches_a_box_along_its_side_and_a_standing_one_at_its_rim() {
    let (round, block) = (cylinder(0.05, 0.1), cuboid(DVec3::new(0.5, 0.5, 0.1)));
    let lying = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let floor = at(&block, DVec3::ZERO, DQuat::IDENTITY);
    let side = all(&at(&round, DVec3::Z * 0.15, lying), &floor, 1e-3);
    let span = |found: &[Touch]| {
        let points = found.iter().map(|touch| axis(touch.on_a, &[]).0);
        crate::Aabb::of(&points.collect::<Vec<_>>())
    };
    assert!(side.len() >= 2 && (span(&side).high.y - 0.1).abs() < 1e-5 && (span(&side).low.y + 0.1).abs() < 1e-5);
    let standing = all(&at(&round, DVec3::Z * 0.2, DQuat::IDENTITY), &floor, 1e-3);
    assert!(standing.len() >= 4 && standing.iter().all(|touch| touch.gap_m.abs() < 1e-6), "{standing:?}");
    assert!((span(&standing).high - span(&standing).low).length() > 0.09);
}

#[test]
fn crossed_cylinder_distance_is_that_of_their_axes() {
    let (first, second) = (cylinder(0.05, 0.2), cylinder(0.03, 0.15));
    for angle in [0.0, 0.3, 1.0, 1.5] {
        for gap_m in [0.1, 1e-3, 1e-6, -1e-4, -0.01] {
            let p = DVec3::X * (0.08 + gap_m);
            let turned = DQuat::from_rotation_x(angle);
            let found = nearest(&at(&first, p, DQuat::IDENTITY), &at(&second, DVec3::ZERO, turned), 1.0).unwrap();
            // radii are single precision; a round hull is made of faces
            assert!(found.1 < gap_m + 1e-8 && found.1 > gap_m - 2e-5, "{angle} rad: {} of {gap_m}", found.1);
            assert!(found.0.x > 1.0 - 1e-3, "{angle} rad, {gap_m} m: {}", found.0);
        }
    }
}

#[test]
fn a_mesh_that_is_not_divided_touches_as_its_hull() {
    let ShapeKind::Solid(SolidShape { solid: faces, .. }) = hull(DVec3::splat(0.05)).kind else { unreachable!() };
    let Solid::Hull { points_m } = faces else { unreachable!() };
    let triangles = crate::hull_triangles(&points_m).unwrap();
    let mesh = Solid::Mesh { points_m: triangles.points.into(), triangles: triangles.triangles.into() };
    let (form, floor) = (solid(mesh, 0.1), cuboid(DVec3::new(0.5, 0.5, 0.05)));
    let found = all(&at(&form, DVec3::Z * 0.1, DQuat::IDENTITY), &at(&floor, DVec3::ZERO, DQuat::IDENTITY), 1e-3);
    assert!(found.len() >= 3 && found.iter().all(|touch| touch.gap_m.abs() < 1e-7 && touch.normal.z > 0.999_999));
}

#[test]
fn a_compound_touches_with_each_of_its_parts() {
    let CollisionShape { kind, .. } = cuboid(DVec3::new(0.2, 0.05, 0.05));
    let ShapeKind::Solid(SolidShape { solid: table, .. }) = kind else { unreachable!() };
    // two feet, 0.2 m apart
    let foot = |x: f32| {
        let at = rapier3d::parry::math::Pose::from_parts(glam::Vec3::new(x, 0.0, 0.0), Default::default());
        (at, rapier3d::parry::shape::SharedShape::cuboid(0.02, 0.05, 0.05))
    };
    let shape = rapier3d::parry::shape::SharedShape::compound(vec![foot(-0.1), foot(0.1)]);
    let kind =
        ShapeKind::Solid(SolidShape { solid: table, shape, com_local: DVec3::new(0.0, 0.0, 0.01), radius_m: 0.25 });
    let feet = CollisionShape::new(kind, 0.0);
    let floor = cuboid(DVec3::new(0.5, 0.5, 0.05));
    let standing = at(&feet, DVec3::Z * 0.11, DQuat::IDENTITY);
    let found = all(&standing, &at(&floor, DVec3::ZERO, DQuat::IDENTITY), 1e-3);
    assert_eq!(found.len(), 8, "{found:?}");
    assert!(found.iter().all(|touch| touch.gap_m.abs() < 1e-7));
    let (normal, gap_m) = nearest(&standing, &at(&floor, DVec3::ZERO, DQuat::IDENTITY), 0.1).unwrap();
    assert!(normal.z > 1.0 - 1e-6 && gap_m.abs() < 5e-6);
}
