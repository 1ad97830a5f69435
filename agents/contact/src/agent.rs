//! The contract of an agent: an object that lives by its own steps.
//!
//! In: a step length and what the agent can see of the others ([`Surroundings`]). Out: a new state and what the step took.
//! Never here: clocks, threads, files, the GPU. What every agent promises is tested by [`metachron_models::conformance`].

use crate::{Law, Link};
use glam::DVec3;
use metachron_core::{AgentId, Anchor, Body, Resolution, SimSpan, SimTime, Snapshot, StepError, StepReport};
use metachron_geometry::Form;
use std::any::Any;
use std::sync::Arc;

/// An object that runs by itself.
///
/// Promises, tested for every model: a step advances exactly `dt`; a refused step leaves the state bit for bit;
/// the same calls give the same bits; nothing is allocated once the sizes settle; a state that is not finite is never written.
pub trait Agent: Send {
    /// The model's name as scenes write it: `tube`, `rigid`, `instrument`, `synthetic`.
    fn model(&self) -> &'static str;

    /// Advances the state by exactly `dt`.
    ///
    /// # Errors
    /// [`StepError::BadSpan`] leaves the state untouched. After [`StepError::Diverged`] the agent must not step again;
    /// its last snapshot stands.
    fn step(&mut self, dt: SimSpan, around: &Surroundings<'_>) -> Result<StepReport, StepError>;

    /// Looks around before its first step, which will be one of `dt`: what it publishes then is what others may expect of it
    /// from the start. No time passes.
    fn look(&mut self, _dt: SimSpan, _around: &Surroundings<'_>) {}

    /// The step that it makes next where one of `dt` is wanted: a shorter one beside others whose motion within `dt` nobody
    /// could foresee; never a longer one. Executors ask before every step.
    fn longest_step(&self, dt: SimSpan, _around: &Surroundings<'_>) -> SimSpan {
        dt
    }

    /// Calls its own time another from now on, later by `by_s` seconds than it was called; earlier where that is below zero.
    /// Nothing else changes, and nothing is on its way to it or from it: what it does at which time goes on from where it is.
    fn rename_time(&mut self, _by_s: f64) {}

    /// The resolution the simulation holds; `None` for a model that has none.
    fn resolution(&self) -> Option<Resolution>;

    /// Takes the nearest resolution to `wanted` that the agent can hold.
    ///
    /// Keeps mass, linear momentum and rest length exactly and angular momentum to O(ε²).
    fn retune(&mut self, wanted: Resolution);

    /// Writes the state into `into`, all of it but `time`, which the runtime stamps.
    fn write_snapshot(&self, into: &mut Snapshot);

    /// Linear momentum (kg·m/s) and angular momentum about the origin (kg·m²/s), in world axes.
    fn momentum(&self) -> (DVec3, DVec3);

    /// Total mass in kilograms; zero for a model that has none.
    fn mass_kg(&self) -> f64;

    /// The shape by which others touch it, for its whole life; `None` where nothing can.
    fn form(&self) -> Option<Arc<Form>> {
        None
    }

    /// The body of this agent that an island of its model can step in its own turn; `None` for a model without islands.
    fn island_body(&mut self) -> Option<&mut dyn Any> {
        None
    }

    /// Advances this agent and `others`, which have handed themselves over to it, as one world on its own clock.
    ///
    /// `apart` comes back with a number for each of `others`: zero where it stays in this world; else it has left, and equal
    /// numbers still belong together. The report counts the work of all.
    ///
    /// # Errors
    /// [`StepError::Alone`] for a model that leads nobody; else as [`Agent::step`].
    fn lead(
        &mut self,
        dt: SimSpan,
        around: &Surroundings<'_>,
        others: &mut [Companion<'_>],
        apart: &mut Vec<u32>,
    ) -> Result<StepReport, StepError> {
        let _ = (dt, around, others, apart);
        Err(StepError::Alone { model: self.model() })
    }
}

/// An agent that steps in the world of another.
pub struct Companion<'a> {
    /// Who.
    pub id: AgentId,
    /// The agent.
    pub agent: &'a mut dyn Agent,
    /// What it sees.
    pub around: Surroundings<'a>,
}

/// What an agent sees while it steps.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// Who is looking.
    pub me: AgentId,
    /// The agent's own time at the start of the step.
    pub time: SimTime,
    /// The agents it may touch or hold, that may touch or hold it, and those with which it has an account to settle.
    pub neighbours: &'a [Neighbour],
    /// Springs of the user's hand on this agent.
    pub hands: &'a [Pull],
    /// Bilateral couplings with other agents.
    pub links: &'a [Link],
}

/// The newest known state of another agent.
#[derive(Debug, Clone)]
pub struct Neighbour {
    /// Who.
    pub id: AgentId,
    /// Its newest published state.
    pub snapshot: Arc<Snapshot>,
    /// Its shape; `None` where the two cannot touch.
    pub form: Option<Arc<Form>>,
    /// How the two act on each other where they touch.
    pub law: Law,
    /// Whether the agent that looks owns the pair ([`crate::owns`]).
    pub owned: bool,
    /// Whether the two keep step ([`crate::keep_step`]).
    pub in_step: bool,
    /// How long its steps are as a rule, seconds; zero where that does not matter.
    pub step_s: f64,
}

impl Neighbour {
    /// An agent that is only looked at: it is neither touched nor owned.
    #[must_use]
    pub const fn seen(id: AgentId, snapshot: Arc<Snapshot>) -> Self {
        Self { id, snapshot, form: None, law: Law::Ledger, owned: false, in_step: false, step_s: 0.0 }
    }
}

/// A spring from a moving point of space to a material point of an agent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pull {
    /// Who pulls; `None` is the user's hand.
    pub by: Option<AgentId>,
    /// The material point that is pulled.
    pub anchor: Anchor,
    /// Where the other end of the spring is, metres.
    pub target: DVec3,
    /// How that end moves, m/s.
    pub target_velocity: DVec3,
    /// Stiffness, N/m, ≥ 0.
    pub stiffness_n_m: f64,
    /// Damping, N·s/m, ≥ 0.
    pub damping_n_s_m: f64,
}

