//! Distances against each other: primitives, the same as triangles, and sampling.

use super::signed_distance::{Ball, Field};
use crate::solids::signed_distance;
use crate::space::closest_points::{near_segments, near_triangle};
use crate::{Aabb, Obstacle, Solid};

use glam::{DQuat, DVec3};
use proptest::prelude::*;

fn place(solid: Solid) -> Field {
    let (position, rotation) = (DVec3::new(0.3, -0.2, 0.1), DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -0.7, 1.1));
    Field::new(&Obstacle { position, rotation, ..Obstacle::new("", solid) }).unwrap()
}

fn corners(half: DVec3) -> Vec<DVec3> {
    let sign = |i: u32, bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    (0..8).map(|i| half * DVec3::new(sign(i, 0), sign(i, 1), sign(i, 2))).collect()
}

fn hull(half: DVec3) -> Solid {
    Solid::Hull { points_m: corners(half).into() }
}

const HALF: DVec3 = DVec3::new(0.4, 0.5, 0.6);

fn primitives() -> Vec<Solid> {
    vec![
        Solid::Ball { radius_m: 0.5 },
        Solid::Box { half_extents_m: HALF },
        Solid::Capsule { radius_m: 0.3, half_height_m: 0.4 },
        Solid::Cylinder { radius_m: 0.4, half_height_m: 0.5 },
        Solid::Plane,
    ]
}

fn vector(size: f64) -> impl Strategy<Value = DVec3> {
    [-size..size, -size..size, -size..size].prop_map(DVec3::from_array)
}

fn first(field: &Field, point: DVec3) -> signed_distance::Touch {
    field.touches(point, 10.0).iter().next().expect("everything is within 10 m")
}

proptest! {
    #[test]
    fn the_normal_leads_to_the_surface_at_the_distance(point in vector(1.5)) {
        for solid in primitives() {
            let field = place(solid.clone());
            let touch = first(&field, point);
            prop_assert!((touch.normal.length() - 1.0).abs() < 1e-12);
            let surface = first(&field, point - touch.normal * touch.distance_m);
            // f64: coordinates near 1 and tens of roundings
            prop_assert!(surface.distance_m.abs() < 1e-12, "{solid:?}: {} m off", surface.distance_m);
        }
    }

    /// A box is left out only where all of it is in front of the surface, and is where the surface is beyond the ball around it.
    #[test]
    fn a_box_with_a_point_inside_is_in_and_one_far_outside_is_not(middle in vector(1.5), half in 0.01_f64..0.3) {
        for solid in primitives().into_iter().chain([hull(HALF)]) {
            let (field, around) = (place(solid.clone()), Aabb::about(middle, half));
            let places = corners(DVec3::splat(half)).into_iter().chain([DVec3::ZERO]).map(|by| middle + by);
            let is_in = field.is_in(around, 10.0);
            prop_assert!(is_in || places.into_iter().all(|place| first(&field, place).distance_m > 0.0), "{solid:?}");
            prop_assert!(!is_in || first(&field, middle).distance_m <= 3.0_f64.sqrt() * half + 1e-9, "{solid:?}");
        }
    }

    #[test]
    fn a_hull_of_a_box_has_the_distance_of_the_box(point in vector(1.2)) {
        let (smooth, faces) = (place(Solid::Box { half_extents_m: HALF }), place(hull(HALF)));
        let (a, b) = (first(&smooth, point), first(&faces, point));
        // the corners of the hull went through single precision: 2^-24 of 0.6 m
        prop_assert!((a.distance_m - b.distance_m).abs() < 1e-7, "{} m and {} m", a.distance_m, b.distance_m);
    }

    #[test]
    fn the_lowest_point_of_a_span_agrees_with_sampling(a in vector(1.2), b in vector(1.2), ra in 0.0..0.1, rb in 0.0..0.1) {
        let ends = [Ball { centre: a, radius_m: ra }, Ball { centre: b, radius_m: rb }];
        for solid in primitives() {
            let field = place(solid.clone());
            let gap = |s: f64| {
                let ball = ends[0].toward(ends[1], s);
                first(&field, ball.centre).distance_m - ball.radius_m
            };
            let sampled = (0..=400).map(|i| gap(f64::from(i) / 400.0)).fold(f64::INFINITY, f64::min);
            let found = field.touches_span(ends, 10.0).map_or(f64::INFINITY, |(s, _)| gap(s));
            let ours = found.min(gap(0.0)).min(gap(1.0));
            // near an end the end's own ball answers for 2 % of the span's length
            prop_assert!(ours < sampled + 0.02 * (b - a).length() + 1e-5, "{solid:?}: {ours} m, sampled {sampled} m");
        }
    }

    #[test]
    fn nearest_points_of_segments_beat_sampling(a in vector(1.0), b in vector(1.0), c in vector(1.0), d in vector(1.0)) {
        let (s, t) = near_segments([a, b], [c, d]);
        let apart = |s: f64, t: f64| a.lerp(b, s).distance(c.lerp(d, t));
        for i in 0..=20 {
            for k in 0..=20 {
                let sample = apart(f64::from(i) / 20.0, f64::from(k) / 20.0);
                prop_assert!(apart(s, t) <= sample + 1e-12); // rounding of lengths near 1
            }
        }
    }

    #[test]
    fn the_nearest_point_of_a_triangle_beats_sampling(p in vector(1.0), a in vector(1.0), b in vector(1.0), c in vector(1.0)) {
        let ours = near_triangle(p, [a, b, c]).distance(p);
        for i in 0..=20 {
            for k in 0..=20 - i {
                let q = a + (b - a) * (f64::from(i) / 20.0) + (c - a) * (f64::from(k) / 20.0);
                prop_assert!(ours <= q.distance(p) + 1e-12); // rounding of lengths near 1
            }
        }
    }
}

