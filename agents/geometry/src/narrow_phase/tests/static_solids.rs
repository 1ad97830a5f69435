//! Static solids and bodies of every kind against closed forms.

use super::surfaces::{block_skin, flat_sheet};
use super::*;
use crate::{Obstacle, ShapeError, StaticSolid, StaticSolidError};

fn obstacle(solid: Solid, position: DVec3, rotation: DQuat) -> Obstacle {
    Obstacle { position, rotation, ..Obstacle::new("ground", solid) }
}

/// A square of two triangles about the origin at z = 0, facing up: half as wide as this, metres.
fn square(half_m: f64) -> Solid {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let points_m = corners.iter().map(|&(x, y)| DVec3::new(x, y, 0.0) * half_m).collect();
    Solid::Mesh { points_m, triangles: [[0, 1, 2], [0, 2, 3]].into() }
}

/// A floor at z = 0 as a plane, a slab, a square and the same among many triangles.
fn floors() -> Vec<StaticSolid> {
    let half = DVec3::new(2.0, 2.0, 0.5);
    let tiles = || {
        let at = |i: u32, j: u32| DVec3::new(0.01 + 0.05 * f64::from(i) - 1.0, 0.02 + 0.05 * f64::from(j) - 1.0, 0.0);
        let points_m = (0..=40).flat_map(|i| (0..=40).map(move |j| at(i, j))).collect();
        let corner = |i: u32, j: u32| 41 * i + j;
        let square = move |i, j| {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            [[a, b, c], [a, c, d]]
        };
        Solid::Mesh { points_m, triangles: (0..40).flat_map(|i| (0..40).flat_map(move |j| square(i, j))).collect() }
    };
    [
        obstacle(Solid::Plane, DVec3::ZERO, DQuat::IDENTITY),
        obstacle(Solid::Box { half_extents_m: half }, DVec3::Z * -0.5, DQuat::IDENTITY),
        obstacle(square(2.0), DVec3::ZERO, DQuat::IDENTITY),
        obstacle(tiles(), DVec3::ZERO, DQuat::IDENTITY),
    ]
    .iter()
    .map(|obstacle| StaticSolid::new(obstacle).unwrap())
    .collect()
}

fn on(solid: &StaticSolid, body: &PlacedShape<'_>, reach_m: f64) -> Vec<Touch> {
    let mut into = Vec::new();
    solid.touches(body, reach_m, &mut NarrowPhaseScratch::default(), &mut into);
    into
}

#[test]
fn every_kind_of_body_rests_on_every_kind_of_floor_at_its_gap() {
    let turn = DQuat::from_rotation_z(0.4);
    let tube = [DVec3::new(-0.05, 0.013, 0.02), DVec3::new(0.0, 0.017, 0.02), DVec3::new(0.06, 0.01, 0.02)];
    let ((skin, places), (block, corners)) = (flat_sheet(), block_skin());
    let lying = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    let (chain, tool) = (chain(), tool());
    let solids = [
        (ball(0.03), 0.03, turn, 1),
        (capsule(0.02, 0.04), 0.02, turn * lying, 2),
        (cuboid(DVec3::new(0.02, 0.03, 0.04)), 0.04, turn, 4),
        (cylinder(0.03, 0.02), 0.02, turn, 4),
        (cylinder(0.03, 0.02), 0.03, turn * lying, 2),
        (hull(DVec3::new(0.02, 0.03, 0.04)), 0.04, turn, 4),
    ];
    for (number, floor) in floors().iter().enumerate() {
        for gap_m in [5e-4, 1e-6, -2e-5, -4e-4] {
            let check = |name: &str, found: &[Touch], gap_m: f64, least: usize, rounding_m: f64| {
                assert!(found.len() >= least, "{name} on floor {number} at {gap_m}: {found:?}");
                let nearest = lowest(found);
                assert!((nearest.gap_m - gap_m).abs() < rounding_m, "{name} on floor {number}, {gap_m}: {nearest:?}");
                assert!(found.iter().all(|touch| touch.normal.distance(DVec3::Z) < 1e-6), "{name} {number}: {found:?}");
                assert!(found.windows(2).all(|pair| pair[0].key < pair[1].key));
            };
            for (form, height_m, rotation, least) in &solids {
                let body = at(form, DVec3::new(0.013, 0.017, height_m + gap_m), *rotation);
                // places are clipped in single precision: an ulp of 5 cm
                check(&format!("{:?}", form.kind), &on(floor, &body, 1e-3), gap_m, *least, 1e-8);
            }
            let nodes = tube.map(|node| node + DVec3::Z * (gap_m - 0.01));
            check("a tube", &on(floor, &along(&chain, &nodes, &[0.01; 3]), 1e-3), gap_m, 3, 1e-15);
            let raised: Vec<_> = places.iter().map(|at| *at + DVec3::Z * (gap_m + 1e-3)).collect();
            let sheet = PlacedShape { form: &skin, view: ShapePose::Surface(&raised) };
            check("a sheet", &on(floor, &sheet, 1e-3), gap_m, places.len(), 1e-15);
            let raised: Vec<_> = corners.iter().map(|at| *at + DVec3::Z * gap_m).collect();
            let solid = PlacedShape { form: &block, view: ShapePose::Surface(&raised) };
            check("a soft block", &on(floor, &solid, 1e-3), gap_m, 4, 1e-15);
            // the shaft of 2.5 mm lies along x; the widest part near the tip is 1.12 times as wide
            let tip = DVec3::new(0.1, 0.0, 1.12 * 2.5e-3 + gap_m);
            let body = PlacedShape { form: &tool, view: ShapePose::Tool { tip, rotation: lying, jaw: 0.0 } };
            check("a tool", &on(floor, &body, 1e-3), gap_m, 2, 2e-6);
        }
    }
}