/// Past this age a tool's motion is no longer extrapolated, in seconds: a stopped tool must not drag its catch along.
const EXTRAPOLATION_MAX_S: f64 = 0.1;

/// By how many seconds a tool seen at `seen` is brought forward to `time`.
pub fn led_s(time: SimTime, seen: SimTime) -> f64 {
    time.secs_after(seen).clamp(-EXTRAPOLATION_MAX_S, EXTRAPOLATION_MAX_S)
}

impl<'a> Surroundings<'a> {
    /// An empty world at `time`, for tests and for agents that see nobody.
    #[must_use]
    pub fn alone(me: AgentId, time: SimTime) -> Self {
        Self { me, time, neighbours: &[], hands: &[], links: &[] }
    }

    /// Every spring on this agent: the user's hands, and the tools that hold it, their tips brought forward to `time`.
    pub fn pulls(&self) -> impl Iterator<Item = Pull> + 'a {
        let (me, time) = (self.me, self.time);
        let held = self.neighbours.iter().filter_map(move |other| {
            let Body::Tool(tool) = &other.snapshot.body else { return None };
            let grasp = tool.grasp.filter(|g| g.target == me)?;
            let age_s = led_s(time, other.snapshot.time);
            Some(Pull {
                by: Some(other.id),
                anchor: grasp.anchor,
                target: tool.tip + tool.velocity * age_s,
                target_velocity: tool.velocity,
                stiffness_n_m: grasp.stiffness_n_m,
                damping_n_s_m: grasp.damping_n_s_m,
            })
        });
        self.hands.iter().copied().chain(held)
    }
}
