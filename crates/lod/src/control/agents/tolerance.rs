//! The error controller of an agent: the longest steps and the coarsest ε that its tolerance allows.
//!
//! In: after every turn the agent's own error estimate, in space and in time ([`ErrorMeasure`]). Out: occasionally a [`RateDemand`]. Never
//! here: agents, clocks, error estimation. Theory: `docs/theory/control.md`, eq. 34 … 36.

use super::rate::{DEMAND_MIN, RateDemand};
use crate::Bound;

/// An agent's own error estimate after a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorMeasure {
    /// The error caused by its spacing, metres, ≥ 0.
    pub space_m: f64,
    /// The error caused by its steps, metres, ≥ 0.
    pub time_m: f64,
    /// Length of the step made, simulated seconds, > 0.
    pub dt_s: f64,
}

/// Limits of the demands to an agent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorLimits {
    /// The greatest allowed error, metres, > 0.
    pub tolerance_m: f64,
    /// Shortest and longest step, simulated seconds; equal values fix the step.
    pub dt_s: (f64, f64),
    /// Finest and coarsest ε of the simulation, metres; equal values fix ε. `None` for a model without ε.
    pub eps_m: Option<(f64, f64)>,
}

/// Shortest window of a decision, simulated seconds: errors of earlier, longer steps must have faded …
const WINDOW_S: f64 = 1.0;
/// … and fewest turns: an agent estimates its step error twice in 96 of them.
const WINDOW_TURNS: u32 = 192;
/// Target of the error as a fraction of the allowed one.
const SET: f64 = 0.7;
/// Between this fraction and the whole of the allowed error nothing changes.
const LEAST: f64 = 0.45;
/// Greatest coarsening by one decision, and greatest refinement.
const COARSEN_MAX: f64 = 1.5;
const REFINE_MAX: f64 = 4.0;
/// Windows within the tolerance before anything gets coarser; doubled whenever that turns out to have been too early.
const PATIENCE: (u32, u32) = (1, 32);
/// A coarsening counts as confirmed after this many times the patience: a motion that comes and goes within it does not confirm it.
const PROOF: u32 = 16;

/// How the error grows with a value: bounds of the exponent of its power law.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct Orders {
    /// The greatest possible, used to coarsen.
    greatest: f64,
    /// The least possible, used to refine.
    least: f64,
}

/// A spacing ε makes an error of second order.
const ORDERS_OF_EPS: Orders = Orders { greatest: 2.0, least: 2.0 };
/// Steps dt make an error of first order, or of second with an integrator of second order (control.md, eq. 35 and 36).
const ORDERS_OF_DT: Orders = Orders { greatest: 2.0, least: 1.0 };

/// One controlled value, and how the error grows with it.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct ControlledValue {
    range: (f64, f64),
    value: f64,
    orders: Orders,
    turns_within: u32,
    patience: u32,
    /// The value before the last coarsening, if that is not confirmed yet.
    coarsened_from: Option<f64>,
}

/// Controls dt and ε of one agent so that its error stays below a tolerance.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct ErrorControl {
    tolerance_m: f64,
    dt: ControlledValue,
    eps: Option<ControlledValue>,
    turns: u32,
    span_s: f64,
    /// The greatest errors in space and in time in the second half of the window, metres.
    peaks: (f64, f64),
    rest: Option<Bound>,
}

impl ControlledValue {
    fn new(range: (f64, f64), start: f64, orders: Orders) -> Self {
        let range = (range.0, range.1.max(range.0));
        let value = start.clamp(range.0, range.1);
        Self { range, value, orders, turns_within: 0, patience: PATIENCE.0, coarsened_from: None }
    }

    fn steers(&self) -> bool {
        self.range.1 > self.range.0
    }

    fn is_finest(&self) -> bool {
        self.value <= self.range.0
    }

    fn is_coarsest(&self) -> bool {
        self.value >= self.range.1
    }

    /// Updates the value with an error of which at most `allowed_m` is allowed; gives whether the value has changed (eq. 35, 36).
    fn update(&mut self, error_m: f64, allowed_m: f64) -> bool {
        let before = self.value;
        if error_m > allowed_m {
            self.refine(error_m, allowed_m);
        } else {
            self.coarsen(error_m, allowed_m);
        }
        let moved = (self.value / before).ln();
        let at_an_end = self.is_finest() || self.is_coarsest();
        if moved.abs() < DEMAND_MIN && !at_an_end {
            self.value = before;
        }
        if self.value > before {
            (self.coarsened_from, self.turns_within) = (Some(before), 0);
        }
        self.value != before
    }

