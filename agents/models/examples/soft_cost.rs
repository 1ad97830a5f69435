//! What does a step of a soft body cost, by its vertices and the work it reports? CSV on standard output.

use glam::{DQuat, DVec3};
use metachron_contact::{Agent, StepContext};
use metachron_core::{AgentId, SimSpan, SimTime};
use metachron_models::soft::Side;
use metachron_models::soft::SoftBody;
use metachron_models::soft::{SoftMatter, SoftShape, SoftSpec};
use std::time::Instant;

/// Each case is stepped for at least this long.
const SECONDS: f64 = 0.5;

fn main() {
    println!("shape,vertices,work,us_per_step");
    let sheet = |n: u32| SoftShape::Sheet { size_m: [0.3, 0.3], thickness_m: 0.001, segments: [n, n] };
    let cube = |n: u32| SoftShape::Box { size_m: DVec3::splat(0.1), segments: [n; 3] };
    let rope = |segments: u32| SoftShape::Rope { path_m: vec![DVec3::ZERO, DVec3::X], radius_m: 0.002, segments };
    [8, 16, 32].into_iter().for_each(|n| measure(sheet(n)));
    [2, 4, 6, 8, 10].into_iter().for_each(|n| measure(cube(n)));
    [20, 80, 320].into_iter().for_each(|n| measure(rope(n)));
}

fn measure(shape: SoftShape) {
    let (model, vertices) = (shape.model(), shape.vertices());
    let mut body = SoftBody::new(SoftSpec {
        shape,
        matter: SoftMatter { young_pa: 1e5, poisson: 0.4, density_kg_m3: 1050.0, damping_per_s: 5.0 },
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        held: vec![Side::Left],
        friction: 0.3,
        gravity: DVec3::NEG_Z * 9.81,
        obstacles: [].into(),
        sleep: false,
    })
    .expect("sound numbers");
    let dt = SimSpan::from_nanos(4_000_000);
    let mut step = || body.step(dt, &StepContext::alone(AgentId(0), SimTime::ZERO)).expect("a step");
    let (mut count, mut work) = (0, step().work);
    let start = Instant::now();
    while start.elapsed().as_secs_f64() < SECONDS || count < 3 {
        work = step().work;
        count += 1;
    }
    let us = start.elapsed().as_secs_f64() / f64::from(count) * 1e6;
    println!("{model},{vertices},{work:.1},{us:.1}");
}
