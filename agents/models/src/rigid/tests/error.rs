//! What a rigid body says of its own error, against closed forms.

use super::*;
use metachron_core::DRIFT_S;

/// Steps in a tenth of a second.
fn steps(dt: f64) -> u32 {
    (DRIFT_S / dt).round() as u32
}

/// What it says after it has made steps of `dt` for a tenth of a second, and how far it then is from `exact` of how it began.
fn estimated_and_true(
    body: &mut RigidBody,
    (dt, pull): (f64, Option<AnchorSpring>),
    exact: impl Fn(DVec3, DVec3) -> DVec3,
) -> [f64; 2] {
    let start = state(body);
    for _ in 0..steps(dt) {
        match pull {
            Some(pull) => drag(body, dt, pull).unwrap(),
            None => step(body, dt),
        };
    }
    let end = state(body);
    [snapshot(body).drift_m, end.position.distance(exact(start.position, start.velocity))]
}

#[test]
fn the_error_of_sliding_is_estimated_to_a_tenth() {
    for dt in [1e-3, 2e-3, 4e-3, 1e-2, 2e-2] {
        let sliding = RigidSpec { velocity: DVec3::X * 4.0, obstacles: [floor(0.5)].into(), ..cube(0.1, UP * 0.1) };
        let mut body = RigidBody::new(sliding).unwrap();
        (0..steps(dt)).for_each(|_| {
            step(&mut body, dt);
        });
        let braked = |x: DVec3, v: DVec3| x + v * DRIFT_S - DVec3::X * (0.25 * G * DRIFT_S * DRIFT_S);
        let [estimated, truth] = estimated_and_true(&mut body, (dt, None), braked);
        // measured: 0.99 … 1.04
        assert!((0.9..1.1).contains(&(estimated / truth)), "{dt} s: said {estimated} m, true {truth} m");
    }
}

#[test]
fn the_error_of_a_spring_is_estimated_to_a_fifth() {
    for (dt, stiffness) in [(1e-3, 5.0), (4e-3, 5.0), (2e-2, 5.0), (1e-3, 50.0), (4e-3, 50.0)] {
        let free = RigidSpec { gravity: DVec3::ZERO, ..ball(1.0, 0.0) };
        let mut body = RigidBody::new(RigidSpec { obstacles: [].into(), ..free }).unwrap();
        let target = state(&body).position + DVec3::X;
        let pull = AnchorSpring { damping_n_s_m: 0.0, ..hand(target, stiffness) };
        (0..steps(dt)).for_each(|_| {
            drag(&mut body, dt, pull).unwrap();
        });
        let omega = (stiffness / 0.5_f64).sqrt();
        let swung = |x: DVec3, v: DVec3| {
            target + (x - target) * libm::cos(omega * DRIFT_S) + v * (libm::sin(omega * DRIFT_S) / omega)
        };
        let [estimated, truth] = estimated_and_true(&mut body, (dt, Some(pull)), swung);
        // measured: 0.94 … 1.02
        assert!(
            (0.8..1.2).contains(&(estimated / truth)),
            "{stiffness} N/m, {dt} s: said {estimated} m, true {truth} m"
        );
    }
}

#[test]
fn flight_and_rest_make_no_error() {
    let mut flying = RigidBody::new(RigidSpec { velocity: DVec3::X, ..cube(0.1, UP * 9.0) }).unwrap();
    (0..10).for_each(|_| {
        step(&mut flying, 0.1);
    });
    assert_eq!(snapshot(&flying).drift_m, 0.0);
    let mut lying = RigidBody::new(RigidSpec { obstacles: [floor(0.5)].into(), ..cube(0.1, UP * 0.1) }).unwrap();
    (0..200).for_each(|_| {
        step(&mut lying, 0.01);
    });
    assert_eq!(snapshot(&lying).drift_m, 0.0);
}