    fn refine(&mut self, error_m: f64, allowed_m: f64) {
        self.turns_within = 0;
        let wanted = libm::pow(SET * allowed_m / error_m, 1.0 / self.orders.least).max(1.0 / REFINE_MAX);
        self.value = (self.value * wanted).max(self.range.0);
        if let Some(from) = self.coarsened_from.take() {
            self.patience = (2 * self.patience).min(PATIENCE.1);
            self.value = self.value.min(from);
        }
    }

    fn coarsen(&mut self, error_m: f64, allowed_m: f64) {
        self.turns_within = self.turns_within.saturating_add(1);
        if self.turns_within >= PROOF * self.patience && self.coarsened_from.take().is_some() {
            self.patience = (self.patience / 2).max(PATIENCE.0);
        }
        if error_m < LEAST * allowed_m && self.turns_within >= self.patience {
            let wanted = libm::pow(SET * allowed_m / error_m.max(f64::MIN_POSITIVE), 1.0 / self.orders.greatest);
            self.value = (self.value * wanted.min(COARSEN_MAX)).min(self.range.1);
        }
    }
}

impl ErrorControl {
    /// A controller of an agent with the present dt and ε of `now`.
    #[must_use]
    pub fn new(limits: &ErrorLimits, now: RateDemand) -> Self {
        let eps = limits.eps_m.zip(now.eps_m).map(|(range, eps)| ControlledValue::new(range, eps, ORDERS_OF_EPS));
        Self {
            tolerance_m: limits.tolerance_m,
            dt: ControlledValue::new(limits.dt_s, now.dt_s, ORDERS_OF_DT),
            eps,
            turns: 0,
            span_s: 0.0,
            peaks: (0.0, 0.0),
            rest: None,
        }
    }

    /// Whether anything can be controlled.
    #[must_use]
    pub fn steers(&self) -> bool {
        self.dt.steers() || self.eps.is_some_and(|eps| eps.steers())
    }

    /// Reports the error after a turn; gives a demand when dt or ε should change. An invalid measurement is left out.
    pub fn after_turn(&mut self, turn: &ErrorMeasure) -> Option<RateDemand> {
        let ErrorMeasure { space_m, time_m, dt_s } = *turn;
        let sound = [space_m, time_m].iter().all(|error| error.is_finite() && *error >= 0.0);
        if !(sound && dt_s > 0.0 && dt_s.is_finite()) {
            return None;
        }
        (self.turns, self.span_s) = (self.turns + 1, self.span_s + dt_s);
        if self.span_s >= 0.5 * WINDOW_S && self.turns >= WINDOW_TURNS / 2 {
            self.peaks = (self.peaks.0.max(space_m), self.peaks.1.max(time_m));
        }
        if self.span_s < WINDOW_S || self.turns < WINDOW_TURNS {
            return None;
        }
        (self.turns, self.span_s) = (0, 0.0);
        let (space_m, time_m) = std::mem::take(&mut self.peaks);
        self.decide(space_m, time_m).then(|| self.demand())
    }

    /// Evaluates a window; gives whether anything is to change (eq. 34).
    fn decide(&mut self, space_m: f64, time_m: f64) -> bool {
        let whole = self.tolerance_m;
        let left = |other: &ControlledValue, error_m: f64| {
            let least = if other.is_finest() { 0.0 } else { 0.5 * whole };
            (whole - error_m).max(least)
        };
        let for_time = self.eps.as_ref().map_or((whole - space_m).max(0.0), |eps| left(eps, space_m));
        let for_space = left(&self.dt, time_m);
        let mut changed = self.dt.update(time_m, for_time);
        if let Some(eps) = &mut self.eps {
            changed |= eps.update(space_m, for_space);
        }
        let finest = self.dt.is_finest() && self.eps.is_none_or(|eps| eps.is_finest());
        let coarsest = self.dt.is_coarsest() && self.eps.is_none_or(|eps| eps.is_coarsest());
        self.rest = match space_m + time_m <= whole {
            false if finest && !changed => Some(Bound::Finest),
            true if coarsest && !changed => Some(Bound::Coarsest),
            _ => None,
        };
        changed
    }

    /// The present demand.
    #[must_use]
    pub fn demand(&self) -> RateDemand {
        RateDemand { dt_s: self.dt.value, eps_m: self.eps.map(|eps| eps.value) }
    }

    /// The end at which the agent rests: finest and still past its tolerance, or coarsest and within it.
    #[must_use]
    pub fn rest(&self) -> Option<Bound> {
        self.rest
    }
}

#[cfg(test)]
mod tests;
