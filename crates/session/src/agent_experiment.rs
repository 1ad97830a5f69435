//! A scene whose agents are led through their ranges of step and spacing, to identify how their load responds.
//!
//! In: a scene. Out: for each agent that has something to choose its plant, or why it has none. Never here: the fit
//! ([`metachron_lod::tune`] does it), the picture.

use super::assemble;
use super::error::SessionError;
use metachron_core::{Resolution, SimSpan};
use metachron_lod::control::RateLimits;
use metachron_lod::tune::{AgentIdentifyError, AgentPlant, AgentWindow};
use metachron_runtime::{Demand, Governor, TurnMeasure};
use metachron_world::{Scene, World};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// The result of an experiment on the agents of a scene.
pub struct AgentExperiment {
    /// The agents that have something to choose, in the scene's order.
    pub agents: Vec<AgentResponse>,
    /// Whether it was stopped before its end.
    pub interrupted: bool,
}

/// The result of an agent's experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct AgentResponse {
    /// The agent's name.
    pub name: String,
    /// How its load responds, or why nothing can be said of that.
    pub plant: Result<AgentPlant, AgentIdentifyError>,
}

/// Positions in the range of z that the agents are led through, in this order: neighbours in time are far apart, so that a drift of the scene is
/// not taken for a response.
const LEVELS: [f64; 12] = [0.0, 0.6, 0.2, 0.9, 0.4, 1.0, 0.1, 0.7, 0.3, 0.8, 0.5, 0.05];
/// Turns after a change of level that are not counted: data made anew is cold, …
const SKIPPED: u32 = 4;
/// … and turns of a window.
const TURNS: u32 = 12;
/// Least and most simulated seconds.
const SECONDS: (f64, f64) = (1.0, 20.0);
/// Simulated time between two looks at the caller.
const LOOK: SimSpan = SimSpan::from_millis(100);

/// Leads an agent through its range.
struct Sweep {
    limits: RateLimits,
    level: usize,
    turns: u32,
    work_s: f64,
    periods_s: f64,
    windows: Arc<Mutex<Vec<AgentWindow>>>,
}

impl Governor for Sweep {
    fn after_step(&mut self, measure: &TurnMeasure) -> Demand {
        self.turns += 1;
        let dt_s = measure.dt.as_secs_f64();
        if self.turns > SKIPPED {
            self.work_s += measure.work_s;
            self.periods_s += measure.wanted_period_s * dt_s / self.limits.dt_wanted_s;
        }
        if self.turns < SKIPPED + TURNS {
            return Demand::default();
        }
        // the ε that the agent took up, which is inside ranges of its own
        let eps_m = measure.resolution.map(|held| held.eps_m);
        let z = self.limits.z_of(&metachron_lod::control::RateDemand { dt_s, eps_m });
        let window = AgentWindow { z, load: self.work_s / self.periods_s };
        self.windows.lock().unwrap_or_else(PoisonError::into_inner).push(window);
        (self.turns, self.work_s, self.periods_s) = (0, 0.0, 0.0);
        self.level = (self.level + 1) % LEVELS.len();
        let wanted = self.limits.demand(LEVELS[self.level] * self.limits.top());
        let n = measure.resolution.map_or(0, |held| held.n);
        Demand {
            dt: SimSpan::from_secs_f64(wanted.dt_s),
            resolution: wanted.eps_m.map(|eps_m| Resolution { eps_m, n }),
        }
    }
}

/// Runs `scene` by its own executor while its agents are led through their ranges. `go_on` receives the share that is done; if it returns
/// `false` the experiment ends.
///
/// # Errors
/// [`SessionError::World`] where it cannot start.
pub fn agent_experiment(scene: &Scene, go_on: &mut dyn FnMut(f64) -> bool) -> Result<AgentExperiment, SessionError> {
    let controlled: Vec<_> = assemble::controlled_members(scene).collect();
    let mut windows: HashMap<_, Arc<Mutex<Vec<AgentWindow>>>> = HashMap::new();
    let mut govern = |member: &metachron_world::Member| {
        let (_, limits) = controlled.iter().find(|(of, _)| of.id == member.id)?;
        let windows = Arc::clone(windows.entry(member.id).or_default());
        let sweep = Sweep { limits: *limits, level: 0, turns: 0, work_s: 0.0, periods_s: 0.0, windows };
        Some(Box::new(sweep) as Box<dyn Governor>)
    };
    let world = World::start_governed(scene, scene.executor, &mut govern)?;
    let longest_s = controlled.iter().map(|(_, limits)| limits.dt_max_s.max(limits.dt_wanted_s)).fold(0.0, f64::max);
    let turns = f64::from(SKIPPED + TURNS) * LEVELS.len() as f64;
    let seconds = (turns * longest_s).clamp(SECONDS.0, SECONDS.1);
    let mut interrupted = false;
    while !controlled.is_empty() && world.time().as_secs_f64() < seconds && !interrupted {
        world.advance(LOOK);
        interrupted = !go_on((world.time().as_secs_f64() / seconds).min(1.0));
    }
    world.stop();
    let agents = controlled.iter().map(|(member, limits)| {
        let windows = windows.get(&member.id).map(|w| w.lock().unwrap_or_else(PoisonError::into_inner).clone());
        AgentResponse { name: member.name.clone(), plant: AgentPlant::identify(*limits, &windows.unwrap_or_default()) }
    });
    Ok(AgentExperiment { agents: agents.collect(), interrupted })
}