#[test]
fn a_body_deep_in_a_plane_is_pushed_back_through_it() {
    let floor = StaticSolid::new(&obstacle(Solid::Plane, DVec3::ZERO, DQuat::IDENTITY)).unwrap();
    for form in [ball(0.03), cuboid(DVec3::splat(0.03)), cylinder(0.03, 0.03)] {
        for depth_m in [0.1, 1.0, 30.0] {
            let found = on(&floor, &at(&form, DVec3::new(0.3, 0.1, -depth_m), DQuat::IDENTITY), 1e-3);
            let deepest = lowest(&found);
            assert!(deepest.normal.distance(DVec3::Z) < 1e-6, "{depth_m}: {deepest:?}");
            assert!((deepest.gap_m + depth_m + 0.03).abs() < 1e-6 * (1.0 + depth_m), "{depth_m}: {deepest:?}");
        }
    }
}

#[test]
fn gaps_over_a_mesh_stay_exact_far_from_its_origin_and_over_large_triangles() {
    let form = cuboid(DVec3::new(0.02, 0.03, 0.04));
    for solid in [square(2e3), square(1.9)] {
        let Solid::Mesh { points_m, triangles } = &solid else { unreachable!() };
        // the mesh's own coordinates are far from its origin
        let away = DVec3::new(1200.3, -700.7, 0.0);
        let points_m = points_m.iter().map(|point| *point + away).collect();
        let floor = Solid::Mesh { points_m, triangles: triangles.clone() };
        let floor = StaticSolid::new(&obstacle(floor, DVec3::ZERO, DQuat::IDENTITY)).unwrap();
        for gap_m in [3e-4, -2e-5] {
            let place = away + DVec3::new(0.41, 0.33, 0.04 + gap_m);
            let found = on(&floor, &at(&form, place, DQuat::from_rotation_z(0.2)), 1e-3);
            assert!(found.len() >= 4, "{found:?}");
            assert!(found.iter().all(|touch| (touch.gap_m - gap_m).abs() < 1e-8), "{gap_m}: {found:?}");
        }
    }
}

#[test]
fn an_open_static_mesh_is_a_sheet_and_no_hull() {
    // two walls of a valley: a body in it touches neither
    let points_m = [(-1.0, 1.0), (0.0, 0.0), (1.0, 1.0)].map(|(x, z)| [-1.0, 1.0].map(|y| DVec3::new(x, y, z)));
    let triangles = [[0, 1, 3], [0, 3, 2], [2, 3, 5], [2, 5, 4]].map(|[a, b, c]| [a, c, b]);
    let valley = Solid::Mesh { points_m: points_m.concat().into(), triangles: triangles.into() };
    let valley = StaticSolid::new(&obstacle(valley, DVec3::ZERO, DQuat::IDENTITY)).unwrap();
    let (chain, (skin, places)) = (chain(), flat_sheet());
    let nodes = [DVec3::new(-0.1, 0.0, 0.6), DVec3::new(0.1, 0.0, 0.6)];
    assert!(on(&valley, &along(&chain, &nodes, &[0.01; 2]), 1e-3).is_empty());
    let raised: Vec<_> = places.iter().map(|at| *at + DVec3::Z * 0.6).collect();
    assert!(on(&valley, &PlacedShape { form: &skin, view: ShapePose::Surface(&raised) }, 1e-3).is_empty());
    assert!(on(&valley, &at(&ball(0.05), DVec3::Z * 0.6, DQuat::IDENTITY), 1e-3).is_empty());
    // far behind a wall is outside, too
    let below = nodes.map(|node| node - DVec3::Z * 1.6);
    assert!(on(&valley, &along(&chain, &below, &[0.01; 2]), 1e-3).is_empty());
    // a ball of a tube in the bottom touches both walls
    let lowest_m = 0.01 * 2.0_f64.sqrt() + 2e-4;
    let nodes = [DVec3::new(0.0, -0.1, lowest_m), DVec3::new(0.0, 0.1, lowest_m)];
    let found = on(&valley, &along(&chain, &nodes, &[0.01; 2]), 1e-3);
    assert_eq!(found.len(), 4, "{found:?}");
    assert!(found.iter().all(|touch| (touch.gap_m - 2e-4 / 2.0_f64.sqrt()).abs() < 1e-12));
}

