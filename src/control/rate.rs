//! An agent's own controller: dt and ε of its simulation from what its turns take.
//!
//! In: a [`TurnMeasure`] after every turn. Out: now and then a [`RateDemand`]. Never here: agents, clocks.
//! One loop variable climbs two stairs: first ε grows to its coarsest, then dt to its longest; it comes down the other way.
//! Theory: `docs/theory/control.md`, eq. 17 … 19.

use metachron_budget::Bound;
use metachron_budget::log_law::{Gains, LogLaw, Rest};

/// What a turn took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnMeasure {
    /// Time the turn took, seconds, > 0.
    pub work_s: f64,
    /// Time between turns at the rate that the scene wants, seconds, > 0: at a dt of [`RateLimits::dt_wanted_s`].
    pub wanted_period_s: f64,
    /// Time between turns as it is, seconds, > 0, smoothed over a few of them.
    pub real_period_s: f64,
    /// Length of the step that the agent made, simulated seconds, > 0.
    pub dt_s: f64,
}

/// What a controller may ask of an agent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateLimits {
    /// Length of a step at the rate that is wanted, simulated seconds, > 0.
    pub dt_wanted_s: f64,
    /// Longest step, simulated seconds. Not above `dt_wanted_s` means: the rate is fixed.
    pub dt_max_s: f64,
    /// Finest and coarsest ε of the simulation, metres; alike means: ε is fixed. `None` for a model without ε.
    pub eps_m: Option<(f64, f64)>,
    /// The share of its period that the agent's work may take, 0.01 … 1. Cores over agents, and some room, is fair.
    pub share: f64,
}

/// What an agent is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateDemand {
    /// Length of a step, simulated seconds.
    pub dt_s: f64,
    /// ε of the simulation, metres; `None` for a model without ε.
    pub eps_m: Option<f64>,
}

/// A lesson is the mean of this long, seconds: many turns, so that one hiccup is none.
const WINDOW_S: f64 = 0.25;

/// … and of at least this many turns.
const WINDOW_TURNS: u32 = 8;

/// A turn of more than this many times the last window's mean counts as this many: the scheduler's hiccups are not the agent's.
const SPIKE: f64 = 4.0;

/// Later than this, real over wanted period, an agent is late whatever its own work is.
const LATE: f64 = 1.03;

/// Least |Δ ln| of a demand: re-meshing costs accuracy, 10 % of ε are not worth it.
const RETUNE_MIN: f64 = 0.095;

/// Windows without lateness before anything gets finer: a second at first, doubled whenever that turns out to have been too soon.
const PATIENCE: (u32, u32) = (4, 128);

/// The most that one demand refines, ln 1.25: who was kept late by others finds out cheaply that they still are there.
const REFINE_MAX: f64 = 0.223;

/// Dead between 80 % and 105 % of the share: wider than [`RETUNE_MIN`], so that there is always an ε at which it rests.
const GAINS: Gains = Gains { kappa: 0.5, lead: 0.0, early: 0.223, late: 0.049 };

#[derive(Debug, Clone, Copy, Default)]
struct Window {
    turns: u32,
    span_s: f64,
    work_s: f64,
    wanted_s: f64,
    late: f64,
}

/// Steers dt and ε of one agent.
#[derive(Debug, Clone)]
pub struct RateControl {
    limits: RateLimits,
    law: LogLaw,
    /// ln(coarsest ε / finest ε): where the first stair ends.
    landing: f64,
    window: Window,
    /// Mean work of a turn in the last window.
    usual_s: Option<f64>,
    /// What it would take of a core at its finest, by the last window.
    full_load: Option<f64>,
    /// The loop variable at the last demand.
    asked: f64,
    /// ln(ε that somebody may tell from a finer one / finest ε), from 0.
    plain: f64,
    /// Where on the stairs the agent was last sent.
    sent: f64,
    calm: u32,
    patience: u32,
    /// The loop variable before the last demand, if that was for something finer and has not proved itself yet.
    refined_from: Option<f64>,
}

impl RateControl {
    /// A controller of an agent that steps by `dt_wanted_s` and simulates at `eps_m` now.
    #[must_use]
    pub fn new(limits: RateLimits, eps_m: Option<f64>) -> Self {
        let landing = limits.eps_m.map_or(0.0, |(fine, coarse)| ratio_ln(coarse, fine));
        let top = landing + ratio_ln(limits.dt_max_s, limits.dt_wanted_s);
        let start = eps_m.zip(limits.eps_m).map_or(0.0, |(now, (fine, _))| ratio_ln(now, fine).min(landing));
        let limits =
            RateLimits { share: if limits.share > 0.0 { limits.share.clamp(0.01, 1.0) } else { 1.0 }, ..limits };
        Self {
            limits,
            law: LogLaw::new(GAINS, (0.0, top), start),
            landing,
            window: Window::default(),
            usual_s: None,
            full_load: None,
            asked: start,
            plain: 0.0,
            sent: start,
            calm: 0,
            patience: PATIENCE.0,
            refined_from: None,
        }
    }

    /// Whether there is anything to steer: fixed values switch it off.
    #[must_use]
    pub fn steers(&self) -> bool {
        self.law.range().1 > 0.0
    }

    /// Changes the share of its period that the agent's work may take: 0.001 … 1; anything else is ignored.
    pub fn set_share(&mut self, share: f64) {
        if share > 0.0 {
            self.limits.share = share.clamp(1e-3, 1.0);
        }
    }

