//! The promises of every agent, as one test suite for any model.
//!
//! In: a [`Suite`]: how to build the agent, how to drive it. Out: every broken promise ([`Breach`]), normally none.
//! Never here: promises of a single model; those are tested next to that model.
//!
//! ```
//! use metachron_contact::Agent;
//! use metachron_core::{Resolution, ResolutionRange, SimSpan};
//! use metachron_models::conformance::{Suite, check};
//! use metachron_models::synthetic::{Synthetic, SyntheticSpec};
//!
//! let range = ResolutionRange { eps_m: (0.01, 0.04), n: (0, 3) };
//! let spec = SyntheticSpec { cost_us: 5.0, cost_order: 1.0, error_m: 1e-3, error_order: 2.0 };
//! let make = || {
//!     let agent = Synthetic::new(spec, range, Resolution { eps_m: 0.04, n: 0 }).unwrap();
//!     Box::new(agent) as Box<dyn Agent>
//! };
//! let resolutions = [0.04, 0.02, 0.01].map(|eps_m| Resolution { eps_m, n: 0 }).to_vec();
//! let dt = SimSpan::from_nanos(4_000_000);
//! let suite = Suite { resolutions, converging: Some((&make, 1)), ..Suite::new(&make, dt) };
//! assert_eq!(check(&suite), []);
//! ```

use glam::DVec3;
use metachron_contact::step::LoneStepper;
use metachron_contact::{Agent, AnchorSpring, Neighbour, StepContext};
use metachron_core::{
    AgentId, Archive, ArchiveError, Body, DT_MAX_S, HASH_START, Resolution, SimSpan, SimTime, Snapshot, StepError,
};

mod bits;
mod carrying;
mod inputs;
mod physics;

pub use carrying::Load;
pub use physics::fall_deviation;

#[cfg(test)]
mod tests;

/// Builds an agent.
pub type Make<'a> = &'a dyn Fn() -> Box<dyn Agent>;
/// Runs the given closure and returns its number of allocations.
pub type CountAllocations<'a> = &'a dyn Fn(&mut dyn FnMut()) -> u64;
/// Distance of an agent from its exact state after so many seconds, relative to that state.
pub type Deviation<'a> = &'a dyn Fn(&dyn Agent, f64) -> f64;

/// An agent and how to drive it.
pub struct Suite<'a> {
    /// Builds the agent, identical each time, in a state of motion.
    pub make: Make<'a>,
    /// The span of a usual step.
    pub dt: SimSpan,
    /// Number of steps in a run.
    pub steps: u32,
    /// The agent's neighbours.
    pub neighbours: Vec<Neighbour>,
    /// A moderate pull, if the agent can be pulled.
    pub pull: Option<AnchorSpring>,
    /// Pulls so large that the state may stop being finite.
    pub absurd: Vec<AnchorSpring>,
    /// A closed form: the agent's deviation from it after t seconds, and the deviation allowed.
    pub closed_form: Option<(Deviation<'a>, f64)>,
    /// Resolutions to retune through, from coarse to fine and back. Where none are given, a request for the present resolution (or for
    /// any, where the model has none) must change no bit.
    pub resolutions: Vec<Resolution>,
    /// Builds the agent in a case that converges, and the number of steps of `dt` until it has.
    pub converging: Option<(Make<'a>, u32)>,
    /// The load that is put on the agent, if others may rest on it.
    pub load: Option<Load<'a>>,
    /// Counts allocations, and the number allowed per step once warm.
    pub allocations: Option<(CountAllocations<'a>, f64)>,
}

/// A promise of [`Agent`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Promise {
    /// A step advances exactly `dt`.
    ExactTime,
    /// A refused step leaves the state bit for bit.
    RefusedSpan,
    /// `set_resolution` keeps mass, linear momentum and rest length exactly and angular momentum to O(ε²).
    Retune,
    /// At a converged state a finer ε does not leave a larger residual (within 10 %).
    Residual,
    /// The same calls give the same bits.
    SameBits,
    /// A saved state that is read back goes on with the same bits, in an agent built anew and in one that was elsewhere. A model that saves
    /// nothing keeps this promise.
    Archive,
    /// A body that rests on it gives it its weight, within 1 %, and stays, whatever the rates of both.
    Carries,
    /// It takes the inputs that [`Agent::inputs`] names, and no others.
    Inputs,
    /// Nothing is allocated once the sizes settle.
    Allocation,
    /// A state that is not finite is refused, never written.
    Finite,
}

/// A promise that was not kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Breach {
    /// Which promise.
    pub promise: Promise,
    /// Description of the failure.
    pub what: String,
}

