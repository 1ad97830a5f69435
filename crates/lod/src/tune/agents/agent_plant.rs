//! The response of an agent's load to its step and spacing, identified from an experiment, and its loop played on that.
//!
//! In: windows of turns at designed z. Out: ln load = ln full − q z, and turns of [`RateControl`] on it. Never here: the turns of the
//! experiment, a judgement. Theory: `docs/theory/control.md`, eq. 18 and 31a.

use crate::control::{RateControl, RateDemand, RateGains, RateLimits, TurnMeasure};
use crate::tune::loops::disturbance::{Disturbance, Random};
use crate::tune::loops::robust_fit::Line;

/// Turns of an agent at one step and spacing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AgentWindow {
    /// Logarithm of the work that is saved against the finest, by theory: [`RateLimits::z_of`] of the step and spacing.
    pub z: f64,
    /// Work of the turns over their periods, as a fraction of a core, > 0.
    pub load: f64,
}

/// An agent's load on a machine, as its controller sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct AgentPlant {
    /// The ranges of step and spacing, and the share of a core that the load is held at.
    pub limits: RateLimits,
    /// Load at the finest, as a fraction of a core.
    pub full_load: f64,
    /// q: by how much ln load falls for each unit of z; 1 where work goes with the elements and the steps alone.
    pub power: f64,
    /// The 95 % confidence interval of q.
    pub power_95: (f64, f64),
    /// Typical distance of a window from the line, of logarithms: 1.4826 times the median.
    pub scatter: f64,
}

/// Why an agent has no loop to tune.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AgentIdentifyError {
    /// Its step and its spacing are fixed.
    #[error("its step and its spacing are fixed")]
    NothingToControl,
    /// Its load does not fall.
    #[error(
        "its load does not fall with longer steps and coarser spacing (by e^(−q z) with q = {power:.2}, 95 % between {low:.2} and {high:.2})"
    )]
    NoResponse {
        /// q.
        power: f64,
        /// Lower end of its interval.
        low: f64,
        /// Upper end of its interval.
        high: f64,
    },
    /// Too few windows, or invalid ones.
    #[error("{windows} windows with a valid load are too few: at least {WINDOWS_MIN} are needed")]
    TooFew {
        /// Usable windows.
        windows: usize,
    },
}

/// Least number of windows for an identification.
const WINDOWS_MIN: usize = 8;
/// Standard deviations in a median of absolute deviations.
const DEVIATIONS: f64 = 1.4826;

impl AgentPlant {
    /// Fits the plant of an agent to the windows of its experiment.
    ///
    /// # Errors
    /// [`AgentIdentifyError`] if there is none.
    pub fn identify(limits: RateLimits, windows: &[AgentWindow]) -> Result<Self, AgentIdentifyError> {
        if limits.top() <= 0.0 {
            return Err(AgentIdentifyError::NothingToControl);
        }
        let sound = |w: &&AgentWindow| w.z.is_finite() && w.load > 0.0 && w.load.is_finite();
        let points: Vec<_> = windows.iter().filter(sound).map(|w| (w.z, libm::log(w.load))).collect();
        let line = Line::through(&points).ok_or(AgentIdentifyError::TooFew { windows: points.len() })?;
        let (power, power_95) = (-line.slope, (-line.slope_95.1, -line.slope_95.0));
        if power_95.0 <= 0.0 {
            return Err(AgentIdentifyError::NoResponse { power, low: power_95.0, high: power_95.1 });
        }
        let mut off: Vec<_> = points.iter().map(|(z, ln)| libm::fabs(ln - line.at(*z))).collect();
        off.sort_unstable_by(f64::total_cmp);
        let scatter = DEVIATIONS * off[off.len() / 2];
        Ok(Self { limits, full_load: libm::exp(line.intercept), power, power_95, scatter })
    }

    /// z at which the load of an agent of `full_load` is its share, inside its range.
    #[must_use]
    pub fn rest_z(&self, full_load: f64) -> f64 {
        (libm::log(full_load / self.limits.share) / self.power).clamp(0.0, self.limits.top())
    }
}

/// A trial of an agent's loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AgentTrial {
    /// z at the start.
    pub start_z: f64,
    /// Load at the finest, as a fraction of a core.
    pub full_load: f64,
    /// The changes of the agent's work.
    pub disturbance: Disturbance,
    /// Part of a core that others take from it in the middle third of the trial.
    pub others: f64,
    /// Duration, seconds.
    pub seconds: f64,
    /// Seed of noise and spikes.
    pub seed: u64,
}

/// A turn of a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AgentTurn {
    /// When it ended, seconds.
    pub time_s: f64,
    /// z of its step and spacing.
    pub z: f64,
    /// z at which the agent would keep to its share just now.
    pub rest_z: f64,
    /// Its load over the agent's share.
    pub load: f64,
    /// Whether it took longer than its period.
    pub is_late: bool,
}

/// Past this part of its period a turn was late.
const LATE: f64 = 1.03;

/// Plays the law with `gains` on `plant`.
pub(super) fn play_agent(plant: &AgentPlant, gains: RateGains, trial: &AgentTrial) -> Vec<AgentTurn> {
    let limits = plant.limits;
    let mut now: RateDemand = limits.demand(trial.start_z);
    let mut control = RateControl::new(limits, gains, now.eps_m);
    let (mut time_s, mut random, mut turns) = (0.0, Random::new(trial.seed), Vec::new());
    while time_s < trial.seconds {
        let passed = time_s / trial.seconds;
        let noise = libm::exp(plant.scatter * random.normal());
        let full = trial.full_load * trial.disturbance.load(passed, random.uniform());
        let z = limits.z_of(&now);
        let load = full * noise * libm::exp(-plant.power * z);
        let others = if (1.0 / 3.0..2.0 / 3.0).contains(&passed) { trial.others } else { 0.0 };
        let real_period_s = now.dt_s * (load + others).max(1.0);
        time_s += real_period_s;
        let turn = AgentTurn {
            time_s,
            z,
            rest_z: plant.rest_z(full),
            load: load / limits.share,
            is_late: real_period_s > LATE * now.dt_s,
        };
        turns.push(turn);
        let measure =
            TurnMeasure { work_s: load * now.dt_s, wanted_period_s: limits.dt_wanted_s, real_period_s, dt_s: now.dt_s };
        now = control.after_turn(&measure).unwrap_or(now);
    }
    turns
}
