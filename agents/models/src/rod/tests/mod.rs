//! The promises of the tube, against independent answers (`tests/reference/`).

mod buckling;
mod methods;
mod motion;
mod remesh;
mod statics;
mod strained;
mod violent;
mod wall;

use super::state::RodState;
use super::*;
use glam::DVec3;
use metachron_contact::step::LoneStepper;
use metachron_contact::{Agent, StepContext};
use metachron_core::{AgentId, Resolution, ResolutionRange, SimSpan, SimTime};

/// The reference tube of `tests/reference/cosserat_tube.json` with this modulus, along +x from the origin, 1 m.
pub fn reference_spec(young_pa: f64, segments: usize) -> TubeSpec {
    let material = Material { young_pa, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    TubeSpec {
        resolution: Resolution { eps_m: 1.0 / segments as f64, n: 3 },
        range: ResolutionRange { eps_m: (1e-4, 1.0), n: (0, 5) },
        friction: 0.3,
        ..TubeSpec::free(vec![DVec3::ZERO, DVec3::X], Section::hollow(0.015, 0.002, material), segments)
    }
}

/// The reference tube in no field, held nowhere.
pub fn free_tube(segments: usize) -> Tube {
    Tube::new(reference_spec(1e6, segments)).unwrap()
}

/// The same by this integrator, with as many substeps as steps of `dt_ms` need, stretched three times.
pub fn free_tube_by(integrator: Integrator, segments: usize, dt_ms: f64) -> Tube {
    let spec = TubeSpec { integrator, ..reference_spec(1e6, segments) };
    Tube::new(carried(spec, 3.0 * dt_ms)).unwrap()
}

/// The spec with as many substeps as steps of `dt_ms` need.
pub fn carried(spec: TubeSpec, dt_ms: f64) -> TubeSpec {
    let limit_s = Tube::new(spec.clone()).unwrap().longest_substep_s();
    TubeSpec { substeps: limit_s.map_or(spec.substeps, |limit_s| (dt_ms * 1e-3 / limit_s).ceil() as u32), ..spec }
}

/// A state of `tube` moved and turned at random (a fixed sequence), strains up to date.
pub fn shake(tube: &Tube, seed: u64) -> RodState {
    let mut random = Random(seed);
    let mut state = tube.state().clone();
    state.u.iter_mut().for_each(|u| *u = random.vector() * 2.0);
    state.x.iter_mut().for_each(|x| *x += random.vector() * 0.004);
    state.q.iter_mut().for_each(|q| *q = rotation::unit(rotation::exp(random.vector() * 0.3) * *q));
    state.strain(tube.material(), tube.division());
    state
}

/// A fixed sequence of numbers.
pub struct Random(pub u64);

impl Random {
    /// −1 … 1.
    pub fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// In the cube of that.
    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }
}

pub fn millis(ms: f64) -> SimSpan {
    SimSpan::from_secs_f64(ms * 1e-3).unwrap()
}

/// Steps `tube` alone for `seconds` with steps of `dt_ms`; returns how many fine steps that took.
pub fn run(tube: &mut Tube, dt_ms: f64, seconds: f64) -> u32 {
    let steps = (seconds * 1e3 / dt_ms).round() as u64;
    let dt = millis(dt_ms);
    let mut time = SimTime::ZERO;
    let (mut stepper, mut fine_steps) = (LoneStepper::default(), 0);
    for _ in 0..steps {
        fine_steps += stepper.step(tube, dt, StepContext::alone(AgentId(0), time)).unwrap().substeps;
        time += dt;
    }
    fine_steps
}
