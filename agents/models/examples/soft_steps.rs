//! The cost of a step of a solid or a sheet by itself: milliseconds a step by the number of nodes.

use glam::{DQuat, DVec3};
use metachron_contact::StepContext;
use metachron_contact::step::LoneStepper;
use metachron_core::{AgentId, SimSpan, SimTime};
use metachron_geometry::ContactTraits;
use metachron_models::soft::{MaterialLaw, Side, SoftBody, SoftMaterial, SoftShape, SoftSpec};
use std::time::Instant;

const WARM_UP: u32 = 20;
const STEPS: u32 = 40;

fn main() {
    for cells in [4, 6, 8, 10, 12, 15, 19] {
        let shape = SoftShape::Box { size_m: DVec3::splat(0.1), segments: [cells; 3] };
        let material = SoftMaterial {
            young_pa: 12e3,
            poisson: 0.4,
            density_kg_m3: 1050.0,
            damping_per_s: 0.2,
            damping_s: 0.0,
            law: MaterialLaw::Corotational,
        };
        step(&format!("cube of {:5} nodes", (cells + 1).pow(3)), shape, material, Side::Bottom);
    }
    for cells in [10, 20, 30, 60] {
        let shape = SoftShape::Sheet { size_m: [0.3; 2], thickness_m: 0.004, segments: [cells; 2] };
        let material = SoftMaterial {
            young_pa: 1e5,
            poisson: 0.3,
            density_kg_m3: 1050.0,
            damping_per_s: 0.2,
            damping_s: 0.0,
            law: MaterialLaw::Corotational,
        };
        step(&format!("sheet of {:4} nodes", (cells + 1).pow(2)), shape, material, Side::Left);
    }
}

fn step(name: &str, shape: SoftShape, material: SoftMaterial, held: Side) {
    let spec = SoftSpec {
        shape,
        nodes: None,
        eps_touched_m: None,
        material,
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        held: vec![held],
        friction: 0.5,
        traits: ContactTraits::default(),
        gravity: DVec3::Z * -9.81,
        self_contact: false,
        sleep: false,
    };
    let Ok(mut body) = SoftBody::new(spec) else { return println!("{name}: refused") };
    let dt = SimSpan::from_millis(10);
    let (mut stepper, mut time) = (LoneStepper::default(), SimTime::ZERO);
    let mut started = Instant::now();
    for at in 0..WARM_UP + STEPS {
        if at == WARM_UP {
            started = Instant::now();
        }
        if let Err(error) = stepper.step(&mut body, dt, StepContext::alone(AgentId(0), time)) {
            return println!("{name}: {error}");
        }
        time += dt;
    }
    println!("{name}: {:7.3} ms a step", 1e3 * started.elapsed().as_secs_f64() / f64::from(STEPS));
}