impl<'a> Suite<'a> {
    /// A suite of 200 steps of `dt` on an agent that has no neighbours, no pull and no resolution.
    #[must_use]
    pub fn new(make: Make<'a>, dt: SimSpan) -> Self {
        Self {
            make,
            dt,
            steps: 200,
            neighbours: vec![],
            pull: None,
            absurd: vec![],
            closed_form: None,
            resolutions: vec![],
            converging: None,
            load: None,
            allocations: None,
        }
    }

    /// Builds the agent and its clock.
    fn start(&self) -> Run<'_> {
        Run { agent: (self.make)(), time: SimTime::ZERO, neighbours: &self.neighbours, stepper: Box::default() }
    }
}

/// Tests the agent of `suite` against every promise; stepped as a run steps an agent that meets no other.
#[must_use]
pub fn check(suite: &Suite<'_>) -> Vec<Breach> {
    let promises = [
        (Promise::ExactTime, physics::exact_time as fn(&Suite<'_>) -> Result<(), String>),
        (Promise::RefusedSpan, bits::refused_span),
        (Promise::Retune, physics::set_resolution),
        (Promise::Residual, physics::residual),
        (Promise::SameBits, bits::same_bits),
        (Promise::Archive, bits::archive),
        (Promise::Carries, carrying::carries),
        (Promise::Inputs, inputs::inputs),
        (Promise::Allocation, bits::allocation),
        (Promise::Finite, bits::finite),
    ];
    let broken = promises.into_iter().filter_map(|(promise, kept)| Some(Breach { promise, what: kept(suite).err()? }));
    broken.collect()
}

/// The number of the agent under test.
const ME: AgentId = AgentId(0);

/// An agent and its own time.
struct Run<'a> {
    agent: Box<dyn Agent>,
    time: SimTime,
    neighbours: &'a [Neighbour],
    stepper: Box<LoneStepper>,
}

impl Run<'_> {
    /// Writes or reads it, with its cluster's memory of it.
    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.agent.archive(archive)?;
        archive.value(&mut self.time)?;
        self.stepper.archive(archive)
    }
}

impl Run<'_> {
    fn step(&mut self, dt: SimSpan, user_springs: &[AnchorSpring]) -> Result<(), StepError> {
        let context = StepContext { neighbours: self.neighbours, user_springs, ..StepContext::alone(ME, self.time) };
        self.stepper.step(self.agent.as_mut(), dt, context)?;
        self.time += dt;
        Ok(())
    }

    /// A step that must succeed.
    fn must_step(&mut self, dt: SimSpan, user_springs: &[AnchorSpring]) -> Result<(), String> {
        self.step(dt, user_springs)
            .map_err(|error| format!("a valid step at {} s failed: {error}", self.time.as_secs_f64()))
    }

    fn snapshot(&self) -> Snapshot {
        let mut into = Snapshot::default();
        self.agent.write_snapshot(&mut into);
        into
    }

    /// A hash of every bit that the agent publishes.
    fn hash(&self) -> u64 {
        let snapshot = self.snapshot();
        let (linear, angular) = self.agent.momentum();
        let numbers = [snapshot.energy_j, snapshot.residual_m, self.agent.mass_kg()];
        let all = numbers.into_iter().chain(linear.to_array()).chain(angular.to_array());
        // the same folding as the snapshot's own, one word after the other
        all.fold(snapshot.fold_hash(HASH_START), |hash, x| (hash ^ x.to_bits()).wrapping_mul(0x0100_0000_01b3))
    }
}

/// The rest length of a curve; zero for a body that has none.
fn rest_length_m(body: &Body) -> f64 {
    if let Body::Curve(curve) = body { curve.arc_m.last().copied().unwrap_or(0.0) } else { 0.0 }
}

/// The speed of the fastest point of a body, m/s, and the largest distance of a point from the origin, metres.
fn extents(body: &Body) -> (f64, f64) {
    let longest = |vectors: &mut dyn Iterator<Item = DVec3>| vectors.map(DVec3::length).fold(0.0, f64::max);
    match body {
        Body::Nothing => (0.0, 0.0),
        Body::Curve(c) => (longest(&mut c.velocities.iter().copied()), longest(&mut c.positions.iter().copied())),
        Body::Rigid(b) => (b.velocity.length(), b.position.length()),
        Body::Tool(t) => (t.velocity.length(), t.tip.length()),
        Body::Soft(s) => {
            let most = |list: &[DVec3]| list.iter().map(|v| v.length()).fold(0.0, f64::max);
            (most(&s.velocities), most(&s.positions))
        }
    }
}

/// A span longer than any model takes.
fn too_long() -> SimSpan {
    SimSpan::from_nanos((DT_MAX_S * 1e9) as u64 + 1)
}
