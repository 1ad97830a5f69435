//! Simulation and drawing under one budget: the benefit of a step rate on the screen, and how two budgets share the cores.
//!
//! In: motion on the screen, rates, levels. Out: offers that [`super::Adaptive`] chooses among; for two budgets a split, computed directly
//! or found over several frames ([`SharedPrice`]). Never here: stepping. Theory: `docs/theory/budget.md`, eq. 54 … 59.

use alloc::vec::Vec;

use super::options::Offer;

/// The state shown between two steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Between {
    /// The newest state, held.
    Hold,
    /// Linear interpolation between the last two states.
    Interpolate,
    /// The newest state, extrapolated.
    Extrapolate,
}

/// Mean error on the screen of an object simulated at `rate_hz`, pixels (eq. 54).
///
/// `speed_px` per second and `acceleration_px` per second², on the screen. Infinite at a rate that is not above 0.
#[must_use]
pub fn temporal_error_px(between: Between, speed_px: f64, acceleration_px: f64, rate_hz: f64) -> f64 {
    if rate_hz.is_nan() || rate_hz <= 0.0 {
        return f64::INFINITY;
    }
    match between {
        Between::Hold => speed_px / (2.0 * rate_hz),
        Between::Interpolate => acceleration_px / (8.0 * rate_hz * rate_hz),
        Between::Extrapolate => acceleration_px / (6.0 * rate_hz * rate_hz),
    }
}

/// One rate or one level of an object: its cost in a frame, ticks, and its error as a fraction of the worst, 0 … 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    /// Ticks in a frame.
    pub cost: f64,
    /// Error, 0 (none) … 1 (as good as absent).
    pub error: f64,
}

/// Rates and levels of an object whose benefit is their product, as one ladder of pairs (eq. 55): the offers, and the (rate, level) of
/// each.
///
/// Both are paid from the same budget. At most 25 pairs matter: more than five of each are not perceptibly different.
#[must_use]
pub fn pairs(rates: &[Choice], levels: &[Choice]) -> (Vec<Offer>, Vec<(u32, u32)>) {
    let left = |error: f64| {
        if error > 0.0 {
            1.0 - error.min(1.0)
        } else if error.is_nan() {
            0.0
        } else {
            1.0
        }
    };
    let both = |(r, rate): (u32, &Choice)| {
        let of = move |(l, level): (u32, &Choice)| {
            let offer = Offer { cost: rate.cost + level.cost, gain: left(rate.error) * left(level.error) };
            (offer, (r, l))
        };
        (0..).zip(levels).map(of).collect::<Vec<_>>()
    };
    (0..).zip(rates).flat_map(both).unzip()
}

/// Halvings of the split: enough to resolve the ticks of a second.
const HALVINGS: u32 = 40;

