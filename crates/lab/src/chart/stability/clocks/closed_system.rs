//! The closed systems: three rigid bodies and two tubes with five clocks, without external forces.
//!
//! In: the system, the shift of its rates, a seed. Out: the agents. Never here: measurements.

use crate::chart::asynchronous::bench::{Faults, PairLaw};
use crate::chart::asynchronous::play::Play;
use crate::chart::stability::common::{TUBE_RADIUS_M, plain_body, plain_tube};
use glam::DVec3;
use metachron_contact::{Law, Link};
use metachron_core::{AgentId, Anchor};
use metachron_geometry::Solid;
use metachron_models::rigid::RigidSpec;
use metachron_models::rod::TubeSpec;

/// The systems: two heavy plates that close in on a ball and two tubes, and three balls and two tubes in a ring of springs.
pub(super) const SYSTEMS: [&str; 2] = ["plates", "ring"];
/// Half of the distance of the plates, metres.
pub(super) const ROOM_M: f64 = 0.4;
/// The five rates, Hz: all show the same time every 50 ms.
const RATES_HZ: [f64; 5] = [1000.0, 500.0, 240.0, 120.0, 60.0];
/// The plates: mass, half of their edges, and the speed of each.
const PLATE_KG: f64 = 200.0;
const PLATE_HALF_M: DVec3 = DVec3::new(0.1, 3.0, 3.0);
const PLATE_M_S: f64 = 0.004;
const BALL_KG: f64 = 0.1;
const BALL_M: f64 = 0.05;
const BALL_M_S: f64 = 0.4;
/// Amplitude of the deviation of the ball's starting velocity in each direction, m/s.
const SWAY_M_S: f64 = 0.01;
const TUBE_M: f64 = 0.3;
const SEGMENTS: usize = 12;
/// The ring: masses of the balls, radius of the ring, length of its tubes, stiffness and length of its springs.
const MASSES_KG: [f64; 3] = [1.0, 0.5, 0.2];
const RING_M: f64 = 0.3;
const RING_TUBE_M: f64 = 0.4;
const SPRING_N_M: f64 = 4.0;
const SPRING_REST_M: f64 = 0.05;

/// The system with a name; the rates are shifted cyclically by `turn` places.
pub(super) fn system(name: &str, turn: usize, seed: u64) -> Option<(Play, [AgentId; 5])> {
    if name == SYSTEMS[0] { colliding_row(turn, seed) } else { ring(turn, seed) }
}

/// Plate, tube, ball, tube, plate along x; the ball flies, the plates approach, the tubes are hit.
fn colliding_row(turn: usize, seed: u64) -> Option<(Play, [AgentId; 5])> {
    let mut play = Play::new(PairLaw::Product(Law::Ledger), Faults::default());
    let rate = |i: usize| RATES_HZ[(i + turn) % RATES_HZ.len()];
    let sway = |k: u64| libm::sin((31 * seed + 7 * k) as f64) * SWAY_M_S;
    let body = |solid: Solid, at: DVec3, mass_kg: f64, velocity: DVec3| RigidSpec {
        velocity,
        restitution: 0.9,
        friction: 0.3,
        ..plain_body(solid, at, mass_kg)
    };
    let plate = |side: f64| {
        let at = DVec3::X * (side * (ROOM_M + PLATE_HALF_M.x));
        body(Solid::Box { half_extents_m: PLATE_HALF_M }, at, PLATE_KG, DVec3::X * (-side * PLATE_M_S))
    };
    let tube = |at: DVec3, along: DVec3| {
        let half = along * (0.5 * TUBE_M);
        TubeSpec { friction: 0.3, ..plain_tube(vec![at - half, at + half], TUBE_RADIUS_M, SEGMENTS) }
    };
    let ball = DVec3::new(BALL_M_S + sway(0), sway(1), sway(2));
    let ids = [
        play.add_body(plate(-1.0), rate(0), vec![])?,
        play.add_tube(tube(DVec3::X * (-0.5 * ROOM_M), DVec3::Y), rate(1))?,
        play.add_body(body(Solid::Ball { radius_m: BALL_M }, DVec3::ZERO, BALL_KG, ball), rate(2), vec![])?,
        play.add_tube(tube(DVec3::X * (0.5 * ROOM_M), DVec3::Z), rate(3))?,
        play.add_body(plate(1.0), rate(4), vec![])?,
    ];
    Some((play, ids))
}

/// Five agents in a ring, each on a spring to the next: ball, tube, ball, tube, ball; the balls fly inwards.
fn ring(turn: usize, seed: u64) -> Option<(Play, [AgentId; 5])> {
    let mut play = Play::new(PairLaw::Product(Law::Ledger), Faults::default());
    let rate = |i: usize| RATES_HZ[(i + turn) % RATES_HZ.len()];
    let angle = |i: usize| std::f64::consts::TAU * i as f64 / 5.0;
    let at = |i: usize| DVec3::new(libm::cos(angle(i)), libm::sin(angle(i)), 0.1 * (i as f64 - 2.0)) * RING_M;
    let along = |i: usize| DVec3::new(-libm::sin(angle(i)), libm::cos(angle(i)), 0.2).normalize();
    let ball = |i: usize, k: usize| RigidSpec {
        velocity: at(i) * -1.5 + DVec3::new(0.1, -0.05, 0.2) * (k as f64 - seed as f64),
        spin: DVec3::new(2.0, 1.0, -1.0) * k as f64,
        restitution: 0.7,
        friction: 0.3,
        ..plain_body(Solid::Ball { radius_m: BALL_M }, at(i), MASSES_KG[k])
    };
    let tube = |i: usize| {
        let half = along(i) * (0.5 * RING_TUBE_M);
        TubeSpec { friction: 0.3, ..plain_tube(vec![at(i) - half, at(i) + half], TUBE_RADIUS_M, SEGMENTS) }
    };
    let ids = [
        play.add_body(ball(0, 0), rate(0), vec![])?,
        play.add_tube(tube(1), rate(1))?,
        play.add_body(ball(2, 1), rate(2), vec![])?,
        play.add_tube(tube(3), rate(3))?,
        play.add_body(ball(4, 2), rate(4), vec![])?,
    ];
    let (ball, start, end) = (Anchor::Local(DVec3::ZERO), Anchor::Arc(0.0), Anchor::Arc(RING_TUBE_M));
    let ties = [(0, ball, 1, start), (1, end, 2, ball), (2, ball, 3, start), (3, end, 4, ball), (4, ball, 0, ball)];
    for (number, (a, here, b, there)) in (0..).zip(ties) {
        let spring = Link::new(ids[b], here, there, SPRING_N_M);
        play.link(ids[a], Link { rest_m: SPRING_REST_M, law: Law::Ledger, number, ..spring });
    }
    Some((play, ids))
}