#[test]
fn parallel_and_pointlike_segments_have_a_stable_answer() {
    let line = |x0: f64, x1: f64, y: f64| [DVec3::new(x0, y, 0.0), DVec3::new(x1, y, 0.0)];
    let (s, t) = near_segments(line(0.0, 4.0, 0.0), line(2.0, 6.0, 1.0));
    assert_eq!((s, t), (0.75, 0.25)); // the middle of 2 … 4
    let (s, t) = near_segments(line(0.0, 1.0, 0.0), line(3.0, 2.0, 1.0));
    assert_eq!((s, t), (1.0, 1.0));
    let (s, t) = near_segments(line(0.5, 0.5, 0.0), line(0.0, 1.0, 1.0));
    assert_eq!((s, t), (0.0, 0.5));
}

/// A mesh in world axes: quads split in two.
fn quads(quads: &[[DVec3; 4]]) -> Field {
    let points: Vec<DVec3> = quads.iter().flatten().copied().collect();
    let triangles: Vec<[u32; 3]> =
        (0..quads.len() as u32).flat_map(|q| [[4 * q, 4 * q + 1, 4 * q + 2], [4 * q, 4 * q + 2, 4 * q + 3]]).collect();
    let solid = Solid::Mesh { points_m: points.into(), triangles: triangles.into() };
    Field::new(&Obstacle::new("", solid)).unwrap()
}

fn quad(corners: [[f64; 3]; 4]) -> [DVec3; 4] {
    corners.map(DVec3::from_array)
}

fn room() -> Field {
    quads(&[
        quad([[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]), // floor
        quad([[0., 0., 0.], [0., 0., 1.], [1., 0., 1.], [1., 0., 0.]]), // wall facing +y
        quad([[0., 0., 0.], [0., 1., 0.], [0., 1., 1.], [0., 0., 1.]]), // wall facing +x
    ])
}

#[test]
fn a_ball_in_the_corner_of_a_room_touches_three_walls() {
    let touches: Vec<_> = room().touches(DVec3::new(0.1, 0.2, 0.3), 0.5).iter().collect();
    assert_eq!(touches.iter().map(|t| t.normal).collect::<Vec<_>>(), [DVec3::X, DVec3::Y, DVec3::Z]);
    for (touch, expected) in touches.iter().zip([0.1, 0.2, 0.3]) {
        assert!((touch.distance_m - expected).abs() < 1e-15); // one rounding
    }
}

#[test]
fn a_floor_of_many_triangles_gives_one_contact() {
    let tile = |x: f64, y: f64| quad([[x, y, 0.], [x + 0.1, y, 0.], [x + 0.1, y + 0.1, 0.], [x, y + 0.1, 0.]]);
    let tiles: Vec<_> = (0..100).map(|i| tile(f64::from(i % 10) * 0.1, f64::from(i / 10) * 0.1)).collect();
    let floor = quads(&tiles);
    for i in 0..50 {
        let x = 0.1 + 0.8 * f64::from(i) / 50.0;
        let touches: Vec<_> = floor.touches(DVec3::new(x, 0.5, 0.02), 0.1).iter().collect();
        assert_eq!(touches.len(), 1);
        assert!((touches[0].normal - DVec3::Z).length() < 1e-12 && (touches[0].distance_m - 0.02).abs() < 1e-15);
    }
    let sunk: Vec<_> = floor.touches(DVec3::new(0.53, 0.51, -0.02), 0.1).iter().collect();
    assert!(sunk.len() == 1 && sunk[0].normal == DVec3::Z && (sunk[0].distance_m + 0.02).abs() < 1e-15);
}

#[test]
fn a_thin_plate_touches_on_the_near_side_only() {
    let plate = Field::new(&Obstacle::new("", hull(DVec3::new(1.0, 1.0, 0.001)))).unwrap();
    for (z, normal, distance) in [(0.01, DVec3::Z, 0.009), (-0.01, DVec3::NEG_Z, 0.009), (0.0005, DVec3::Z, -0.0005)] {
        let touches: Vec<_> = plate.touches(DVec3::new(0.1, 0.2, z), 0.1).iter().collect();
        assert_eq!(touches.len(), 1, "at z = {z} m");
        assert!((touches[0].normal - normal).length() < 1e-6); // single precision corners
        assert!((touches[0].distance_m - distance).abs() < 1e-9);
    }
}

#[test]
fn nothing_touches_past_and_below_the_rim_of_a_sheet() {
    let sheet = quads(&[quad([[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]])]);
    assert_eq!(sheet.touches(DVec3::new(1.02, 0.5, -0.02), 0.1).iter().count(), 0);
    assert_eq!(sheet.touches(DVec3::new(1.02, 0.5, 0.02), 0.1).iter().count(), 1);
}

#[test]
fn a_span_over_a_ridge_touches_the_ridge() {
    let ridge = quads(&[
        quad([[0., -1., 0.], [0., 1., 0.], [-1., 1., -1.], [-1., -1., -1.]]),
        quad([[0., 1., 0.], [0., -1., 0.], [1., -1., -1.], [1., 1., -1.]]),
    ]);
    let ball = |x: f64| Ball { centre: DVec3::new(x, 0.3, 0.05), radius_m: 0.02 };
    let (share, touch) = ridge.touches_span([ball(-0.1), ball(0.3)], 0.1).unwrap();
    assert!((share - 0.25).abs() < 1e-12 && (touch.normal - DVec3::Z).length() < 1e-12);
    assert!((touch.distance_m - 0.05).abs() < 1e-12); // a few roundings
    assert!(ridge.touches_span([ball(-0.1), ball(0.3)], 0.02).is_none()); // its gap is 0.03 m
}
