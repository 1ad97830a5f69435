//! Contact by ledger between rigid bodies.

use super::clocks::{Clocks, GRAVITY};
use glam::DVec3;
use metachron_contact::Law;
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};

fn ball(position: DVec3, velocity: DVec3, mass_kg: f64, restitution: f64) -> RigidBody {
    let spec = RigidSpec::free(Solid::Ball { radius_m: 0.05 }, position, mass_kg);
    RigidBody::new(RigidSpec { velocity, restitution, gravity: DVec3::ZERO, ..spec }).unwrap()
}

/// Velocities of two balls after a blow at 1 m/s, and the largest error of momentum on the way, as a share of it.
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

#[test]
fn blows_between_clocks_keep_momentum_to_rounding_and_obey_restitution() {
    for due in [false, true] {
        for restitution in [0.0, 0.5, 1.0] {
            for mass in [1e-3, 0.1, 1.0, 10.0, 1000.0] {
                for rates in [[240.0, 240.0], [1000.0, 240.0], [1000.0, 60.0], [60.0, 1000.0], [1000.0, 10.0], [10.0, 1000.0]] {
                    let ([a, b], momentum) = collide([1.0, mass], rates, restitution, due);
                    let share = mass / (1.0 + mass);
                    let closed = [1.0 - (1.0 + restitution) * share, (1.0 + restitution) * (1.0 - share)];
                    let off = (a - closed[0]).abs().max((b - closed[1]).abs());
                    println!("due {due} e {restitution} mass {mass} {rates:?}: {a:.4} {b:.4} off {off:.2e} momentum {momentum:.1e}");
                }
            }
        }
    }
    let _ = GRAVITY;
}
