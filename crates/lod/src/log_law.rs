//! The corrected law: ln ε ← ln ε + κ ln(t / T), whose gain does not depend on the machine.
//!
//! In: measured time over target time. Out: ln ε, inside its range, and the state of the law ([`Rest`]). Never here: the meaning of ε, or
//! where the time was measured. Theory: `docs/theory/control.md`, eq. 7 … 12.

use crate::{Bound, within};

/// Clamp of the error of one update, |ln(t/T)|: a frame four times too slow. At κ = ½ one update halves the work at most.
pub const ERROR_MAX: f64 = 2.0 * core::f64::consts::LN_2;

/// Clamp of an unconfirmed error, ln 1.5: a larger error counts in full only if the one before was as large, on the same side. So a single
/// frame of five times its time costs e^(−κ ln 1.5) = 18 % of the polygons, and a load that stays counts in full one frame later.
pub const UNCONFIRMED_ERROR_MAX: f64 = 0.405_465_108_108_164_4;

/// Nearer to the target time than this, |ln(t/T)|, a time that no level improves counts as settled.
const NEAR: f64 = 0.05;

/// The range of κ.
pub const KAPPA: (f64, f64) = (1e-3, 1.99);
/// The range of λ.
pub const LEAD: (f64, f64) = (0.0, 1.99);

/// The gain and the dead zone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// κ, 0.001 … 1.99: the share of an error (of logarithms) that one update removes if all time is work that ε scales. Below 1 the loop is
    /// stable in every scene, also if a measurement comes one frame late; from 1 on only where the share s of work that ε scales keeps κ s
    /// below 1 (control.md, eq. 8).
    pub kappa: f64,
    /// λ, 0 … 1.99: the share of an error's change that an update adds: a PI law, with κ as its integral part. 0 is the law of eq. 7.
    pub lead: f64,
    /// ln(T/t) above which a frame was early enough to refine; ≥ 0.
    pub early: f64,
    /// ln(t/T) above which a frame was late enough to coarsen; ≥ 0.
    pub late: f64,
}

impl Default for Gains {
    /// κ = ½, dead zone of 2 % to either side: settles from ε four times wrong within 20 frames if at least a third of the target time is
    /// work that ε scales (control.md, table 1).
    fn default() -> Self {
        Self { kappa: 0.5, lead: 0.0, early: 0.02, late: 0.02 }
    }
}

impl Gains {
    fn sound(self) -> Self {
        let kappa = if self.kappa.is_finite() { within(self.kappa, KAPPA.0, KAPPA.1) } else { Self::default().kappa };
        let width = |w: f64| if w.is_finite() { w.max(0.0) } else { 0.0 };
        Self { kappa, lead: within(width(self.lead), LEAD.0, LEAD.1), early: width(self.early), late: width(self.late) }
    }
}

/// The outcome of the last update.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rest {
    /// ε moved.
    Moving,
    /// The time was on target, within the dead zone.
    Settled,
    /// The law would pass this end of its range and stays there.
    Clamped(Bound),
    /// There is time left, but not enough for the next finer level that the picture has.
    BetweenLevels,
}

/// The state of the corrected law: the logarithm of a coarseness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogLaw {
    gains: Gains,
    range: (f64, f64),
    value: f64,
    /// The error before this one; `None` before the first, which counts as confirmed.
    before: Option<f64>,
    /// The error after clamping.
    clamped_error: Option<f64>,
    rest: Rest,
}

impl LogLaw {
    /// A law for ln ε inside `range` (finest, coarsest; finite), starting at `start` or the end nearest to it.
    #[must_use]
    pub fn new(gains: Gains, range: (f64, f64), start: f64) -> Self {
        Self {
            gains: gains.sound(),
            range,
            value: within(start, range.0, range.1),
            before: None,
            clamped_error: None,
            rest: Rest::Moving,
        }
    }

    /// Updates the law: work took `ratio` = t/T of its target time (control.md, eq. 7). Gives the outcome.
    ///
    /// `granted` is ln ε of the picture actually shown, where levels are coarser than requested (control.md, eq. 12); `None` where the
    /// picture follows exactly. A ratio that is not above zero and finite is ignored.
    pub fn observe(&mut self, ratio: f64, granted: Option<f64>) -> Rest {
        if !(ratio.is_finite() && ratio > 0.0) {
            return self.rest;
        }
        let error = self.clamped_error(libm::log(ratio));
        let change = self.clamped_error.map_or(0.0, |before| self.gains.lead * (error - before));
        self.clamped_error = Some(error);
        let granted = granted.filter(|g| g.is_finite());
        self.rest = if error > self.gains.late {
            self.coarsen_by(self.gains.kappa * (error - self.gains.late) + change, granted)
        } else if error < -self.gains.early {
            self.refine(error, change, granted)
        } else {
            Rest::Settled
        };
        self.rest
    }

    /// The error after clamping: tighter if the one before does not confirm it (control.md, eq. 9).
    fn clamped_error(&mut self, error: f64) -> f64 {
        let confirmed = self.before.is_none_or(|before| before * error > 0.0 && before.abs() > UNCONFIRMED_ERROR_MAX);
        self.before = Some(error);
        let most = if confirmed { ERROR_MAX } else { UNCONFIRMED_ERROR_MAX };
        within(error, -most, most)
    }

    fn coarsen_by(&mut self, step: f64, granted: Option<f64>) -> Rest {
        let from = granted.map_or(self.value, |g| g.max(self.value));
        self.value = within(from + step, self.range.0, self.range.1);
        if from + step > self.range.1 { Rest::Clamped(Bound::Coarsest) } else { Rest::Moving }
    }

    fn refine(&mut self, error: f64, change: f64, granted: Option<f64>) -> Rest {
        let wish = self.value + self.gains.kappa * (error + self.gains.early) + change;
        // if all of the time were work that ε scales, anything finer than this would be late
        let finest_in_time = granted.map_or(f64::NEG_INFINITY, |g| g + error - self.gains.late);
        self.value = within(wish.max(finest_in_time), self.range.0, self.range.1);
        match (wish < self.range.0, wish < finest_in_time) {
            (true, _) if self.value == self.range.0 => Rest::Clamped(Bound::Finest),
            (_, true) if error < -NEAR => Rest::BetweenLevels,
            (_, true) => Rest::Settled,
            _ => Rest::Moving,
        }
    }

    /// ln ε, always inside the range.
    #[must_use]
    pub fn value(&self) -> f64 {
        self.value
    }

    /// The outcome of the last update.
    #[must_use]
    pub fn rest(&self) -> Rest {
        self.rest
    }

    /// The range of ln ε: (finest, coarsest).
    #[must_use]
    pub fn range(&self) -> (f64, f64) {
        self.range
    }

    /// Sets another range (finest, coarsest; finite); the value moves inside it.
    pub fn set_range(&mut self, range: (f64, f64)) {
        self.range = range;
        self.value = within(self.value, range.0, range.1);
    }

    /// Moves to `value`, or the end of the range nearest to it: a start, or a disturbance from outside.
    pub fn set_value(&mut self, value: f64) {
        self.value = within(value, self.range.0, self.range.1);
    }

    /// Sets other gains from the next update on; the value stays. κ is clamped to 0.01 … 1.99.
    pub fn set_gains(&mut self, gains: Gains) {
        self.gains = gains.sound();
    }

    /// The gains in use.
    #[must_use]
    pub fn gains(&self) -> Gains {
        self.gains
    }
}
