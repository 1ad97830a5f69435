//! How does the cost of one step of a tube grow with its segments? Prints nanoseconds a segment and step: alone, and held by a
//! tool, with self-contact, another tube near by.
//!
//! `cargo run --release -p metachron-agents --example rod_cost [SEGMENTS …]`

use glam::{DQuat, DVec3};
use metachron_agents::rod::{Material, Section, Tube, TubeSpec};
use metachron_agents::{
    Agent, AgentId, Anchor, Body, Grasp, Neighbour, SimSpan, SimTime, Snapshot, Surroundings, ToolState,
};
use std::sync::Arc;
use std::time::Instant;

/// The clamped soft tube of `tests/reference/cosserat_tube.json`, 1 m along +x.
fn tube(segments: usize, self_contact: bool) -> Tube {
    let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let free = TubeSpec::free(vec![DVec3::ZERO, DVec3::X], Section::hollow(0.015, 0.002, material), segments);
    let gravity = DVec3::NEG_Z * 9.81;
    let spec = TubeSpec { damping_per_s: 6.0, clamp: [true, false], self_contact, gravity, ..free };
    Tube::new(spec).expect("the reference tube is a tube")
}

/// How many batches of some 4000 segment-steps are timed.
const BATCHES: usize = 500;

/// A tool that holds the middle of the tube, and another tube beside it: as they were published once.
fn company() -> Vec<Neighbour> {
    let pose = ToolState {
        tip: DVec3::new(0.5, 0.0, 0.0),
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        jaw: 0.0,
        grasp: Some(Grasp { target: AgentId(0), anchor: Anchor::Arc(0.5), stiffness_n_m: 100.0, damping_n_s_m: 0.5 }),
        force_n: 0.0,
    };
    let held = Neighbour {
        owned: true,
        ..Neighbour::seen(AgentId(1), Arc::new(Snapshot { body: Body::Tool(pose), ..Snapshot::default() }))
    };
    let other = tube(100, false);
    let mut snapshot = Snapshot::default();
    other.write_snapshot(&mut snapshot);
    for x in &mut snapshot.body.curve_mut().positions {
        x.y += 0.04;
    }
    snapshot.acceleration = DVec3::ZERO;
    let near = Neighbour { owned: true, form: other.form(), ..Neighbour::seen(AgentId(2), Arc::new(snapshot)) };
    vec![held, near]
}

/// The least time of a step among many short batches, seconds, and substeps a step.
fn cost(segments: usize, neighbours: &[Neighbour]) -> (f64, f64) {
    let dt = SimSpan::from_nanos(if neighbours.is_empty() { 10_000_000 } else { 1_000_000 });
    let mut tube = tube(segments, !neighbours.is_empty());
    let batch = (4_000 / segments).max(1);
    let (mut best, mut substeps, mut time) = (f64::MAX, 0, SimTime::ZERO);
    // what a shared machine adds is never negative
    for _ in 0..BATCHES {
        let start = Instant::now();
        for _ in 0..batch {
            let around = Surroundings { neighbours, ..Surroundings::alone(AgentId(0), time) };
            substeps += tube.step(dt, &around).expect("a step").substeps;
            time += dt;
        }
        best = best.min(start.elapsed().as_secs_f64() / batch as f64);
    }
    (best, f64::from(substeps) / (batch * BATCHES) as f64)
}

fn main() {
    println!("segments  company  us/step  ns/segment/step  substeps/step");
    let mut sizes: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    if sizes.is_empty() {
        sizes = vec![16, 32, 64, 128, 256, 400, 1000, 4000];
    }
    let near = company();
    for segments in sizes {
        for (name, neighbours) in [("alone", &[][..]), ("held", &near[..])] {
            let (best, share) = cost(segments, neighbours);
            let each = best * 1e9 / segments as f64;
            println!("{segments:8}  {name:7}  {:7.2}  {each:15.1}  {share:13.2}", best * 1e6);
        }
    }
}
