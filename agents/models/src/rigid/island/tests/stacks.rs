//! Stacks and piles: they stand, whatever stands on them, and slide where they must.

use super::*;
use rapier3d::dynamics::RigidBodyBuilder;
use rapier3d::geometry::{ColliderBuilder, SharedShape};
use rapier3d::parry::math::Vec3;
use rapier3d::pipeline::PhysicsWorld;

/// `count` cubes of 1 m on the floor, a millimetre apart, the top one heavier by `ratio`.
fn stack(count: u32, ratio: f64) -> Party {
    Party::new((0..count).map(|i| RigidSpec {
        obstacles: floor(0.5, DQuat::IDENTITY),
        mass_kg: if i + 1 == count { 1000.0 * ratio } else { 1000.0 },
        ..cube(0.5, DVec3::Z * (0.5 + 1.001 * f64::from(i)))
    }))
}

/// How far the top has sunk below where it belongs and how far any box has gone sideways, metres.
fn lean(party: &Party) -> (f64, f64) {
    let count = party.bodies.len();
    let sink = count as f64 - 0.5 - party.state(count - 1).position.z;
    let aside = (0..count).map(|i| party.state(i).position.truncate().length()).fold(0.0, f64::max);
    (sink, aside)
}

#[test]
fn a_stack_stands_and_does_not_sink_whatever_stands_on_it() {
    for (count, ratio, dt) in [
        (2, 1.0, 1.0 / 60.0),
        (2, 1000.0, 1.0 / 60.0),
        (10, 1.0, 1.0 / 240.0),
        (10, 100.0, 1.0 / 60.0),
        (10, 1000.0, 1.0 / 60.0),
    ] {
        let mut party = stack(count, ratio);
        party.run(dt, 5.0);
        let (sink, aside) = lean(&party);
        // ten single-precision gaps of boxes of 1 m, and the slop of 1e-5 of a box's size at each
        assert!(sink.abs() < 3e-4, "{count} boxes, ratio {ratio}: sank {sink:e} m");
        assert!(aside < 1e-4, "{count} boxes, ratio {ratio}: went {aside:e} m aside");
    }
}

#[test]
fn forty_boxes_carry_a_thousandfold_load() {
    let mut party = stack(40, 1000.0);
    party.run(1.0 / 60.0, 2.0);
    let (sink, aside) = lean(&party);
    // forty single-precision gaps of boxes of 1 m, and the slop of 1e-5 of a box's size at each
    assert!(sink.abs() < 1.2e-3, "sank {sink:e} m");
    assert!(aside < 4e-4, "went {aside:e} m aside");
}

#[test]
fn a_stack_comes_to_rest_as_one() {
    let mut party = stack(5, 1.0);
    let rested = (0..500).find(|_| party.step(0.01).at_rest).expect("it rests within five seconds");
    assert!(rested >= 50, "rested after {rested} steps");
    (0..5).for_each(|i| assert_eq!(party.state(i).velocity, DVec3::ZERO));
}

#[test]
fn merged_boxes_stick_below_the_angle_of_friction_and_slide_above_it() {
    let mu = 0.4;
    let run = |slope: f64| {
        let turn = DQuat::from_rotation_y(slope);
        let mut party = Party::new((0..2).map(|i| RigidSpec {
            obstacles: floor(mu, turn),
            friction: mu,
            rotation: turn,
            ..cube(0.1, turn * DVec3::Z * (0.1 + 0.2 * f64::from(i)))
        }));
        party.run(1.0 / 120.0, 1.0);
        let slid = |i: usize| party.state(i).position.dot(turn * DVec3::X);
        (slid(0), slid(1))
    };
    let (low, high) = run(libm::atan(0.98 * mu));
    assert!(low.abs() < 1e-4 && high.abs() < 1e-4, "crept {low:e} and {high:e} m");
    let slope = libm::atan(1.5 * mu);
    let closed = 0.5 * G * (libm::sin(slope) - mu * libm::cos(slope));
    let (low, high) = run(slope);
    assert!((low / closed - 1.0).abs() < 5e-3, "the lower one slid {low} m, not {closed}");
    assert!((high / closed - 1.0).abs() < 5e-3, "the upper one slid {high} m, not {closed}");
}

#[test]
fn boxes_that_start_inside_each_other_part_and_keep_no_speed() {
    let free = |z: f64| RigidSpec { gravity: DVec3::ZERO, ..cube(0.1, DVec3::Z * z) };
    let mut party = Party::new([free(0.0), free(0.17)]);
    let mut fastest = 0.0_f64;
    for _ in 0..120 {
        party.step(1.0 / 60.0);
        fastest = fastest.max(party.state(0).velocity.length()).max(party.state(1).velocity.length());
    }
    let apart = party.state(1).position.z - party.state(0).position.z;
    // single precision gaps, and the slop of 1e-5 of a box's size
    assert!((apart - 0.2).abs() < 1e-5, "{apart} m apart");
    assert!(fastest < 1e-9, "{fastest} m/s"); // what the solve may miss
}

