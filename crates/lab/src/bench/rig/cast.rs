//! The agents of a benchmark.
//!
//! In: a model and a number. Out: agents that step and touch nothing. Never here: time passing.

use crate::chart::GRAVITY;
use anyhow::Context;
use glam::DVec3;
use metachron_contact::step::LoneStepper;
use metachron_contact::{Agent, OwnSteps, StepContext, Stepping};
use metachron_core::{N_MAX, Resolution, ResolutionRange, SimSpan, Snapshot, StepError, StepReport};
use metachron_geometry::Solid;
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::rod::{Material, Section, Tube, TubeSpec};
use metachron_models::synthetic::{Synthetic, SyntheticSpec};
use metachron_runtime::AgentSpawn;

metachron_core::choices! {
    /// The kind of an agent.
    pub enum Model {
        /// Half a microsecond of arithmetic per step: as cheap as agents get.
        Synthetic = "synthetic",
        /// As synthetic, but at rest after its first step.
        Asleep = "asleep",
        /// A tube of 64 segments, clamped at one end.
        Rod = "rod",
        /// A ball in free flight.
        Rigid = "rigid",
    }
}

/// Nominal cost of a synthetic step, microseconds: on a core of 4 GHz it takes 0.56, as a plain rod of 64 particles does.
const SYNTHETIC_US: f64 = 0.85;

/// An agent that takes part in no contact: the benchmark measures agents, not contacts.
struct IsolatedAgent {
    agent: Box<dyn Agent>,
    /// The cluster of one of a member of clusters.
    stepper: Option<Box<LoneStepper>>,
    rests: bool,
}

/// Agent number `k`.
pub(crate) fn agent(model: Model, k: usize) -> anyhow::Result<Box<dyn Agent>> {
    // far apart: no agent overlaps another
    let place = DVec3::new((k % 320) as f64, (k / 320) as f64, 0.0) * 2.0;
    let agent: Box<dyn Agent> = match model {
        Model::Synthetic | Model::Asleep => Box::new(synthetic()?),
        Model::Rod => Box::new(rod(place, ROD_SEGMENTS, false)?),
        Model::Rigid => Box::new(ball(place)?),
    };
    Ok(Box::new(IsolatedAgent { agent, stepper: None, rests: model == Model::Asleep }))
}

fn synthetic() -> anyhow::Result<Synthetic> {
    let spec = SyntheticSpec { cost_us: SYNTHETIC_US, cost_order: 1.0, error_m: 1e-3, error_order: 1.0 };
    let range = ResolutionRange { eps_m: (0.01, 0.01), n: (0, N_MAX) };
    Synthetic::new(spec, range, Resolution { eps_m: 0.01, n: 1 }).context("the synthetic agent")
}

/// Segments of the rods among the agents.
pub(crate) const ROD_SEGMENTS: usize = 64;

/// A tube of a metre along x, clamped at `place`.
pub(crate) fn rod(place: DVec3, segments: usize, self_contact: bool) -> anyhow::Result<Tube> {
    const LENGTH_M: f64 = 1.0;
    let material = Material { young_pa: 1e6, poisson: 0.45, density_kg_m3: 1050.0, shear_factor: 0.5 };
    let section = Section::hollow(0.015, 0.002, material);
    let free = TubeSpec::free(vec![place, place + DVec3::X * LENGTH_M], section, segments);
    let eps_m = LENGTH_M / segments as f64;
    let spec = TubeSpec {
        resolution: Resolution { eps_m, n: 1 },
        range: ResolutionRange { eps_m: (eps_m, eps_m), n: (0, N_MAX) },
        damping_per_s: 6.0,
        clamp: [true, false],
        self_contact,
        gravity: DVec3::NEG_Z * GRAVITY,
        ..free
    };
    Tube::new(spec).context("the rod")
}

fn ball(place: DVec3) -> anyhow::Result<RigidBody> {
    let ball = RigidSpec::free(Solid::Ball { radius_m: 0.1 }, place, 1.0);
    let spec = RigidSpec { velocity: DVec3::Z, spin: DVec3::new(1.0, 2.0, 3.0), ..ball };
    RigidBody::new(spec).context("the ball")
}

/// The rate of agent `k` for a mean of `rate_hz`: spread by ± 5 %, so that not all are due simultaneously.
pub(crate) fn rate_hz(k: usize, rate_hz: f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    rate_hz * (0.95 + 0.1 * (k as f64 * GOLDEN).fract())
}

/// Wraps agent `k` for the start of a run.
pub(crate) fn spawn(agent: Box<dyn Agent>, k: usize, mean_hz: f64) -> AgentSpawn {
    AgentSpawn::alone(format!("agent {k}"), agent, rate_hz(k, mean_hz))
}

impl Agent for IsolatedAgent {
    fn model(&self) -> &'static str {
        self.agent.model()
    }

    fn resolution(&self) -> Option<Resolution> {
        self.agent.resolution()
    }

    fn set_resolution(&mut self, wanted: Resolution) {
        self.agent.set_resolution(wanted);
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Own(self)
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        self.agent.write_snapshot(into);
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        self.agent.momentum()
    }

    fn mass_kg(&self) -> f64 {
        self.agent.mass_kg()
    }
}

impl OwnSteps for IsolatedAgent {
    fn step(&mut self, dt: SimSpan, context: &StepContext<'_>) -> Result<StepReport, StepError> {
        let report = match self.agent.stepping() {
            Stepping::Own(own) => own.step(dt, context)?,
            Stepping::Cluster(_) => self.stepper.get_or_insert_default().step(&mut *self.agent, dt, *context)?,
        };
        Ok(StepReport { at_rest: self.rests || report.at_rest, ..report })
    }
}
