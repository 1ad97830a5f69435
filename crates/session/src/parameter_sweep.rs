//! A scene played at chosen steps, divisions and integrators, to record the paths of its points and the cost.
//!
//! In: a scene, a [`Setting`] for every object. Out: the paths of its points, the declared and the measured cost of every agent.
//! Never here: which settings are tried ([`crate::fit`] decides), words about them.
//!
//! Runs are in virtual time, and steps take none of it: the result depends on the settings only, not on the machine.

use super::error::SessionError;
use super::session::Session;
use crate::fit::{Path, Setting};
use metachron_core::{AgentId, SimSpan};
use metachron_models::rod::Integrator;
use metachron_runtime::AgentState;
use metachron_world::couplings::Faults;
use metachron_world::kinds::ExecutorKind;
use metachron_world::{Member, Pace, Probe, Scene};
use std::time::Duration;

/// A recorded point: its agent, and where on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// The agent.
    pub agent: AgentId,
    /// Share of its rest length.
    pub at: f64,
}

/// A scene played to its end.
#[derive(Debug, Clone)]
pub struct Played {
    /// Paths of the points, in their order.
    pub paths: Vec<Path>,
    /// Cost of each agent on the declared machine, seconds of one core per simulated second; solves of all integrators count alike.
    pub costs_s: Vec<f64>,
    /// Measured CPU time of each agent's turns, seconds per simulated second.
    pub cpu_s: Vec<f64>,
    /// Steps of each agent.
    pub steps: Vec<u64>,
    /// Pairs of agents that acted on each other.
    pub pairs: Vec<(AgentId, AgentId)>,
    /// The first agent that was parked, and the reason.
    pub parked: Option<(AgentId, String)>,
}

/// Shortest sampling interval of points, seconds, and least number of samples in a run.
const SAMPLE_MIN_S: f64 = 1e-3;
const SAMPLES_LEAST: f64 = 100.0;
/// Interval at which a run checks whether to stop, seconds.
const LOOK_S: f64 = 0.02;

/// The present setting of an agent.
#[must_use]
pub fn setting_of(member: &Member) -> Setting {
    let division = member.division();
    let (pieces, method) = (division.elements, division.integrator.map_or(0, method_of));
    Setting { dt_s: member.pace.dt.as_secs_f64(), pieces, method }
}

/// The index of an integrator in [`Integrator::ALL`].
#[must_use]
pub fn method_of(integrator: Integrator) -> usize {
    Integrator::ALL.iter().position(|one| *one == integrator).unwrap_or(0)
}

/// Applies this setting to one agent of the scene.
pub fn apply(scene: &mut Scene, agent: AgentId, setting: &Setting) {
    let member = &mut scene.agents[agent.0 as usize];
    let dt = SimSpan::from_secs_f64(setting.dt_s).unwrap_or(member.pace.dt);
    (member.pace.rate_hz, member.pace.dt, member.pace.dt_range) = (1.0 / dt.as_secs_f64(), dt, (dt, dt));
    member.tolerance_m = None;
    member.divide(setting.pieces, Integrator::ALL[setting.method]);
}

/// Plays `scene` for so many simulated seconds; `None` if `go_on` returned `false`.
///
/// # Errors
/// [`SessionError`] if a model rejects its object.
pub fn play_points(
    scene: &Scene,
    points: &[Point],
    seconds: f64,
    go_on: &mut dyn FnMut() -> bool,
) -> Result<Option<Played>, SessionError> {
    let machine = metachron_world::machine(scene);
    let mut session = Session::open(watched(scene, points, seconds), Pace::Free)?;
    let looks = (seconds / LOOK_S).ceil().max(1.0);
    for look in 1..=looks as u32 {
        session.wait_until(Duration::from_secs_f64(seconds * f64::from(look) / looks));
        session.read_states();
        if !go_on() {
            return Ok(None);
        }
    }
    let outcome = session.end(None, false);
    let path = |samples: &[(metachron_core::SimTime, glam::DVec3)]| Path {
        samples: samples.iter().map(|(time, place)| (time.as_secs_f64(), *place)).collect(),
    };
    let stats = || outcome.agents.iter().map(|agent| &agent.stats);
    let cost = |(member, stats): (&Member, &metachron_runtime::AgentStats)| {
        let steps = stats.steps.max(1) as f64;
        steps * machine.step_s(member.spec.model(), stats.work / steps, 0, 0) / seconds
    };
    let parked = stats().zip(&scene.agents).find_map(|(stats, member)| match &stats.state {
        AgentState::Parked(reason) => Some((member.id, reason.clone())),
        AgentState::Running | AgentState::Stalled | AgentState::Resting | AgentState::Gone => None,
    });
    Ok(Some(Played {
        paths: outcome.probes.iter().map(|probe| path(probe.samples.as_deref().unwrap_or_default())).collect(),
        costs_s: scene.agents.iter().zip(stats()).map(cost).collect(),
        cpu_s: stats().map(|stats| stats.cpu_s / seconds).collect(),
        steps: stats().map(|stats| stats.steps).collect(),
        pairs: outcome.couplings.iter().map(|one| (one.a, one.b)).collect(),
        parked,
    }))
}

/// The scene in virtual time with `points` recorded, without injected faults.
fn watched(scene: &Scene, points: &[Point], seconds: f64) -> Scene {
    let mut scene = scene.clone();
    let every = |agent: AgentId| {
        let dt_s = scene.agents[agent.0 as usize].pace.dt.as_secs_f64();
        SimSpan::from_secs_f64((seconds / SAMPLES_LEAST).min(SAMPLE_MIN_S).max(dt_s))
    };
    let name = |agent: AgentId| scene.name_of(agent).to_owned();
    let probe = |point: &Point| Probe {
        agent: point.agent,
        object: name(point.agent),
        at: point.at,
        every: every(point.agent),
    };
    scene.probes = points.iter().map(probe).collect();
    for member in &mut scene.agents {
        member.faults = Faults::default();
    }
    scene.executor = ExecutorKind::Lockstep;
    scene
}
