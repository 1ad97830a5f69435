//! Tunes the loops by which a scene's agents hold their shares of a core.
//!
//! In: a scene. Out: how the agents' loads respond, a row for every pair of gains, the best. Never here: how gains are judged
//! ([`metachron_lod::tune`] does), the experiment's turns ([`metachron_session`] makes them).

use super::super::args::TuneArgs;
use super::super::chart::{Shown, Table, table};
use metachron_console::progress::Bar;
use metachron_lod::control::RateGains;
use metachron_lod::tune::{AgentPlant, AgentTuning, AgentVerdict, tune_agents};
use metachron_session::{AgentResponse, agent_experiment};
use metachron_world::Scene;
use serde_json::{Value, json};
use std::sync::atomic::{AtomicBool, Ordering};

/// The responses of a scene's agents, and the gains found for them.
pub(super) struct AgentLoops {
    responses: Vec<AgentResponse>,
    tuning: Option<AgentTuning>,
}

/// Names of the rows, in the order of [`AgentTuning::rows`].
const ROWS: [&str; 4] = ["own gains", "half of them", "twice as much", "found"];
/// Most plants that gains are judged on.
const PLANTS_MAX: usize = 6;

/// Runs the experiment on the agents of `scene` and searches their gains.
pub(super) fn tune(args: &TuneArgs, scene: &Scene, stopped: &AtomicBool) -> anyhow::Result<AgentLoops> {
    let goes_on = || !stopped.load(Ordering::Relaxed);
    let bar = Bar::new("agents", args.common.quiet || args.common.json);
    let done = agent_experiment(scene, &mut |share| {
        bar.set(share, "leading agents through their steps and spacings".to_owned());
        goes_on()
    })?;
    drop(bar);
    let tuning = if done.interrupted { None } else { tune_agents(&typical(&done.agents), &mut || goes_on()) };
    Ok(AgentLoops { responses: done.agents, tuning })
}

/// For each set of limits the agent of the median load; at most [`PLANTS_MAX`].
fn typical(responses: &[AgentResponse]) -> Vec<AgentPlant> {
    let mut kinds: Vec<Vec<&AgentPlant>> = Vec::new();
    for plant in responses.iter().filter_map(|response| response.plant.as_ref().ok()) {
        match kinds.iter_mut().find(|kind| kind[0].limits == plant.limits) {
            Some(kind) => kind.push(plant),
            None => kinds.push(vec![plant]),
        }
    }
    let median = |mut kind: Vec<&AgentPlant>| {
        kind.sort_by(|a, b| a.full_load.total_cmp(&b.full_load));
        kind[kind.len() / 2].clone()
    };
    let stride = kinds.len().div_ceil(PLANTS_MAX).max(1);
    kinds.into_iter().step_by(stride).map(median).collect()
}

impl AgentLoops {
    /// The best gains; `None` where no agent has a loop that responds.
    pub fn gains(&self) -> Option<RateGains> {
        self.tuning.as_ref().map(|tuning| tuning.best.gains)
    }

    /// How the agents respond, and the table of the rows; empty for a scene whose agents have nothing to choose.
    pub fn text(&self) -> String {
        if self.responses.is_empty() {
            return String::new();
        }
        let table = self.tuning.as_ref().map_or_else(String::new, |tuning| {
            format!("\n{}best for agents: {}\n", rows(tuning).text(), gains_text(tuning.best.gains))
        });
        format!("\nagents' own loops\n{}{table}", self.plants())
    }

    /// The extremes of the agents that respond, and each agent that does not.
    fn plants(&self) -> String {
        let plants: Vec<_> = self.responses.iter().filter_map(|response| response.plant.as_ref().ok()).collect();
        let range = |value: fn(&AgentPlant) -> f64| {
            let (least, most) =
                plants.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), p| (l.min(value(p)), m.max(value(p))));
            if most - least < 0.005 { format!("{most:.2}") } else { format!("{least:.2} to {most:.2}") }
        };
        let mut text = String::new();
        if !plants.is_empty() {
            text = format!(
                "  {} of {} respond: at their finest {} of a core, falling as e^(−q z) with q = {}, scatter {}\n",
                plants.len(),
                self.responses.len(),
                range(|p| p.full_load),
                range(|p| p.power),
                range(|p| p.scatter),
            );
        }
        let silent = self.responses.iter().filter_map(|r| Some((&r.name, r.plant.as_ref().err()?)));
        text + &silent.map(|(name, why)| format!("  {name}: {why}\n")).collect::<String>()
    }

    /// The same as JSON.
    pub fn json(&self) -> Value {
        let plants = self.responses.iter().map(|response| match &response.plant {
            Ok(plant) => json!({
                "name": response.name, "full_load": plant.full_load, "power": plant.power, "power_95": plant.power_95,
                "scatter": plant.scatter, "share": plant.limits.share,
            }),
            Err(why) => json!({ "name": response.name, "why_not": why.to_string() }),
        });
        let rows = self.tuning.iter().flat_map(|tuning| ROWS.iter().zip(&tuning.rows));
        json!({ "plants": plants.collect::<Vec<_>>(), "rows": rows.map(|(name, row)| row_json(name, row)).collect::<Vec<_>>() })
    }
}

fn rows(tuning: &AgentTuning) -> Table {
    let seconds = |settle: Option<f64>| settle.map_or_else(|| "never".cell(0), |s| s.cell(2));
    table!(ROWS.iter().zip(&tuning.rows), |(name, row)| "gains of": name, agent_refine(3): row.gains.refine,
        agent_yield(3): row.gains.yielding, coarsened_s: seconds(row.coarsened_s), refined_s: seconds(row.refined_s),
        late_share(4): row.late_share, reversals_per_s(3): row.reversals_per_s, quality(3): row.quality,
        objective(4): row.objective)
}

fn gains_text(gains: RateGains) -> String {
    format!("agent_refine = {:.3}, agent_yield = {:.3}", gains.refine, gains.yielding)
}

fn row_json(name: &str, row: &AgentVerdict) -> Value {
    json!({
        "gains_of": name, "agent_refine": row.gains.refine, "agent_yield": row.gains.yielding, "coarsened_s": row.coarsened_s,
        "refined_s": row.refined_s, "late_share": row.late_share, "reversals_per_s": row.reversals_per_s,
        "quality": row.quality, "objective": row.objective,
    })
}
