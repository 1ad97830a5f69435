//! A ball that falls on a tube close above the floor: it meets both within one step.
//!
//! The floor has stopped it by the time it hears what the tube gave: taken on top of that, it would be thrown back higher than it fell.

use super::super::reference_spec;
use super::bodies;
use super::bodies::floor;
use super::meetings::{GRAVITY, RADIUS};
use crate::harness::{Faults, Stage};
use crate::rigid::RigidBody;
use crate::rod::Tube;
use crate::rod::TubeSpec;
use glam::DVec3;
use metachron_core::{AgentId, Body};
use metachron_geometry::Solid;
use std::sync::Arc;

const BALL_M: f64 = 0.1;
const TUBE: AgentId = AgentId(0);

fn height_m(stage: &Stage, ball: AgentId) -> f64 {
    let Body::Rigid(body) = &stage.newest(ball).body else { panic!("a body") };
    body.position.z
}

/// A tube above the floor and a ball above it, at such rates, Hz; which is the ball.
fn above_the_floor(rates: (f64, f64), mass_kg: f64, faults: Faults) -> (Stage, AgentId) {
    let mut stage = Stage::new(faults);
    let spec = bodies::dropped(Solid::Ball { radius_m: BALL_M }, mass_kg, DVec3::Z * 0.5, GRAVITY);
    let path_m = vec![DVec3::new(-0.5, 0.0, 0.1), DVec3::new(0.5, 0.0, 0.1)];
    let base = TubeSpec { friction: 0.5, clamp: [true; 2], obstacles: Arc::from([floor()]), ..reference_spec(1e6, 30) };
    stage.add(Tube::new(TubeSpec { path_m, gravity: GRAVITY, ..base }).unwrap(), rates.0);
    let ball = stage.add(RigidBody::new(spec).unwrap(), rates.1);
    (stage, ball)
}

/// How high the ball rises after it was lowest, and how high it lies in the end, at such rates of the tube and the ball, metres.
fn dropped(rates: (f64, f64), faults: Faults) -> (f64, f64) {
    let (mut stage, ball) = above_the_floor(rates, 1.0, faults);
    let (mut lowest, mut highest) = (f64::INFINITY, 0.0_f64);
    stage.run(3.0, |stage| {
        let height = height_m(stage, ball);
        (lowest, highest) = if height < lowest { (height, height) } else { (lowest, highest.max(height)) };
    });
    (highest, height_m(&stage, ball))
}

#[test]
fn a_ball_that_presses_a_tube_on_the_floor_is_not_thrown_back() {
    for rates in [(60.0, 60.0), (60.0, 120.0), (60.0, 240.0), (240.0, 60.0), (30.0, 60.0), (60.0, 30.0), (240.0, 240.0)]
    {
        let (highest, end) = dropped(rates, Faults::default());
        println!("{rates:?}: highest {highest} end {end}");
        // e = 0: what the tube's bending gives back is all that may lift it
        assert!(highest < BALL_M + 4.0 * RADIUS, "{rates:?}: thrown to {highest} m");
        assert!(end > BALL_M - 1e-3 && end < BALL_M + 2.5 * RADIUS, "{rates:?}: it lies at {end} m");
    }
}

#[test]
fn nor_where_messages_are_late_or_lost() {
    for (rates, seed) in [((240.0, 240.0), 0), ((60.0, 240.0), 1), ((60.0, 60.0), 2)] {
        let (highest, _) = dropped(rates, Faults { jitter: 0.2, loss: 0.1, seed, ..Faults::default() });
        println!("{rates:?}: highest {highest}");
        assert!(highest < BALL_M + 8.0 * RADIUS, "{rates:?}: thrown to {highest} m");
    }
}

#[test]
fn a_ball_that_is_slower_than_the_tube_comes_off_the_floor_again() {
    let light =
        [(60.0, 30.0), (60.0, 20.0), (60.0, 10.0), (240.0, 30.0), (1000.0, 10.0), (30.0, 10.0)].map(|r| (r, 1.0));
    let heavy = [(60.0, 30.0), (60.0, 10.0), (240.0, 60.0), (1000.0, 10.0)].map(|r| (r, 10.0));
    for (rates, mass_kg) in light.into_iter().chain(heavy) {
        let (mut stage, ball) = above_the_floor(rates, mass_kg, Faults::default());
        stage.run(1.0, |_| {});
        let (mut depth_m, mut lowest) = (0.0_f64, f64::INFINITY);
        stage.run(2.0, |stage| {
            depth_m = stage.newest(TUBE).pairs.iter().map(|pair| pair.penetration_m).fold(depth_m, f64::max);
            let now_s = stage.newest(TUBE).time.as_secs_f64();
            lowest = lowest.min(stage.settled(ball, now_s).state.position.z);
        });
        println!("{rates:?}, {mass_kg} kg: {depth_m:.1e} m deep, lowest {lowest:.4}");
        assert!(depth_m < 5e-3, "{rates:?}, {mass_kg} kg: {depth_m} m deep");
        assert!(lowest > BALL_M + 2.0 * RADIUS - 8e-3, "{rates:?}, {mass_kg} kg: it lies at {lowest} m");
    }
}
