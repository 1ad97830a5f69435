//! Bodies with clocks of their own that fly towards each other: however far ahead each looks, they meet. Reference: momentum and restitution.

use glam::DVec3;
use metachron_contact::detect::ClusterScene;
use metachron_core::{Body, RigidState, Snapshot};
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_runtime::{AgentSpawn, Lockstep, Machine, Run, TimelineCommand};
use std::sync::Arc;
use std::time::Duration;

const RADIUS_M: f64 = 0.05;

fn ball(name: &str, at_m: DVec3, velocity: DVec3, rate_hz: f64) -> AgentSpawn {
    let solid = Solid::Ball { radius_m: RADIUS_M };
    let spec = RigidSpec { velocity, restitution: 1.0, gravity: DVec3::ZERO, ..RigidSpec::free(solid, at_m, 1.0) };
    let spawn = AgentSpawn::alone(name, Box::new(RigidBody::new(spec).unwrap()), rate_hz);
    AgentSpawn { scene: Arc::new(ClusterScene::default()), ..spawn }
}

/// The velocities of all after so many seconds.
fn play(spawns: Vec<AgentSpawn>, seconds: f64) -> Vec<DVec3> {
    let mut run: Box<dyn Run> = Box::new(Lockstep::start(spawns, Machine::two_cores_software()).unwrap());
    run.drive(TimelineCommand::Run);
    run.wait_until(Duration::from_secs_f64(seconds));
    let velocities = run.agents().iter().filter_map(|agent| Some(rigid(&agent.latest())?.velocity)).collect();
    run.shutdown();
    velocities
}

#[test]
fn two_balls_of_any_rates_exchange_their_velocities() {
    let rates_hz = [10.0, 30.0, 60.0, 100.0, 240.0, 1000.0];
    for (k, first_hz) in rates_hz.into_iter().enumerate() {
        for (j, second_hz) in rates_hz.into_iter().enumerate() {
            for (closing_m_s, gap_m) in [(0.5, 0.11), (3.0, 0.9), (12.0, 0.85), (12.0, 0.37), (5.0, 0.2)] {
                // not the same moments in any two cases
                let gap_m = gap_m * (1.0 + 0.01 * (6 * k + j) as f64);
                let [v, w] = [DVec3::X * (0.2 * closing_m_s), DVec3::X * (-0.8 * closing_m_s)];
                let away = DVec3::X * (RADIUS_M + 0.5 * gap_m);
                let balls = vec![ball("a", -away, v, first_hz), ball("b", away, w, second_hz)];
                let found = play(balls, gap_m / closing_m_s + 0.5);
                let off = (found[0] - w).length().max((found[1] - v).length());
                assert!(
                    off < 1e-3 * closing_m_s,
                    "{first_hz} and {second_hz} Hz, {closing_m_s} m/s over {gap_m} m: {found:?}"
                );
            }
        }
    }
}

#[test]
fn balls_in_a_crowd_keep_momentum_and_energy_and_pass_through_nobody() {
    // twenty balls on a lattice, thrown at its middle at unlike speeds and rates
    let at = |k: u32| DVec3::new(f64::from(k % 3) - 1.0, f64::from(k / 3 % 3) - 1.0, f64::from(k / 9) - 1.0) * 0.4;
    let speed = |k: u32| 1.0 + 0.37 * f64::from(k % 5);
    let thrown = |k: u32| -(at(k) + DVec3::new(0.03, -0.02, 0.01) * f64::from(k % 4)).normalize_or_zero() * speed(k);
    let rates_hz = [240.0, 60.0, 240.0, 100.0];
    let places: Vec<u32> = (0..20).filter(|k| *k != 13).collect();
    let spawn = |k: &u32| ball(&format!("{k}"), at(*k), thrown(*k), rates_hz[*k as usize % 4]);
    let spawns = places.iter().map(spawn).collect();
    let mut run: Box<dyn Run> = Box::new(Lockstep::start(spawns, Machine::two_cores_software()).unwrap());
    run.drive(TimelineCommand::Run);
    let mut nearest_m = f64::INFINITY;
    let mut found = vec![];
    for slice in 1..=750 {
        run.wait_until(Duration::from_millis(2 * slice));
        let states: Vec<_> = run.agents().iter().map(|agent| agent.latest()).collect();
        found = states.iter().filter_map(|state| rigid(state)).collect();
        for (k, a) in states.iter().enumerate() {
            // of one time, as agents are that step together
            for b in states[..k].iter().filter(|b| b.time == a.time) {
                let apart = rigid(a).zip(rigid(b)).map(|(a, b)| a.position.distance(b.position));
                nearest_m = apart.map_or(nearest_m, |apart_m| apart_m.min(nearest_m));
            }
        }
    }
    assert!(nearest_m > 2.0 * RADIUS_M - 1e-3, "two balls are {nearest_m} m apart");
    let before: DVec3 = places.iter().map(|k| thrown(*k)).sum();
    let after: DVec3 = found.iter().map(|state| state.velocity).sum();
    assert!((after - before).length() < 1e-6, "{before}, then {after}");
    let then_j: f64 = places.iter().map(|k| 0.5 * thrown(*k).length_squared()).sum();
    let now_j: f64 = found.iter().map(|state| 0.5 * state.velocity.length_squared()).sum();
    assert!(now_j < then_j * 1.001 && now_j > 0.5 * then_j, "{then_j} J, then {now_j} J");
    run.shutdown();
}

fn rigid(state: &Snapshot) -> Option<RigidState> {
    match &state.body {
        Body::Rigid(state) => Some(*state),
        _ => None,
    }
}
