//! One budget shared by weight: each party gets weight × level, inside its own least and most.
//!
//! In: a budget and [`Share`]s. Out: the water level μ at which the shares add up to the budget.
//! Never here: the composition of the budget. Theory: `docs/theory/control.md`, eq. 14.

/// The claim of one party on a budget.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// Amount per unit of the level; finite, > 0.
    pub weight: f64,
    /// Least amount; finite, ≥ 0.
    pub least: f64,
    /// Greatest amount; finite, ≥ `least`.
    pub most: f64,
}

impl Share {
    /// Amount at level `mu`: weight · μ inside the least and the most.
    #[must_use]
    pub fn at(&self, mu: f64) -> f64 {
        crate::within(self.weight * mu, self.least, self.most)
    }
}

/// Tolerance of the sum, relative to the budget: far below one polygon of any picture.
const TOLERANCE: f64 = 1e-9;

/// Halvings that exhaust any bracket of doubles.
const ROUNDS_MAX: u32 = 200;

/// The level μ ≥ 0 at which the shares add up to `budget`; the nearest possible level if they cannot.
///
/// The sum is piecewise linear and rising in μ: Newton's method, exact on its last piece, safeguarded by a bracket. `start` is a guess (the
/// last frame's level): with a good one two or three passes over the shares suffice.
#[must_use]
pub fn water_level<I>(budget: f64, shares: I, start: f64) -> f64
where
    I: Iterator<Item = Share> + Clone,
{
    // every share is at its least at `lo` and at its most at `hi`
    let lo = shares.clone().map(|s| s.least / s.weight).fold(f64::INFINITY, f64::min);
    let hi = shares.clone().map(|s| s.most / s.weight).fold(0.0, f64::max);
    if lo > hi {
        return 0.0; // no shares
    }
    let (mut below, mut above) = (lo, hi);
    let mut mu = crate::within(start, lo, hi);
    for _ in 0..ROUNDS_MAX {
        let (sum, slope) = sum_and_slope(mu, shares.clone());
        let missing = budget - sum;
        if missing.abs() <= TOLERANCE * budget.abs() {
            break;
        }
        if missing > 0.0 {
            below = mu
        } else {
            above = mu
        }
        let newton = mu + missing / slope;
        let next = if newton > below && newton < above { newton } else { between(below, above) };
        if next == mu || below >= above {
            break;
        }
        mu = next;
    }
    mu
}

/// The middle of a bracket: geometric if it spans a factor of more than 2, arithmetic otherwise or if it starts at zero.
fn between(below: f64, above: f64) -> f64 {
    if below > 0.0 && above > 2.0 * below { libm::sqrt(below) * libm::sqrt(above) } else { 0.5 * (below + above) }
}

fn sum_and_slope(mu: f64, shares: impl Iterator<Item = Share>) -> (f64, f64) {
    shares.fold((0.0, 0.0), |(sum, slope), share| {
        let wish = share.weight * mu;
        let free = wish > share.least && wish < share.most;
        (sum + share.at(mu), if free { slope + share.weight } else { slope })
    })
}
