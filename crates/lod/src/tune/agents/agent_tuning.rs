//! Finds the gains by which a scene's agents hold their shares of a core.
//!
//! In: the agents' plants. Out: a row for every pair of gains that was judged by name, and the best of all that were
//! tried; the rows are among these, so that none of them is better than the result. Never here: a scene, a thread of an
//! agent.
//! Theory: `docs/theory/control.md`, eq. 31a … 31c.

use super::agent_plant::{AgentPlant, AgentTrial, AgentTurn, play_agent};
use crate::control::RateGains;
use crate::tune::loops::disturbance::Disturbance;
use metachron_core::gains;

/// How the loop of a scene's agents does by some gains: the mean over the agents, and the worst settling times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AgentVerdict {
    /// The gains judged.
    pub gains: RateGains,
    /// Seconds from the finest until the load stays in the dead zone; `None` if it does not.
    pub coarsened_s: Option<f64>,
    /// Seconds from the coarsest until the load stays in the dead zone; `None` if it does not.
    pub refined_s: Option<f64>,
    /// Fraction of turns that took longer than their period, over all disturbances.
    pub late_share: f64,
    /// Turns of z from finer to coarser or back, per second, over all disturbances.
    pub reversals_per_s: f64,
    /// Mean e^(z* − z), at most 1: the agent's work as a part of the work that its share would have paid for.
    pub quality: f64,
    /// The number to minimise (control.md, eq. 31c).
    pub objective: f64,
}

/// The result of a tuning.
#[derive(Debug, Clone, PartialEq)]
pub struct AgentTuning {
    /// The law's own gains, gains of one half of that and twice that, and the best, in this order.
    pub rows: [AgentVerdict; 4],
    /// The best of all that were tried.
    pub best: AgentVerdict,
}

/// Seconds of a trial: the middle third is long enough for the law's patience of a second to show.
const SECONDS: f64 = 18.0;
/// Part of the range of z at which the load is the share, before the disturbance.
const REST: f64 = 0.5;
/// Part of a core that others take in a trial with others.
const OTHERS: f64 = 0.9;
/// Loads are judged by their mean over this long, seconds: as the law does.
const WINDOW_S: f64 = 0.25;
/// The load over the share in the law's dead zone (control.md, eq. 19), a twentieth wider.
const DEAD: (f64, f64) = (0.76, 1.1);
/// If windows scatter by less than this a trial is not repeated with other seeds.
const NOISE_LEAST: f64 = 1e-4;
const SEEDS: u64 = 3;
/// Gains tried first.
const REFINE: [f64; 6] = [0.1, 0.2, 0.35, 0.5, 0.75, 1.0];
const YIELD: [f64; 6] = [0.1, 0.25, 0.5, 0.75, 1.0, 1.5];
/// Factors by which the best of them are changed then, one after the other, as long as that betters them.
const FINER: [f64; 3] = [1.3, 1.12, 1.05];
/// Weights of a late turn, a reversal a second, a lost part of quality, and a second of settling relative to an error of one.
const WEIGHTS: [f64; 4] = [2.0, 0.1, 1.0, 0.1];

/// Searches the gains for agents of these plants; `None` without a plant. `go_on` is asked after every pair of gains.
#[must_use]
pub fn tune_agents(plants: &[AgentPlant], go_on: &mut dyn FnMut() -> bool) -> Option<AgentTuning> {
    if plants.is_empty() {
        return None;
    }
    let own = RateGains::default();
    let times = |factor: f64| RateGains { refine: factor * own.refine, yielding: factor * own.yielding };
    let named = [own, times(0.5), times(2.0)].map(|gains| judge_agents(plants, gains));
    let mut best = named.into_iter().reduce(better)?;
    for gains in REFINE.iter().flat_map(|&refine| YIELD.map(|yielding| RateGains { refine, yielding })) {
        if go_on() {
            best = better(best, judge_agents(plants, gains));
        }
    }
    for factor in FINER {
        while let Some(found) = neighbours(best.gains, factor)
            .into_iter()
            .take_while(|_| go_on())
            .map(|gains| judge_agents(plants, gains))
            .find(|verdict| verdict.objective < best.objective)
        {
            best = found;
        }
    }
    let [own, half, twice] = named;
    Some(AgentTuning { rows: [own, half, twice, best], best })
}

/// The one with the smaller objective; the first of equals.
fn better(first: AgentVerdict, second: AgentVerdict) -> AgentVerdict {
    if second.objective < first.objective { second } else { first }
}