#[test]
fn a_blow_within_an_island_obeys_newtons_restitution() {
    for (restitution, mass_kg) in [(0.0, 1.0), (0.5, 10.0), (1.0, 1000.0)] {
        let ball = |x: f64, v: f64, mass_kg: f64| RigidSpec {
            velocity: DVec3::X * v,
            gravity: DVec3::ZERO,
            friction: 0.0,
            restitution,
            mass_kg,
            ..spec(Solid::Ball { radius_m: 0.1 }, DVec3::X * x)
        };
        let mut party = Party::new([ball(0.0, 2.0, mass_kg), ball(0.25, 0.0, 1.0)]);
        party.run(0.004, 0.2);
        let (u, w) = (party.state(0).velocity.x, party.state(1).velocity.x);
        let joint = 2.0 * mass_kg / (mass_kg + 1.0);
        let closed =
            [joint - restitution * 2.0 / (mass_kg + 1.0), joint + restitution * 2.0 * mass_kg / (mass_kg + 1.0)];
        assert!((u - closed[0]).abs() < 1e-6 && (w - closed[1]).abs() < 1e-6, "{u} {w} are not {closed:?}");
    }
}

#[test]
fn a_pile_too_large_for_the_direct_solve_settles_in_a_rapier_world() {
    let at = |i: u32| DVec3::new(f64::from(i % 3) * 0.21, f64::from(i / 3 % 3) * 0.21, 0.1 + f64::from(i / 9) * 0.21);
    let mut party =
        Party::new((0..36).map(|i| RigidSpec { obstacles: floor(0.5, DQuat::IDENTITY), ..cube(0.1, at(i)) }));
    party.run(1.0 / 120.0, 3.0);
    for i in 0..36 {
        let (state, low) = (party.state(i), 0.1 + 0.2 * f64::from(i as u32 / 9));
        let sink = low - state.position.z;
        assert!(sink.abs() < 2e-3, "box {i} sank {sink} m"); // a hundredth of its size; the solver's own slop
        assert!(state.velocity.length() < 0.02, "box {i} still moves at {} m/s", state.velocity.length());
    }
}

/// Columns of six cubes of 0.2 m and 1 kg, 0.01 m apart: more than the direct solve takes.
fn columns() -> impl Iterator<Item = DVec3> {
    (0..150_u32)
        .map(|i| DVec3::new(f64::from(i % 5) * 0.21, f64::from(i / 5 % 5) * 0.21, 0.1 + f64::from(i / 25) * 0.2))
}

/// How deep a cube of [`columns`] sank at most, metres.
fn sunk_m(heights: &[f64]) -> f64 {
    columns().zip(heights).map(|(at, z)| at.z - z).fold(0.0, f64::max)
}

/// The same cubes in a world with rapier's own settings, after so many seconds.
fn plain_heights(seconds: f64) -> Vec<f64> {
    let mut world = PhysicsWorld { gravity: Vec3::Z * -G as f32, ..PhysicsWorld::default() };
    (world.integration_parameters.dt, world.integration_parameters.length_unit) = (1.0 / 240.0, 0.346);
    world.colliders.insert(ColliderBuilder::new(SharedShape::halfspace(Vec3::Z)).friction(0.5));
    let cubes: Vec<_> = columns()
        .map(|at| {
            let body = RigidBodyBuilder::dynamic().translation(at.as_vec3()).can_sleep(false);
            world.insert(body, ColliderBuilder::cuboid(0.1, 0.1, 0.1).mass(1.0).friction(0.5)).0
        })
        .collect();
    (0..(240.0 * seconds) as u32).for_each(|_| world.step());
    cubes.iter().map(|cube| f64::from(world.bodies[*cube].translation().z)).collect()
}

#[test]
fn equal_boxes_sink_less_than_with_the_solvers_own_settings_and_stay_where_they_are() {
    let cubes = columns().map(|at| RigidSpec { obstacles: floor(0.5, DQuat::IDENTITY), sleep: false, ..cube(0.1, at) });
    let mut party = Party::new(cubes);
    let mut heights = |seconds: f64| -> Vec<f64> {
        party.run(1.0 / 60.0, seconds);
        (0..150).map(|i| party.state(i).position.z).collect()
    };
    let (early, late, own) = (heights(2.0), heights(2.0), plain_heights(4.0));
    // six single-precision gaps: 1e-4 m is measured
    assert!(sunk_m(&late) < 3e-4, "sank {:e} m", sunk_m(&late));
    // six contacts that each bear what is above at 30 Hz: 8.7 mm is measured
    assert!(sunk_m(&late) < 0.1 * sunk_m(&own), "rapier's own settings: {:e} m", sunk_m(&own));
    let crept = early.iter().zip(&late).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(crept < 3e-4, "crept by {crept:e} m in two seconds");
}
