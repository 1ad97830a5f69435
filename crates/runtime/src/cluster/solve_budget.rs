//! How far the solves of a cluster may go: as many factors as fit into the time of its macro step, by what factors have taken so far.
//!
//! In: how long its turns took, and how many solves and factors they made. Out: the most factors of each solve of the next one.
//! Never here: a clock, what a turn takes ([`super::super::turns::Took`] is measured on threads and in pools and declared in lockstep), the solve.

use metachron_contact::detect::LEAST_STEPS_RANGE;
use metachron_contact::step::ClusterReport;

/// A turn counts as much as the mean of so many before it.
const TURNS_KEPT: u32 = 16;

/// By how much of their mean the factors of turns must differ for what they say of the price to count as much as that mean.
const TELLING_SPREAD: f64 = 0.1;

/// At least this share of a turn is the price of its factors: turns whose time hardly follows their factors do not make these free.
const FACTORS_SHARE_MIN: f64 = 0.1;

/// Where the bound of a turn's solves comes from.
#[derive(Debug, Clone, Copy)]
pub(in super::super) enum SolveBound {
    /// It is decided by what there is time for.
    Decided,
    /// The run that is followed has decided it.
    Given(Option<u32>),
}

/// The solves of a macro step.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(in super::super) struct Solved {
    pub solves: u32,
    pub factors: u32,
    /// Products of conjugate gradients, of solves that make no factors.
    pub products: u32,
    /// Contacts of its last fine step.
    pub contacts: u32,
}

/// The price of a factor: time = rest + price · factors over the last turns, by least squares whose weights decay.
///
/// Turns that all make the same number of factors do not say what these cost; then the whole turn counts as theirs. That is too dear for
/// more factors and right for as many, so that a number that rises slowly finds the true price.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(in super::super) struct FactorPrice {
    turns: u32,
    solves: f64,
    factors: f64,
    turn_s: f64,
    /// The variance of the factors, and their covariance with the time.
    variance: f64,
    covariance_s: f64,
}

impl FactorPrice {
    /// Takes a turn of `turn_s` seconds; one without a factor says nothing of its price.
    pub fn note(&mut self, Solved { solves, factors, .. }: Solved, turn_s: f64) {
        if factors == 0 || !turn_s.is_finite() {
            return;
        }
        self.turns = (self.turns + 1).min(TURNS_KEPT);
        let weight = 1.0 / f64::from(self.turns);
        let (more, longer_s) = (f64::from(factors) - self.factors, turn_s - self.turn_s);
        self.solves += weight * (f64::from(solves) - self.solves);
        self.factors += weight * more;
        self.turn_s += weight * longer_s;
        self.variance = (1.0 - weight) * (self.variance + weight * more * more);
        self.covariance_s = (1.0 - weight) * (self.covariance_s + weight * more * longer_s);
    }

    /// How long a factor takes, seconds; `None` before the first.
    pub fn factor_s(&self) -> Option<f64> {
        let mean_s = (self.turns > 0).then(|| self.turn_s / self.factors)?;
        let trust = (TELLING_SPREAD * self.factors) * (TELLING_SPREAD * self.factors);
        let found_s = (self.covariance_s + trust * mean_s) / (self.variance + trust);
        Some(found_s.clamp(FACTORS_SHARE_MIN * mean_s, mean_s))
    }

    /// How many factors each solve of a turn of `turn_s` seconds may make: at least `least`, and that where no price is known yet; `None` where
    /// there is time for as many as any solve makes.
    pub fn factors_max(&self, turn_s: f64, least: u32) -> Option<u32> {
        let Some(factor_s) = self.factor_s() else { return Some(least) };
        let rest_s = self.turn_s - factor_s * self.factors;
        let each = (turn_s - rest_s) / (factor_s * self.solves);
        // a turn that takes no time leaves time for all
        let each = if each.is_nan() { f64::INFINITY } else { each };
        (each < f64::from(*LEAST_STEPS_RANGE.end())).then_some((each.max(0.0) as u32).max(least))
    }
}

