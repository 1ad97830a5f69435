//! Water filling: one level μ for all, x = k μ inside its limits, Σ a x equal to the budget, exactly and in linear time.
//!
//! In: [`Claim`]s and a budget. Out: μ. Never here: the meaning of x ([`super::gobbetti`], [`super::rates`]), or iteration to a tolerance
//! ([`crate::share`] does that from a good guess). Theory: `docs/theory/budget.md`, eq. 22 and 23.

use alloc::vec::Vec;

/// One unknown x that grows with the level μ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Claim {
    /// k: growth of x with μ; finite, ≥ 0.
    pub growth: f64,
    /// a: budget per unit of x; finite, ≥ 0.
    pub price: f64,
    /// The least x, finite, ≥ 0.
    pub least: f64,
    /// The most x, finite, ≥ `least`.
    pub most: f64,
}

impl Claim {
    /// x at level `mu`: k μ inside its limits. With a price of 0, x is at its most; with a growth of 0, at its least.
    #[must_use]
    pub fn at(&self, mu: f64) -> f64 {
        if self.price == 0.0 && self.growth > 0.0 {
            return self.most;
        }
        if self.growth == 0.0 { self.least } else { crate::within(self.growth * mu, self.least, self.most) }
    }

    fn ends(&self) -> (f64, f64) {
        (self.least / self.growth, self.most / self.growth)
    }
}

/// μ at which Σ a x(μ) is the budget; infinite if the budget pays for every most; `None` if it does not pay for every least.
///
/// The sum spent is piecewise linear and rising, with two breaks per claim. Each pass rules out half of the remaining breaks, and with them
/// the claims that are wholly on one side: linear time in all.
#[must_use]
pub fn level(budget: f64, claims: &[Claim]) -> Option<f64> {
    let total = |x: fn(&Claim) -> f64| claims.iter().map(|t| t.price * x(t)).sum::<f64>();
    if total(|t| t.at(0.0)) > budget || budget.is_nan() {
        return None;
    }
    if total(|t| t.at(f64::INFINITY)) <= budget {
        return Some(f64::INFINITY);
    }
    let mut left: Vec<Claim> = claims.iter().copied().filter(|t| t.price > 0.0 && t.growth > 0.0).collect();
    // spent = settled + slope μ + the sum of the claims left
    let mut settled: f64 = claims.iter().filter(|t| t.price > 0.0 && t.growth == 0.0).map(|t| t.price * t.least).sum();
    let (mut slope, mut low, mut high) = (0.0, 0.0, f64::INFINITY);
    let mut breaks: Vec<f64> = left.iter().flat_map(|t| [t.ends().0, t.ends().1]).collect();
    while !breaks.is_empty() {
        let half = breaks.len() / 2;
        let mu = *breaks.select_nth_unstable_by(half, f64::total_cmp).1;
        let spent = settled + slope * mu + left.iter().map(|t| t.price * t.at(mu)).sum::<f64>();
        if spent <= budget {
            low = mu;
        } else {
            high = mu;
        }
        breaks.retain(|&b| b > low && b < high);
        left.retain(|t| {
            let (from, to) = t.ends();
            match () {
                () if to <= low => settled += t.price * t.most,
                () if from >= high => settled += t.price * t.least,
                () if from <= low && to >= high => slope += t.price * t.growth,
                () => return true,
            }
            false
        });
    }
    let mu = if slope > 0.0 { (budget - settled) / slope } else { low };
    Some(crate::within(mu, low, high))
}
