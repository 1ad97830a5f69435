//! Steps a single agent and measures the CPU time of that.
//!
//! In: the spec of a tube or a soft body, a method, a step. Out: CPU time of its steps, and its state on the way.
//! Never here: answers, errors, drawing.

use super::super::stability::common::plain_tube;
use super::diagram::Case;
use cpu_time::ThreadTime;
use glam::DVec3;
use metachron_contact::step::LoneStepper;
use metachron_contact::{Agent, AnchorForce, StepContext};
use metachron_core::{AgentId, Body, CurveState, SimSpan, SimTime, Snapshot};
use metachron_models::rod::{Material, Section, Tube, TubeSpec};
use metachron_models::soft::{SoftBody, SoftSpec};

/// Factor by which a [`slender_tube`] is stiffer in stretch and shear than the tube of the references.
const STIFFER: f64 = 1e3;

/// The tube of the references: 1 m along `path_m`, 15 mm radius, 2 mm wall.
pub(super) fn reference_tube(young_pa: f64, path_m: Vec<DVec3>) -> TubeSpec {
    let material = Material { young_pa, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 27.0 / 28.0 };
    let section = Section::hollow(0.015, 0.002, material);
    TubeSpec { section, ..plain_tube(path_m, 0.015, 16) }
}

/// The same for reference answers without stretch and shear.
pub(super) fn slender_tube(young_pa: f64, path_m: Vec<DVec3>) -> TubeSpec {
    let mut spec = reference_tube(young_pa, path_m);
    (spec.section.ea_n, spec.section.ga_n) = (spec.section.ea_n * STIFFER, spec.section.ga_n * STIFFER);
    spec
}

/// A metre along x.
pub(super) fn metre() -> Vec<DVec3> {
    vec![DVec3::ZERO, DVec3::X]
}

/// An agent and its stepping.
pub(in super::super) struct Play {
    agent: Box<dyn Agent>,
    stepper: LoneStepper,
    dt: SimSpan,
    time: SimTime,
    cpu_s: f64,
    /// Substeps of each fine step, as its integrator makes them.
    substeps_each: u32,
    substeps: u64,
    steps: u64,
}

impl Play {
    /// The tube of a case, with enough substeps for a method whose limit is below the step. `None` where it cannot be built.
    pub(super) fn new(spec: TubeSpec, case: &Case) -> Option<Self> {
        let (integrator, segments) = (case.method.1, Some(case.segments as usize));
        let mut spec = TubeSpec { integrator, segments, substeps: case.substeps, ..spec };
        let dt_s = case.dt_ms * 1e-3;
        // a tenth of margin: limits shrink with the stretch
        let needed = |limit_s: f64| libm::ceil(1.1 * dt_s / limit_s) as u32;
        let limit_s = Tube::new(spec.clone()).ok()?.longest_substep_s();
        spec.substeps = spec.substeps.max(limit_s.map_or(1, needed));
        let substeps = spec.substeps;
        Self::of(Box::new(Tube::new(spec).ok()?), dt_s, substeps)
    }

    /// The soft body of a case; `None` where it cannot be built.
    pub(super) fn soft(spec: SoftSpec, case: &Case) -> Option<Self> {
        Self::of(Box::new(SoftBody::new(spec).ok()?), case.dt_ms * 1e-3, 1)
    }

    fn of(agent: Box<dyn Agent>, dt_s: f64, substeps_each: u32) -> Option<Self> {
        let dt = SimSpan::from_secs_f64(dt_s)?;
        let stepper = LoneStepper::default();
        Some(Self { agent, stepper, dt, time: SimTime::ZERO, cpu_s: 0.0, substeps_each, substeps: 0, steps: 0 })
    }

    /// Steps on for `seconds` under `forces`; whether every step succeeded.
    pub(super) fn run(&mut self, seconds: f64, forces: &[AnchorForce]) -> bool {
        let until = self.time.as_secs_f64() + seconds - 0.5 * self.dt.as_secs_f64();
        let start = ThreadTime::now();
        let mut sound = true;
        while sound && self.time.as_secs_f64() < until {
            let context = StepContext { forces, ..StepContext::alone(AgentId(0), self.time) };
            match self.stepper.step(&mut *self.agent, self.dt, context) {
                Ok(report) => self.substeps += u64::from(report.substeps * self.substeps_each),
                Err(_) => sound = false,
            }
            self.time += self.dt;
            self.steps += 1;
        }
        self.cpu_s += start.elapsed().as_secs_f64();
        sound
    }

    /// The body's state.
    pub(super) fn body(&self) -> Body {
        let mut seen = Snapshot::default();
        self.agent.write_snapshot(&mut seen);
        seen.body
    }

    /// The state of a tube; empty for anything else.
    pub(super) fn curve(&self) -> CurveState {
        match self.body() {
            Body::Curve(curve) => curve,
            _ => CurveState::default(),
        }
    }

    /// The point of the body at a share of its length, metres.
    pub(super) fn point(&self, share: f64) -> DVec3 {
        self.body().probe(share).map_or(DVec3::NAN, |(point, _)| point)
    }

    /// The lowest height of its nodes or vertices, metres.
    pub(super) fn lowest_m(&self) -> f64 {
        let body = self.body();
        let positions = match &body {
            Body::Curve(curve) => &curve.positions[..],
            Body::Soft(soft) => &soft.positions[..],
            _ => &[],
        };
        positions.iter().map(|x| x.z).fold(f64::INFINITY, f64::min)
    }

    /// CPU milliseconds a simulated second, so far.
    pub(super) fn cpu_ms_per_s(&self) -> f64 {
        self.cpu_s * 1e3 / self.time.as_secs_f64()
    }

    /// CPU seconds of its steps, so far.
    pub(super) fn cpu_s(&self) -> f64 {
        self.cpu_s
    }

    /// Substeps a step, so far.
    pub(super) fn substeps_per_step(&self) -> f64 {
        self.substeps as f64 / self.steps.max(1) as f64
    }

    /// Simulated time so far, seconds.
    pub(super) fn time_s(&self) -> f64 {
        self.time.as_secs_f64()
    }
}