fn neighbours(at: RateGains, factor: f64) -> [RateGains; 4] {
    let RateGains { refine, yielding } = at;
    let [finer, coarser] = [factor, 1.0 / factor].map(|f| gains::REFINE.nearest(f * refine));
    let [more, less] = [factor, 1.0 / factor].map(|f| gains::YIELD.nearest(f * yielding));
    [
        RateGains { refine: finer, yielding },
        RateGains { refine: coarser, yielding },
        RateGains { refine, yielding: more },
        RateGains { refine, yielding: less },
    ]
}

/// Judges the loop of agents of these plants, at least one, by `gains`.
#[must_use]
pub fn judge_agents(plants: &[AgentPlant], gains: RateGains) -> AgentVerdict {
    let each: Vec<_> = plants.iter().map(|plant| judge_one(plant, gains)).collect();
    let mean = |value: fn(&AgentVerdict) -> f64| each.iter().map(value).sum::<f64>() / each.len() as f64;
    let worst =
        |value: fn(&AgentVerdict) -> Option<f64>| each.iter().map(value).reduce(|a, b| Some(a?.max(b?))).flatten();
    AgentVerdict {
        gains,
        coarsened_s: worst(|v| v.coarsened_s),
        refined_s: worst(|v| v.refined_s),
        late_share: mean(|v| v.late_share),
        reversals_per_s: mean(|v| v.reversals_per_s),
        quality: mean(|v| v.quality),
        objective: mean(|v| v.objective),
    }
}

fn judge_one(plant: &AgentPlant, gains: RateGains) -> AgentVerdict {
    let rest_z = REST * plant.limits.top();
    let full_load = plant.limits.share * libm::exp(plant.power * rest_z);
    let trial = AgentTrial {
        start_z: rest_z,
        full_load,
        disturbance: Disturbance::Nothing,
        others: 0.0,
        seconds: SECONDS,
        seed: 1,
    };
    let settled = |start_z: f64| settled_after(&play_agent(plant, gains, &AgentTrial { start_z, ..trial }));
    let seeds = if plant.scatter > NOISE_LEAST { SEEDS } else { 1 };
    let disturbed = Disturbance::ALL.into_iter().filter(|d| *d != Disturbance::CameraTurn).map(|d| (d, 0.0));
    let upset: Vec<_> = disturbed
        .chain([(Disturbance::Nothing, OTHERS)])
        .flat_map(|(disturbance, others)| {
            (1..=seeds).map(move |seed| AgentTrial { disturbance, others, seed, ..trial })
        })
        .map(|trial| Measures::of(&play_agent(plant, gains, &trial)))
        .collect();
    let mean = |value: fn(&Measures) -> f64| upset.iter().map(value).sum::<f64>() / upset.len() as f64;
    let mut verdict = AgentVerdict {
        gains,
        coarsened_s: settled(0.0),
        refined_s: settled(plant.limits.top()),
        late_share: mean(|m| m.late_share),
        reversals_per_s: mean(|m| m.reversals_per_s),
        quality: mean(|m| m.quality),
        objective: 0.0,
    };
    verdict.objective = verdict.weigh(mean(|m| m.error));
    verdict
}

impl AgentVerdict {
    fn weigh(&self, error: f64) -> f64 {
        let [late, reversal, quality, settling] = WEIGHTS;
        let slowest_s = self.coarsened_s.zip(self.refined_s).map_or(2.0 * SECONDS, |(c, r)| c.max(r));
        error
            + late * self.late_share
            + reversal * self.reversals_per_s
            + quality * (1.0 - self.quality)
            + settling * slowest_s
    }
}

/// A trial in numbers.
struct Measures {
    error: f64,
    late_share: f64,
    reversals_per_s: f64,
    quality: f64,
}

impl Measures {
    fn of(turns: &[AgentTurn]) -> Self {
        let count = turns.len().max(1) as f64;
        let mean = |value: fn(&AgentTurn) -> f64| turns.iter().map(value).sum::<f64>() / count;
        let end_s = turns.last().map_or(SECONDS, |turn| turn.time_s);
        let moves: Vec<_> = turns.windows(2).map(|two| two[1].z - two[0].z).filter(|moved| *moved != 0.0).collect();
        let reversals = moves.windows(2).filter(|two| two[0] * two[1] < 0.0).count();
        Self {
            error: mean(|turn| libm::fabs(turn.rest_z - turn.z)),
            late_share: mean(|turn| f64::from(u8::from(turn.is_late))),
            reversals_per_s: reversals as f64 / end_s,
            quality: mean(|turn| libm::exp(turn.rest_z - turn.z).min(1.0)),
        }
    }
}