/// For two budgets that share cores: the part of `total` for the first at which one more tick gains the same in both (eq. 57).
///
/// `prices` gives λ of both for a split (first, second); each falls stepwise as its budget grows. The result is where the first becomes the
/// lower.
pub fn even_split(total: f64, mut prices: impl FnMut(f64, f64) -> (f64, f64)) -> f64 {
    let (mut low, mut high) = (0.0, total);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        let (first, second) = prices(middle, total - middle);
        if first > second {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// An agent that steps on the processor that draws, as the shared price sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Worker {
    /// Ticks of a frame's time that the agent takes at its finest, > 0.
    pub full: f64,
    /// The least fraction of that, 0 … 1, that the agent needs.
    pub least: f64,
    /// Weighted gain lost to the agent's error at its finest, ≥ 0; half the work doubles the error.
    pub loss: f64,
}

impl Worker {
    /// The fraction of the full work at which one more tick gains `lambda` (eq. 58): all of it where ticks are free.
    #[must_use]
    pub fn part(&self, lambda: f64) -> f64 {
        let part = libm::sqrt(self.loss / (lambda * self.full));
        let least = crate::within(self.least, 0.0, 1.0);
        if part.is_nan() { 1.0 } else { part.min(1.0).max(least) }
    }

    fn taken(&self, lambda: f64) -> f64 {
        if self.full > 0.0 { self.full * self.part(lambda) } else { 0.0 }
    }
}

/// Ticks that `workers` take at price `lambda`.
#[must_use]
pub fn taken(workers: &[Worker], lambda: f64) -> f64 {
    workers.iter().map(|worker| worker.taken(lambda)).sum()
}

/// The range of prices that makes a difference to `workers`: below it every worker does its full work, above it no worker does more than
/// its least.
fn prices(workers: &[Worker]) -> (f64, f64) {
    let sound = workers.iter().filter(|worker| worker.full > 0.0 && worker.loss > 0.0);
    let of = |worker: &Worker, part: f64| worker.loss / (worker.full * part * part);
    sound.fold((f64::MAX, f64::MIN_POSITIVE), |(low, high), worker| {
        let least = crate::within(worker.least, LEAST_PART, 1.0);
        (low.min(of(worker, 1.0)), high.max(of(worker, least)))
    })
}

/// The price at which `workers` take no more than `ticks`; 0 if they do so at no price, the greatest that makes a difference if they never
/// do.
#[must_use]
pub fn price(workers: &[Worker], ticks: f64) -> f64 {
    if taken(workers, 0.0) <= ticks {
        return 0.0;
    }
    let (low, high) = prices(workers);
    let (mut low, mut high) = (libm::log(low.min(high)), libm::log(high));
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if taken(workers, libm::exp(middle)) > ticks {
            low = middle;
        } else {
            high = middle;
        }
    }
    libm::exp(high)
}

/// Least fraction of its work that any worker is assumed to need when prices are computed.
const LEAST_PART: f64 = 1e-3;
/// Fraction of the distance to the drawing's price that one frame covers: agents respond within a quarter of a second, and the price must
/// not outrun them.
const PRICE_STEP: f64 = 0.05;
/// Limit of that distance, |Δ ln λ|, in one frame: prices are step functions.
const PRICE_STEP_MAX: f64 = 1.0;
/// Relative fall of the price per frame while drawing has all the time it requests.
const PRICE_DECAY: f64 = 0.02;

/// The state of drawing, as the shared price sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawing {
    /// Ticks that a frame would take if nothing else needed any.
    pub wants: f64,
    /// λ: gain of one more tick for the picture; 0 where drawing has all it requests.
    pub lambda: f64,
}

/// One price for simulation and drawing on shared cores, found over several frames (eq. 59).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SharedPrice {
    lambda: Option<f64>,
}

impl SharedPrice {
    /// The price of a tick in the next frame, and the ticks that drawing may take; `None` where `capacity` ticks are enough for all, so
    /// that no agent reduces its work.
    pub fn settle(&mut self, workers: &[Worker], capacity: f64, drawing: Drawing) -> Option<(f64, f64)> {
        let full = taken(workers, 0.0);
        // workers that take nothing have nothing to give up
        let short = full > 0.0 && full + drawing.wants > capacity;
        if !short {
            self.lambda = None;
            return None;
        }
        let lambda = match self.lambda {
            // drawing gets the capacity that it requests, but at most half of it all
            None => price(workers, (capacity - drawing.wants).max(0.5 * capacity)),
            Some(held) if drawing.lambda > 0.0 => {
                held * libm::exp(
                    PRICE_STEP * crate::within(libm::log(drawing.lambda / held), -PRICE_STEP_MAX, PRICE_STEP_MAX),
                )
            }
            Some(held) => held * (1.0 - PRICE_DECAY),
        };
        let (low, high) = prices(workers);
        let lambda = lambda.max(low.min(high)).min(high);
        self.lambda = Some(lambda);
        Some((lambda, (capacity - taken(workers, lambda)).max(0.0)))
    }
}
