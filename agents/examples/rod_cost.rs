//! How does the cost of one step of a tube grow with its segments? Prints nanoseconds a segment and step.
//!
//! `cargo run --release -p metachron-agents --example rod_cost [SEGMENTS …]`

use glam::DVec3;
use metachron_agents::rod::{Material, Section, Tube, TubeSpec};
use metachron_agents::{Agent, AgentId, Resolution, ResolutionRange, SimSpan, SimTime, Surroundings};
use std::sync::Arc;
use std::time::Instant;

/// The clamped soft tube of `tests/reference/cosserat_tube.json`, 1 m along +x.
fn tube(segments: usize) -> Tube {
    let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let (section, mass_per_length_kg_m) = Section::hollow(0.015, 0.002, material);
    let resolution = Resolution { eps_m: 1.0 / segments as f64, n: 3 };
    let spec = TubeSpec {
        path_m: vec![DVec3::ZERO, DVec3::X],
        section,
        mass_per_length_kg_m,
        resolution,
        range: ResolutionRange::fixed(resolution),
        segments: Some(segments),
        substeps: 1,
        damping_per_s: 6.0,
        clamp: [true, false],
        pin: [false; 2],
        attachments: vec![],
        peristalsis: None,
        pressure_pa: 0.0,
        self_contact: false,
        friction: 0.0,
        gravity: DVec3::NEG_Z * 9.81,
        obstacles: Arc::from([]),
        sleep: false,
    };
    Tube::new(spec).expect("the reference tube is a tube")
}

/// How many batches of some 4000 segment-steps are timed.
const BATCHES: usize = 500;

fn main() {
    let dt = SimSpan::from_nanos(10_000_000);
    println!("segments  us/step  ns/segment/step  substeps/step");
    let mut sizes: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    if sizes.is_empty() {
        sizes = vec![16, 32, 64, 128, 256, 400, 1000, 4000];
    }
    for segments in sizes {
        let mut tube = tube(segments);
        let batch = (4_000 / segments).max(1);
        let (mut best, mut substeps, mut time) = (f64::MAX, 0, SimTime::ZERO);
        // the least of many short batches: what a shared machine adds is never negative
        for _ in 0..BATCHES {
            let start = Instant::now();
            for _ in 0..batch {
                substeps += tube.step(dt, &Surroundings::alone(AgentId(0), time)).expect("a step").substeps;
                time += dt;
            }
            best = best.min(start.elapsed().as_secs_f64() / batch as f64);
        }
        let share = f64::from(substeps) / (batch * BATCHES) as f64;
        println!("{segments:8}  {:7.2}  {:15.1}  {share:13.2}", best * 1e6, best * 1e9 / segments as f64);
    }
}