    /// The share of its period that the agent's work may take.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.limits.share
    }

    /// Says which ε is as fine as anybody can see, metres, > 0; +∞ where nobody looks. Until it is said again the agent is asked for
    /// nothing finer, and comes back to where it was when it may.
    pub fn set_plain(&mut self, eps_m: f64) {
        if let Some((fine, _)) = self.limits.eps_m {
            self.plain = if eps_m == f64::INFINITY { self.landing } else { ratio_ln(eps_m, fine).min(self.landing) };
        }
    }

    /// Where on the stairs the agent belongs.
    fn held(&self) -> f64 {
        self.asked.max(self.plain)
    }

    /// What the agent would take of a core at its finest ε and the rate that is wanted, from 0; `None` before anything was measured.
    /// Work falls as 1/ε and as 1/dt.
    #[must_use]
    pub fn full_load(&self) -> Option<f64> {
        self.full_load
    }

    /// The least part of that load that it can do with, 0 … 1: at its coarsest ε and longest dt.
    #[must_use]
    pub fn least_part(&self) -> f64 {
        libm::exp(-self.law.range().1)
    }

    /// Learns what a turn took; gives a demand when it is time for another dt or ε.
    pub fn after_turn(&mut self, turn: &TurnMeasure) -> Option<RateDemand> {
        if !self.steers() || !self.collect(turn) {
            return None;
        }
        let window = std::mem::take(&mut self.window);
        self.usual_s = Some(window.work_s / f64::from(window.turns));
        // on both stairs the load falls as e⁻ᶻ
        self.full_load = Some(window.work_s / window.wanted_s * libm::exp(self.sent));
        self.learn(&window);
        self.demand_if_worth_it()
    }

    /// Adds a turn to the window; `true` when the window is full. A measure that is none is left out.
    fn collect(&mut self, turn: &TurnMeasure) -> bool {
        let all = [turn.work_s, turn.wanted_period_s, turn.real_period_s, turn.dt_s];
        if !all.iter().all(|x| x.is_finite() && *x > 0.0) {
            return false;
        }
        // the period that belongs to the step the agent makes now
        let wanted_s = turn.wanted_period_s * turn.dt_s / self.limits.dt_wanted_s;
        if !(wanted_s.is_finite() && wanted_s > 0.0) {
            return false;
        }
        let window = &mut self.window;
        window.turns += 1;
        window.span_s += turn.real_period_s.max(wanted_s);
        window.work_s += self.usual_s.map_or(turn.work_s, |usual| turn.work_s.min(SPIKE * usual));
        window.wanted_s += wanted_s;
        window.late += turn.real_period_s / wanted_s;
        window.span_s >= WINDOW_S && window.turns >= WINDOW_TURNS
    }

    /// t/T = max(work / (share · period), real period / wanted where that is late) (control.md, eq. 17).
    fn learn(&mut self, window: &Window) {
        let load = window.work_s / (self.limits.share * window.wanted_s);
        let lateness = window.late / f64::from(window.turns);
        let ratio = if lateness > LATE { load.max(lateness) } else { load };
        let eased = self.sent > self.asked;
        if ratio > 1.0 + GAINS.late {
            self.calm = 0;
            if eased {
                self.law.set_value(self.sent);
            }
            self.law.observe(ratio, None);
            self.take_back();
            return;
        }
        if eased {
            // what it does with less work says nothing of what it could bear
            return;
        }
        self.calm = self.calm.saturating_add(1);
        if self.calm >= 2 * self.patience && self.refined_from.take().is_some() {
            self.patience = (self.patience / 2).max(PATIENCE.0);
        }
        if self.calm >= self.patience || ratio > (-GAINS.early).exp() {
            self.law.observe(ratio, None);
            self.law.set_value(self.law.value().max(self.asked - REFINE_MAX));
        }
    }

    /// Late: what was refined last was too much, is taken back, and tried again after twice as long.
    fn take_back(&mut self) {
        if let Some(before) = self.refined_from.take() {
            self.patience = (2 * self.patience).min(PATIENCE.1);
            self.law.set_value(self.law.value().max(before));
        }
    }

    fn demand_if_worth_it(&mut self) -> Option<RateDemand> {
        let (value, held) = (self.law.value(), self.asked);
        if self.is_worth_it(held, value) {
            if value < held {
                (self.refined_from, self.calm) = (Some(held), 0);
            }
            self.asked = value;
        }
        if !self.is_worth_it(self.sent, self.held()) {
            return None;
        }
        self.sent = self.held();
        Some(self.demand())
    }

    fn is_worth_it(&self, from: f64, to: f64) -> bool {
        let (least, most) = self.law.range();
        to != from && ((to - from).abs() >= RETUNE_MIN || to <= least || to >= most)
    }

    /// What is asked for at present (control.md, eq. 18).
    #[must_use]
    pub fn demand(&self) -> RateDemand {
        let on_stair = |fine: f64, coarse: f64, rise: f64| (fine * libm::exp(rise)).min(coarse.max(fine));
        let eps_m = self.limits.eps_m.map(|(fine, coarse)| on_stair(fine, coarse, self.held().min(self.landing)));
        let dt_s = on_stair(self.limits.dt_wanted_s, self.limits.dt_max_s, (self.held() - self.landing).max(0.0));
        RateDemand { dt_s, eps_m }
    }

    /// The end at which the agent rests: finest with time to spare, or coarsest and still late.
    #[must_use]
    pub fn rest(&self) -> Option<Bound> {
        if let Rest::Clamped(bound) = self.law.rest() { Some(bound) } else { None }
    }
}

/// ln(a/b), 0 where b is not below a or one of them is no length.
fn ratio_ln(a: f64, b: f64) -> f64 {
    if a.is_finite() && b > 0.0 && a > b { libm::log(a / b) } else { 0.0 }
}

#[cfg(test)]
mod tests;
