//! Simulation and drawing under one budget: what a rate is worth on the screen, and how two purses share the cores.
//!
//! In: motion on the screen, rates, levels. Out: offers that [`super::Adaptive`] chooses among; a split where there are two purses.
//! Never here: a step of anything. Theory: `docs/theory/budget.md`, eq. 54 … 57.

use alloc::vec::Vec;

use super::menu::Offer;

/// What is shown between two steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Between {
    /// The newest state, held.
    Hold,
    /// The line between the last two states.
    Interpolate,
    /// The newest state, carried on.
    Extrapolate,
}

/// Mean error on the screen of an object simulated at `rate_hz`, pixels (eq. 54).
///
/// `speed_px` a second and `acceleration_px` a second², on the screen. Infinite at a rate that is not above 0.
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

/// One rate or one level of an object: what it costs in a frame, ticks, and its error as a part of the worst, 0 … 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    /// Ticks in a frame.
    pub cost: f64,
    /// Error, 0 (none) … 1 (as good as absent).
    pub error: f64,
}

/// Rates and levels of an object whose worth is their product, as one ladder of pairs (eq. 55): the offers, and the (rate, level) of each.
///
/// Both cost from the same purse. At most 25 pairs matter: five of each are as many as anybody tells apart.
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

/// Halvings of the split: past these the ticks of a second are told apart.
const HALVINGS: u32 = 40;

/// Where two purses share cores: the part of `total` for the first at which one more tick is worth the same in both (eq. 57).
///
/// `prices` gives λ of both for a split (first, second); each falls as its purse grows, in steps. The answer is where the first becomes
/// the lower.
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
