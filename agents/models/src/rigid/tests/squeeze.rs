//! A light ball that bounces between two heavy plates while they close in on it, three clocks, nothing from outside.
//!
//! Independent answer: contact takes energy, so at a common time there is never more of it than at the start.

use super::spec;
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::rigid::RigidSpec;
use glam::DVec3;
use metachron_core::AgentId;
use metachron_geometry::Solid;

/// Rates of one plate, the ball and the other plate, Hz.
const RATES_HZ: [[f64; 3]; 6] = [
    [120.0, 1000.0, 240.0],
    [60.0, 500.0, 1000.0],
    [1000.0, 240.0, 60.0],
    [500.0, 120.0, 1000.0],
    [240.0, 60.0, 500.0],
    [1000.0, 1000.0, 1000.0],
];
const BALL_M: f64 = 0.05;
/// How far each plate is from the ball, metres, and how fast it comes, m/s: it is there within a second.
const APART_M: f64 = 0.003;
const PLATE_M_S: f64 = 0.003;
const IDS: [AgentId; 3] = [AgentId(0), AgentId(1), AgentId(2)];

fn squeezed(rates_hz: [f64; 3]) -> Stage {
    let mut stage = Stage::new(Faults::default());
    let half = DVec3::new(0.1, 3.0, 3.0);
    let plate = |side: f64| RigidSpec {
        velocity: DVec3::X * (-side * PLATE_M_S),
        mass_kg: 200.0,
        restitution: 0.9,
        friction: 0.3,
        gravity: DVec3::ZERO,
        ..spec(Solid::Box { half_extents_m: half }, DVec3::X * (side * (BALL_M + APART_M + half.x)))
    };
    let ball = RigidSpec {
        velocity: DVec3::new(0.06, 0.003, -0.002),
        mass_kg: 0.1,
        restitution: 0.9,
        friction: 0.3,
        gravity: DVec3::ZERO,
        ..spec(Solid::Ball { radius_m: BALL_M }, DVec3::ZERO)
    };
    for (spec, hz) in [plate(-1.0), ball, plate(1.0)].into_iter().zip(rates_hz) {
        stage.add(RigidBody::new(spec).unwrap(), hz);
    }
    stage
}

#[test]
fn a_ball_between_plates_that_close_in_gains_no_energy() {
    for rates in RATES_HZ {
        let mut stage = squeezed(rates);
        let energy_j = |stage: &Stage, at_s| -> f64 { IDS.iter().map(|id| stage.settled(*id, at_s).kinetic_j()).sum() };
        let first_j = energy_j(&stage, 0.0);
        let (mut peak, mut last, mut room_m, mut closing) = (0.0_f64, 0.0, f64::INFINITY, f64::INFINITY);
        stage.run(3.0, |stage| {
            let at_s = IDS.map(|id| stage.newest(id).time.as_secs_f64()).into_iter().fold(f64::INFINITY, f64::min);
            last = energy_j(stage, at_s) / first_j;
            peak = peak.max(last);
            let [a, b] = [0, 2].map(|k| stage.settled(IDS[k], at_s).state);
            room_m = room_m.min(0.5 * (b.position.x - a.position.x) - 0.1 - BALL_M);
            closing = 0.5 * (a.velocity.x - b.velocity.x);
        });
        println!("{rates:?} Hz: energy peak {peak:.4}, end {last:.4}, room {room_m:.1e} m, closing {closing:.1e} m/s");
        assert!(room_m < 2e-4, "{rates:?}: they never met, {room_m} m apart");
        assert!(room_m > -1e-3, "{rates:?}: the plates went {} m into the ball", -room_m);
        assert!(peak < 1.01, "{rates:?}: energy rises to {peak} of the start");
    }
}
