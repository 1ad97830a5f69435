//! Rays, casts, nearest points, overlaps and contacts against closed forms.

use glam::{DQuat, DVec3};
use metachron_core::SimSpan;
use metachron_geometry::Solid;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Cast, Rigid, Scene, Touched, Tube, World};
use std::f64::consts::FRAC_PI_4;

fn world() -> World {
    let ball = Rigid::ball(0.1).at([0.0, 0.0, 1.0]);
    let block = Rigid::cuboid([0.1, 0.2, 0.3]).at([2.0, 0.0, 1.0]).turned(DQuat::from_rotation_z(FRAC_PI_4));
    let tube = Tube::along(&[[4.0, -0.5, 1.0], [4.0, 0.5, 1.0]]).radius_m(0.05).segments(10);
    let scene = Scene::builder().gravity([0.0; 3]).fixed("floor", Solid::Plane).add("ball", ball).add("block", block);
    World::start(&scene.add("tube", tube).build().unwrap(), ExecutorKind::Lockstep).unwrap()
}

#[test]
fn a_ray_meets_what_is_first_on_its_way() {
    let world = world();
    let [ball, block, tube] = world.objects(["ball", "block", "tube"]).unwrap().map(Touched::Object);
    let ray = |from: [f64; 3], to: [f64; 3], reach_m: f64| world.cast_ray(from.into(), to.into(), reach_m).unwrap();
    // the ball: off its centre by 0.06, so 0.08 before it
    let hit = ray([-1.0, 0.06, 1.0], [3.0, 0.0, 0.0], 10.0).unwrap();
    assert_eq!(hit.what, ball);
    assert!((hit.distance_m - 0.92).abs() < 1e-4, "{hit:?}");
    assert!((hit.normal - DVec3::new(-0.8, 0.6, 0.0)).length() < 1e-3, "{hit:?}");
    assert!((hit.point_m - DVec3::new(-0.08, 0.06, 1.0)).length() < 1e-4, "{hit:?}");
    // past it a face of the block, whose half edge along the diagonal is 0.1
    let hit = ray([1.0, 1.0, 1.0], [1.0, -1.0, 0.0], 10.0);
    let to_face_m = 2.0_f64.sqrt() - 0.1;
    assert!(hit.is_some_and(|hit| hit.what == block), "{hit:?}");
    let distance_m = hit.unwrap().distance_m;
    assert!(
        (distance_m - to_face_m).abs() < 1e-4 || (distance_m - (2.0_f64.sqrt() - 0.2)).abs() < 1e-4,
        "{distance_m}"
    );
    let hit = ray([4.0, 0.1, 0.2], [0.0, 0.0, 1.0], 10.0).unwrap();
    assert_eq!(hit.what, tube);
    assert!((hit.distance_m - 0.75).abs() < 1e-4, "{hit:?}");
    let hit = ray([10.0, 0.0, 2.0], [0.0, 1.0, -1.0], 10.0).unwrap();
    assert_eq!(hit.what, Touched::Fixed(0));
    assert!((hit.distance_m - 2.0 * 2.0_f64.sqrt()).abs() < 1e-4, "{hit:?}");
    assert_eq!(ray([10.0, 0.0, 2.0], [0.0, 1.0, -1.0], 2.0), None, "too short");
    assert_eq!(ray([10.0, 0.0, 2.0], [0.0, 0.0, 1.0], 1e3), None, "upwards there is nothing");
    assert!(world.cast_ray(DVec3::ZERO, DVec3::ZERO, 1.0).is_err());
    assert!(world.cast_ray(DVec3::NAN, DVec3::X, 1.0).is_err());
}

#[test]
fn a_ball_that_is_cast_stops_where_the_two_touch() {
    let world = world();
    let solid = Solid::Ball { radius_m: 0.2 };
    let cast = Cast {
        solid: &solid,
        rotation: DQuat::IDENTITY,
        from_m: DVec3::new(-2.0, 0.0, 1.0),
        direction: DVec3::X,
        reach_m: 10.0,
    };
    let hit = world.cast(&cast).unwrap().unwrap();
    assert!((hit.distance_m - 1.7).abs() < 1e-4, "{hit:?}");
    assert!((hit.point_m - DVec3::new(-0.1, 0.0, 1.0)).length() < 1e-4, "{hit:?}");
    let down = world.cast(&Cast { direction: -DVec3::Z, ..cast }).unwrap().unwrap();
    assert!((down.distance_m - 0.8).abs() < 1e-4 && down.what == Touched::Fixed(0), "{down:?}");
    let plane = Cast { solid: &Solid::Plane, ..cast };
    assert!(world.cast(&plane).is_err());
}

#[test]
fn the_nearest_point_and_what_overlaps_are_found() {
    let world = world();
    let ball = Touched::Object(world.object("ball").unwrap());
    let hit = world.nearest(DVec3::new(0.0, 0.0, 1.5), 1.0).unwrap().unwrap();
    assert_eq!(hit.what, ball);
    assert!((hit.distance_m - 0.4).abs() < 1e-5 && (hit.point_m - DVec3::Z * 1.1).length() < 1e-5, "{hit:?}");
    assert_eq!(world.nearest(DVec3::new(0.0, 0.0, 1.5), 0.3).unwrap(), None);
    let large = Solid::Ball { radius_m: 0.3 };
    let found = world.overlapping(&large, DVec3::new(0.25, 0.0, 1.0), DQuat::IDENTITY).unwrap();
    assert_eq!(found.len(), 1);
    assert!(found[0].what == ball && (found[0].distance_m + 0.15).abs() < 1e-5, "{found:?}");
    assert!(world.overlapping(&large, DVec3::new(0.0, 5.0, 1.0), DQuat::IDENTITY).unwrap().is_empty());
}

#[test]
fn contacts_bear_the_weight_of_what_lies_on_them_from_both_sides() {
    let lower = Rigid::cuboid([0.2, 0.2, 0.1]).mass_kg(3.0).at([0.0, 0.0, 0.1]);
    let upper = Rigid::ball(0.05).mass_kg(0.5).at([0.0, 0.0, 0.25]);
    let scene = Scene::builder().fixed("floor", Solid::Plane).add("lower", lower).add("upper", upper).build().unwrap();
    let world = World::start(&scene, ExecutorKind::Lockstep).unwrap();
    let [lower, upper] = world.objects(["lower", "upper"]).unwrap();
    world.advance(SimSpan::from_millis(1500));
    let of_upper = world.contacts(upper).unwrap();
    let [contact] = of_upper.as_slice() else { panic!("{of_upper:?}") };
    assert_eq!(contact.with, Touched::Object(lower));
    assert!((contact.force_n - DVec3::Z * 0.5 * 9.81).length() < 0.01, "{contact:?}");
    assert!((contact.point_m - DVec3::Z * 0.2).length() < 1e-3 && contact.normal.z > 0.999, "{contact:?}");
    let mut of_lower = world.contacts(lower).unwrap();
    of_lower.sort_by_key(|contact| contact.with);
    let [with_upper, with_floor] = of_lower.as_slice() else { panic!("{of_lower:?}") };
    assert_eq!((with_upper.with, with_floor.with), (Touched::Object(upper), Touched::Fixed(0)));
    assert!((with_upper.force_n + contact.force_n).length() < 1e-9);
    assert!((with_floor.force_n - DVec3::Z * 3.5 * 9.81).length() < 0.05, "{with_floor:?}");
}