#[test]
fn the_box_around_a_static_solid_is_the_smallest() {
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 0.7, -0.2);
    let place = DVec3::new(0.3, -1.0, 2.0);
    let points: std::sync::Arc<[DVec3]> = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].into();
    let solids = [
        Solid::Ball { radius_m: 0.3 },
        Solid::Box { half_extents_m: DVec3::new(0.1, 0.2, 0.3) },
        Solid::Capsule { radius_m: 0.1, half_height_m: 0.4 },
        Solid::Cylinder { radius_m: 0.2, half_height_m: 0.4 },
        Solid::Hull { points_m: points },
    ];
    for solid in solids {
        let ground = StaticSolid::new(&obstacle(solid.clone(), place, turn)).unwrap();
        // the support along each axis, from the collision shape itself
        let shape = solid.to_shared_shape().unwrap();
        let parts = shape.as_compound().map(|parts| parts.shapes()[0].clone());
        let (local, shape) = parts.unwrap_or((rapier3d::parry::math::Pose::IDENTITY, shape));
        let far = |way: DVec3| {
            let local_way = local.rotation.inverse() * (turn.conjugate() * way).as_vec3();
            let point = local * shape.as_support_map().unwrap().local_support_point(local_way);
            (place + turn * point.as_dvec3()).dot(way)
        };
        for axis in DVec3::AXES {
            assert!((ground.bounds().high.dot(axis) - far(axis)).abs() < 1e-6, "{solid:?} {axis}");
            assert!((ground.bounds().low.dot(axis) + far(-axis)).abs() < 1e-6, "{solid:?} {axis}");
        }
    }
    let plane = StaticSolid::new(&obstacle(Solid::Plane, place, turn)).unwrap();
    assert!(plane.bounds().meets(crate::Aabb::about(DVec3::splat(1e9), 1.0)));
}

#[test]
fn an_invalid_static_solid_is_refused_by_name() {
    let bad = obstacle(Solid::Ball { radius_m: -1.0 }, DVec3::ZERO, DQuat::IDENTITY);
    let source = ShapeError::BadLength { what: "the radius", value_m: -1.0 };
    assert_eq!(StaticSolid::new(&bad).unwrap_err(), StaticSolidError::Shape { name: "ground".into(), source });
    for (position, rotation) in [(DVec3::NAN, DQuat::IDENTITY), (DVec3::ZERO, DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0))] {
        let lost = obstacle(Solid::Plane, position, rotation);
        assert_eq!(StaticSolid::new(&lost).unwrap_err(), StaticSolidError::Place { name: "ground".into() });
    }
}

#[test]
fn nothing_is_allocated_on_static_solids_once_everything_is_known() {
    let (chain, tool, (skin, places)) = (chain(), tool(), flat_sheet());
    let solids = [ball(0.03), capsule(0.02, 0.04), cuboid(DVec3::splat(0.03)), cylinder(0.03, 0.02)];
    let floors = floors();
    let (mut scratch, mut found) = (NarrowPhaseScratch::default(), Vec::new());
    let mut run = |lift: f64, known: bool| {
        let up = DVec3::Z * lift;
        let nodes = [up, up + DVec3::X * 0.03, up + DVec3::X * 0.06];
        let raised: Vec<_> = places.iter().map(|at| *at + up).collect();
        let mut bodies: Vec<_> = solids.iter().map(|form| at(form, up, DQuat::IDENTITY)).collect();
        bodies.push(along(&chain, &nodes, &[0.01; 3]));
        bodies.push(PlacedShape { form: &skin, view: ShapePose::Surface(&raised) });
        let view = ShapePose::Tool { tip: up, rotation: DQuat::IDENTITY, jaw: 0.3 };
        bodies.push(PlacedShape { form: &tool, view });
        for (number, floor) in floors.iter().enumerate() {
            for body in &bodies {
                let info = allocation_counter::measure(|| floor.touches(body, 0.01, &mut scratch, &mut found));
                assert!(
                    !known || info.count_total == 0,
                    "floor {number}: {} allocations, {:?}",
                    info.count_total,
                    body.view
                );
            }
        }
    };
    for known in [false, true] {
        (0..10).for_each(|i| run(5e-3 * f64::from(i), known));
    }
}