impl From<&ClusterReport> for Solved {
    fn from(report: &ClusterReport) -> Self {
        Self {
            solves: report.solves,
            factors: report.factors,
            products: report.products,
            contacts: report.contacts.saturating_sub(report.pile_contacts),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A price after turns of so many factors, each made in one solve, that took 1 ms and 20 µs for each factor.
    fn after(factors: impl IntoIterator<Item = u32>) -> FactorPrice {
        let mut price = FactorPrice::default();
        for factors in factors {
            price.note(Solved { solves: 1, factors, products: 0, contacts: 8 }, 1e-3 + 20e-6 * f64::from(factors));
        }
        price
    }

    #[test]
    fn a_price_is_found_from_turns_of_different_numbers_of_factors() {
        let price = after((0..64).map(|k| 4 + 13 * (k % 3)));
        let found_s = price.factor_s().unwrap();
        // the mean of a turn per factor is 79 µs: what is left of that
        assert!((found_s / 20e-6 - 1.0).abs() < 0.3, "{found_s}");
        let most = price.factors_max(3e-3, 5).unwrap();
        assert!((75..=100).contains(&most), "{most} of 100 factors in 2 ms");
    }

    #[test]
    fn it_is_followed_where_it_changes() {
        let mut price = after((0..64).map(|k| 4 + 13 * (k % 3)));
        for k in 0..64 {
            let factors = 4 + 13 * (k % 3);
            price.note(Solved { solves: 1, factors, products: 0, contacts: 80 }, 1e-3 + 200e-6 * f64::from(factors));
        }
        let found_s = price.factor_s().unwrap();
        assert!((found_s / 200e-6 - 1.0).abs() < 0.15, "{found_s}");
    }

    #[test]
    fn a_number_that_is_used_up_settles_where_the_turn_is_full() {
        let (turn_s, mut price, mut most) = (3e-3, FactorPrice::default(), 5);
        for _ in 0..200 {
            price.note(Solved { solves: 1, factors: most, products: 0, contacts: 8 }, 1e-3 + 20e-6 * f64::from(most));
            most = price.factors_max(turn_s, 5).unwrap();
        }
        assert!((95..=100).contains(&most), "{most}: 100 fill the turn, and never more");
    }

    #[test]
    fn each_of_several_solves_gets_its_share_and_the_least_in_any_case() {
        let mut price = FactorPrice::default();
        assert_eq!(price.factors_max(1.0, 5), Some(5), "nothing is known");
        price.note(Solved { solves: 4, factors: 40, products: 0, contacts: 8 }, 0.4e-3);
        assert_eq!(price.factors_max(0.801e-3, 5), Some(20));
        assert_eq!(price.factors_max(0.01e-3, 5), Some(5));
        assert_eq!(price.factors_max(-1.0, 7), Some(7), "late");
        assert_eq!(price.factors_max(0.1, 5), None, "there is time for all");
        price.note(Solved { solves: 4, factors: 0, products: 90, contacts: 8 }, 5e-3);
        price.note(Solved { solves: 0, factors: 0, products: 0, contacts: 0 }, 1e-4);
        assert_eq!(price.factors_max(0.801e-3, 5), Some(20), "gradients say nothing of the price of a factor");
    }

    #[test]
    fn turns_whose_time_does_not_follow_their_factors_do_not_make_these_free() {
        let mut price = FactorPrice::default();
        for k in 0..64 {
            price.note(Solved { solves: 1, factors: 5 + 40 * (k % 2), products: 0, contacts: 8 }, 1e-3);
        }
        let (found_s, mean_s) = (price.factor_s().unwrap(), 1e-3 / 25.0);
        assert!(found_s >= 0.09 * mean_s, "{found_s}");
        price.note(Solved { solves: 0, factors: 0, products: 0, contacts: 0 }, 1e-4);
        assert_eq!(price.factor_s(), Some(found_s), "no factor");
        price.note(Solved { solves: 1, factors: 5, products: 0, contacts: 8 }, f64::NAN);
        assert_eq!(price.factor_s(), Some(found_s));
    }
}
