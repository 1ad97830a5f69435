//! Rigid bodies with different clocks that bounce on each other and on the ground without loss: energy stays.

use super::*;
use crate::harness::{Faults, Stage};

const RADIUS: f64 = 0.05;

/// Two balls of these masses fall on each other and on the floor without loss, the second above the first: the least and the
/// most energy at a common time within `seconds`, as shares of the start.
fn juggle(rates: [f64; 2], masses: [f64; 2], faults: Faults, seconds: f64) -> [f64; 2] {
    let mut stage = Stage::new(faults);
    let ground = Obstacle { restitution: 1.0, ..floor(0.0) };
    let heights = [0.15, 0.4];
    let ids = [0, 1].map(|i| {
        let solid = Solid::Ball { radius_m: RADIUS };
        let ball = RigidSpec {
            mass_kg: masses[i],
            restitution: 1.0,
            friction: 0.0,
            obstacles: [ground.clone()].into(),
            ..spec(solid, UP * heights[i])
        };
        stage.add(RigidBody::new(ball).unwrap(), rates[i])
    });
    let start: f64 = masses.iter().zip(heights).map(|(m, z)| m * G * z).sum();
    let (mut least, mut most) = (1.0_f64, 1.0_f64);
    stage.run(seconds, |stage| {
        let now = stage.newest(ids[0]).time.as_secs_f64();
        let energy = |i: usize| {
            let settled = stage.settled(ids[i], now);
            settled.kinetic_j() + masses[i] * G * settled.state.position.z
        };
        let share = (energy(0) + energy(1)) / start;
        (least, most) = (least.min(share), most.max(share));
    });
    [least, most]
}

/// What others gave to a slow body that has met the ground since comes with the way that it would have carried it: neither the
/// way nor the blow may add energy, nor the next touch on the way back take it. What strikes a body that stands is carried by the
/// ground, which does not throw it back.
#[test]
fn bodies_that_bounce_without_loss_keep_their_energy_at_any_rates() {
    let rates =
        [[240.0, 240.0], [1000.0, 60.0], [60.0, 1000.0], [240.0, 100.0], [60.0, 50.0], [20.0, 240.0], [240.0, 20.0]];
    for masses in [[0.5, 0.5], [0.5, 0.2], [0.2, 0.5]] {
        for (rates, seed) in rates.into_iter().flat_map(|rates| (0..6).map(move |seed| (rates, seed))) {
            let jitter = if seed == 0 { 0.0 } else { 0.2 };
            let [least, most] = juggle(rates, masses, Faults { jitter, seed, ..Faults::default() }, 20.0);
            let case = format!("{masses:?} kg, {rates:?} Hz, jitter {jitter}, seed {seed}: {least} … {most}");
            assert!(least > 0.999 && most < 1.0001, "{case}");
        }
    }
}

/// What is lost is made up for later, after the other has bounced on the ground perhaps: then the blow takes energy, and never
/// gives any.
#[test]
fn bodies_that_bounce_without_loss_gain_nothing_where_messages_are_lost() {
    for seed in 1..=5 {
        for rates in [[240.0, 100.0], [60.0, 240.0]] {
            let faults = Faults { jitter: 0.2, loss: 0.1, late: 0, seed };
            let [least, most] = juggle(rates, [0.5, 0.2], faults, 20.0);
            println!("{rates:?} Hz, seed {seed}: {least} … {most}");
            assert!(most < 1.01, "{rates:?} Hz, seed {seed}: {least} … {most}");
        }
    }
}

/// The body that owns the contact stands on the ground; what falls on it bounces all the same.
#[test]
fn a_ball_bounces_on_a_standing_body_whichever_owns_the_contact() {
    for rates in [[1000.0, 100.0], [100.0, 1000.0]] {
        let mut stage = Stage::new(Faults::default());
        let table = RigidSpec { mass_kg: 20.0, obstacles: [floor(0.5)].into(), ..cube(0.1, UP * 0.1) };
        let table = RigidSpec { restitution: 0.5, ..table };
        let table = stage.add(RigidBody::new(RigidSpec { sleep: false, ..table }).unwrap(), rates[0]);
        let falling = RigidSpec { restitution: 0.5, ..spec(Solid::Ball { radius_m: RADIUS }, UP * 0.65) };
        let falling = stage.add(RigidBody::new(RigidSpec { mass_kg: 0.01, ..falling }).unwrap(), rates[1]);
        let mut height = 0.0;
        stage.run(0.4, |stage| {
            let ball = stage.settled(falling, stage.newest(table).time.as_secs_f64());
            height = (ball.kinetic_j() / ball.mass_kg + G * ball.state.position.z) / G - 0.2 - RADIUS;
        });
        // 0.4 m above the table before
        assert!((height - 0.1).abs() < 1e-3, "{rates:?}: back up to {height} m");
    }
}
