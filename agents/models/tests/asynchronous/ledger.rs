//! Contact by ledger between rigid bodies.

use super::clocks::Clocks;
use glam::DVec3;
use metachron_contact::Law;
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};

fn ball(position: DVec3, velocity: DVec3, mass_kg: f64, restitution: f64) -> RigidBody {
    let spec = RigidSpec::free(Solid::Ball { radius_m: 0.05 }, position, mass_kg);
    RigidBody::new(RigidSpec { velocity, restitution, gravity: DVec3::ZERO, ..spec }).unwrap()
}

/// Velocities of two balls after an impact at 1 m/s, and the largest error of momentum on the way, as a share of it.
fn collide(masses_kg: [f64; 2], rates_hz: [f64; 2], restitution: f64, due: bool) -> ([f64; 2], f64) {
    let mut clocks = Clocks::new(Law::Ledger, &[]);
    clocks.due = due;
    clocks.add(ball(DVec3::ZERO, DVec3::X, masses_kg[0], restitution), rates_hz[0]);
    clocks.add(ball(DVec3::new(0.3, 0.0, 0.0), DVec3::ZERO, masses_kg[1], restitution), rates_hz[1]);
    let mut worst = 0.0_f64;
    clocks.play(0.8, |clocks, _| {
        let momentum = |at: usize| clocks.rigid(at).velocity * masses_kg[at] + clocks.in_flight(at);
        worst = worst.max((momentum(0) + momentum(1) - DVec3::X * masses_kg[0]).length() / masses_kg[0]);
    });
    ([clocks.rigid(0).velocity.x, clocks.rigid(1).velocity.x], worst)
}

const RATES_HZ: [[f64; 2]; 6] =
    [[240.0, 240.0], [1000.0, 240.0], [1000.0, 60.0], [60.0, 1000.0], [1000.0, 10.0], [10.0, 1000.0]];

#[test]
fn blows_between_clocks_keep_momentum_to_rounding_and_obey_restitution() {
    for due in [false, true] {
        for restitution in [0.0, 0.5, 1.0] {
            for mass in [1e-3, 0.1, 1.0, 10.0, 1000.0] {
                for rates in RATES_HZ {
                    let ([a, b], momentum) = collide([1.0, mass], rates, restitution, due);
                    let share = mass / (1.0 + mass);
                    let closed = [1.0 - (1.0 + restitution) * share, (1.0 + restitution) * (1.0 - share)];
                    let off = (a - closed[0]).abs().max((b - closed[1]).abs());
                    let case = format!("due {due}, e {restitution}, mass {mass}, {rates:?} Hz");
                    // measured: 2e-3; bodies that stay together push each other out of 20 µm
                    assert!(off < 5e-3, "{case}: {a} and {b} m/s, {off} off");
                    // some ten roundings of momenta of up to 2 kg m/s
                    assert!(momentum < 1e-14, "{case}: {momentum}");
                }
            }
        }
    }
}

#[test]
fn the_shorter_step_computes_and_at_equal_steps_the_lower_number() {
    for (rates, computing) in [([240.0, 60.0], 0), ([60.0, 240.0], 1), ([60.0, 60.0], 0)] {
        let mut clocks = Clocks::new(Law::Ledger, &[]);
        clocks.add(ball(DVec3::ZERO, DVec3::X, 1.0, 0.0), rates[0]);
        clocks.add(ball(DVec3::new(0.15, 0.0, 0.0), DVec3::ZERO, 1.0, 0.0), rates[1]);
        clocks.play(0.2, |_, _| ());
        let gives = |at: usize| clocks.all[at].own.given.iter().any(|ledger| !ledger.pages.is_empty());
        assert!(gives(computing) && !gives(1 - computing), "{rates:?}");
    }
}

#[test]
fn nothing_is_allocated_once_warm() {
    let mut clocks = Clocks::new(Law::Ledger, &[]);
    let at = |x: f64| ball(DVec3::X * x, DVec3::ZERO, 1.0, 0.0);
    let [left, right] = [clocks.add(at(0.0), 240.0), clocks.add(at(0.0999), 60.0)];
    for (at, pull) in [(left, 1.0), (right, -1.0)] {
        clocks.all[at].user_springs = vec![super::links::hand(DVec3::X * (0.05 + pull * 0.01), 100.0)];
    }
    let mut late = 0;
    clocks.play(1.0, |clocks, me| {
        if clocks.all[me].time.as_secs_f64() > 0.5 {
            late += clocks.all[me].allocations;
        }
    });
    assert_eq!(late, 0);
}