/// Seconds until the load stays in the dead zone, by its mean over windows; `None` if it does not.
fn settled_after(turns: &[AgentTurn]) -> Option<f64> {
    let mut windows: Vec<(f64, f64, f64)> = Vec::new();
    for turn in turns {
        match windows.last_mut().filter(|(begun, ..)| turn.time_s - *begun < WINDOW_S) {
            Some((_, sum, count)) => (*sum, *count) = (*sum + turn.load, *count + 1.0),
            None => windows.push((turn.time_s, turn.load, 1.0)),
        }
    }
    let outside = |(_, sum, count): &(f64, f64, f64)| !(DEAD.0..=DEAD.1).contains(&(sum / count));
    match windows.iter().rposition(outside) {
        None => Some(0.0),
        Some(last) => windows.get(last + 1).map(|(begun, ..)| *begun),
    }
}

#[cfg(test)]
mod tests {
    use super::super::agent_plant::{AgentIdentifyError, AgentWindow};
    use super::*;
    use crate::control::RateLimits;

    fn limits() -> RateLimits {
        RateLimits { dt_wanted_s: 0.004, dt_max_s: 0.016, eps_m: Some((0.005, 0.02)), work_power: 1.0, share: 0.3 }
    }

    /// Windows of an agent whose work falls as e^(−q z), with noise of ± 4 %.
    fn windows(full_load: f64, power: f64) -> Vec<AgentWindow> {
        let window = |k: u32| {
            let z = f64::from(k * 7 % 11) / 10.0 * limits().top();
            let noise = 1.0 + 0.04 * (f64::from(k * 31 % 17) / 8.0 - 1.0);
            AgentWindow { z, load: noise * full_load * libm::exp(-power * z) }
        };
        (0..60).map(window).collect()
    }

    #[test]
    fn a_plant_is_identified_from_its_windows() {
        for (full_load, power) in [(0.8, 1.0), (2.5, 0.6)] {
            let plant = AgentPlant::identify(limits(), &windows(full_load, power)).unwrap();
            assert!(
                (plant.power / power - 1.0).abs() < 0.03 && (plant.full_load / full_load - 1.0).abs() < 0.03,
                "{plant:?}"
            );
            assert!(plant.power_95.0 <= power && power <= plant.power_95.1 && plant.scatter < 0.05, "{plant:?}");
        }
    }

    #[test]
    fn what_cannot_be_tuned_says_why() {
        let fixed = RateLimits { eps_m: None, dt_max_s: 0.004, ..limits() };
        assert_eq!(AgentPlant::identify(fixed, &windows(1.0, 1.0)), Err(AgentIdentifyError::NothingToControl));
        assert_eq!(AgentPlant::identify(limits(), &[]), Err(AgentIdentifyError::TooFew { windows: 0 }));
        let flat = AgentPlant::identify(limits(), &windows(1.0, 0.0));
        assert!(matches!(flat, Err(AgentIdentifyError::NoResponse { .. })), "{flat:?}");
        assert_eq!(tune_agents(&[], &mut || true), None);
    }

    #[test]
    fn no_row_is_better_than_what_is_given_and_it_settles() {
        let plants = [1.0, 0.6].map(|power| AgentPlant::identify(limits(), &windows(0.8, power)).unwrap());
        let tuned = tune_agents(&plants, &mut || true).unwrap();
        assert!(tuned.rows.iter().all(|row| tuned.best.objective <= row.objective), "{tuned:?}");
        assert!(tuned.best.coarsened_s.is_some_and(|s| s < 2.0), "{tuned:?}");
        assert!(tuned.best.refined_s.is_some_and(|s| s < 6.0), "{tuned:?}");
        let RateGains { refine, yielding } = tuned.best.gains;
        assert!(gains::REFINE.contains(refine), "{refine}");
        assert!(gains::YIELD.contains(yielding), "{yielding}");
    }

    #[test]
    fn a_search_that_is_stopped_gives_the_best_of_its_rows() {
        let plant = AgentPlant::identify(limits(), &windows(0.8, 1.0)).unwrap();
        let tuned = tune_agents(&[plant], &mut || false).unwrap();
        assert!(tuned.rows[..3].contains(&tuned.best), "{tuned:?}");
    }
}
