//! Stacks and piles: they stand, whatever stands on them, and slide where they must.

use super::*;

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
