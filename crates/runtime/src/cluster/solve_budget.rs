//! How far the solves of a cluster may go: as many factors as fit into the time of its macro step, by the measured
//! price of a factor.
//!
//! In: how long its turns took, and how many solves and factors they made. Out: the most factors of each solve of the next one.
//! Never here: a clock, the time of a turn ([`crate::records::turns::Took`] is measured on threads and in pools and
//! declared in lockstep), the solve.

use metachron_contact::detect::LEAST_STEPS_RANGE;
use metachron_contact::step::{ClusterReport, FACTORS_SAFE};

/// A turn counts as much as the mean of so many before it.
const TURNS_KEPT: u32 = 16;

/// By how much of their mean the factors of turns must differ for their slope to count as much in the price as that
/// mean.
const TELLING_SPREAD: f64 = 0.1;

/// At least this share of a turn is the price of its factors: turns whose time hardly follows their factors do not make these free.
const FACTORS_SHARE_MIN: f64 = 0.1;

/// Where the bound of a turn's solves comes from.
#[derive(Debug, Clone, Copy)]
pub(in super::super) enum SolveBound {
    /// It is decided by the time left.
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
    /// Contacts of its last fine step, including the contacts of a rigid pile.
    pub contacts: u32,
    /// Contacts of the rigid pile, of which no solve knows.
    pub pile_contacts: u32,
}

impl Solved {
    /// Contacts of the problem.
    pub const fn of_problem(&self) -> u32 {
        self.contacts.saturating_sub(self.pile_contacts)
    }
}

/// The price of a factor: time = rest + price · factors over the last turns, by least squares whose weights decay.
///
/// Turns that all make the same number of factors do not tell their price; then the whole turn counts as theirs. That
/// is too dear for more factors and right for as many, so that a number that rises slowly finds the true price.
///
/// A rigid pile would cost as a problem again as much as the last factors did, for as many contacts as it has now.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(in super::super) struct FactorPrice {
    turns: u32,
    solves: f64,
    factors: f64,
    turn_s: f64,
    /// The variance of the factors, and their covariance with the time.
    variance: f64,
    covariance_s: f64,
    /// Contacts of the problems of these turns.
    contacts: f64,
    /// How many times as many the last turn had where some were a rigid pile's; 1 where there is none.
    more_contacts: f64,
}

impl FactorPrice {
    /// Takes a turn of `turn_s` seconds; one without a factor says nothing of its price.
    pub fn note(&mut self, solved: Solved, turn_s: f64) {
        let Solved { solves, factors, contacts, pile_contacts, .. } = solved;
        self.more_contacts = 1.0;
        if pile_contacts > 0 && self.turns > 0 {
            self.more_contacts = f64::from(contacts) / self.contacts.max(1.0);
            // a pile that has come to rest would be solved once
            self.solves += (1.0 - self.solves) / f64::from(TURNS_KEPT);
            return;
        }
        if factors == 0 || !turn_s.is_finite() {
            return;
        }
        self.turns = (self.turns + 1).min(TURNS_KEPT);
        let weight = 1.0 / f64::from(self.turns);
        let (more, longer_s) = (f64::from(factors) - self.factors, turn_s - self.turn_s);
        self.solves += weight * (f64::from(solves) - self.solves);
        self.contacts += weight * (f64::from(contacts) - self.contacts);
        self.factors += weight * more;
        self.turn_s += weight * longer_s;
        self.variance = (1.0 - weight) * (self.variance + weight * more * more);
        self.covariance_s = (1.0 - weight) * (self.covariance_s + weight * more * longer_s);
    }

    /// How long a factor takes, seconds; `None` before the first.
    pub fn factor_s(&self) -> Option<f64> {
        let mean_s = self.mean_s()?;
        Some(self.found_s(mean_s).clamp(FACTORS_SHARE_MIN * mean_s, mean_s))
    }

    /// The part of it that turns of different numbers of factors have shown, without the guess.
    fn shown_s(&self) -> Option<f64> {
        let mean_s = self.mean_s()?;
        Some(self.found_s(0.0).clamp(FACTORS_SHARE_MIN * mean_s, mean_s))
    }

    /// The time of a turn for each of its factors.
    fn mean_s(&self) -> Option<f64> {
        (self.turns > 0).then(|| self.turn_s / self.factors)
    }

    /// The slope of the time over the factors, drawn to `guess_s` where turns hardly differ.
    fn found_s(&self, guess_s: f64) -> f64 {
        let trust = (TELLING_SPREAD * self.factors) * (TELLING_SPREAD * self.factors);
        (self.covariance_s + trust * guess_s) / (self.variance + trust)
    }

    /// How many factors each solve has time for in a turn that takes `turn_s` seconds and is `late_s` seconds behind; `None` where there is time for
    /// as many as any solve makes. Where no price is known yet `least`, or [`FACTORS_SAFE`] where that is more.
    ///
    /// Fewer than [`FACTORS_SAFE`] are given where these alone are known to fill a turn, and to be the greater part of it. A turn that is late, or
    /// that other work fills, gets no shorter by solving less.
    pub fn factors_max(&self, turn_s: f64, late_s: f64, least: u32) -> Option<u32> {
        let safe = f64::from(FACTORS_SAFE);
        let (Some(factor_s), Some(shown_s)) = (self.factor_s(), self.shown_s()) else {
            return Some(least.max(FACTORS_SAFE));
        };
        let within = |factor_s: f64, turn_s: f64| {
            let rest_s = self.turn_s - factor_s * self.factors;
            let solves_s = factor_s * self.solves * self.more_contacts;
            let each = (turn_s - rest_s) / solves_s;
            // a turn that takes no time leaves time for all
            let each = if each.is_nan() { f64::INFINITY } else { each };
            (each, safe * solves_s > rest_s)
        };
        let (shown, is_greater_part) = within(shown_s, turn_s);
        let floor = if is_greater_part { shown.clamp(0.0, safe) } else { safe };
        let each = within(factor_s, turn_s - late_s).0.max(floor);
        (each < f64::from(*LEAST_STEPS_RANGE.end())).then_some(each as u32)
    }
}

impl From<&ClusterReport> for Solved {
    fn from(report: &ClusterReport) -> Self {
        Self {
            solves: report.solves,
            factors: report.factors,
            products: report.products,
            contacts: report.contacts,
            pile_contacts: report.pile_contacts,
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
            price.note(
                Solved { solves: 1, factors, products: 0, contacts: 8, pile_contacts: 0 },
                1e-3 + 20e-6 * f64::from(factors),
            );
        }
        price
    }

    #[test]
    fn a_price_is_found_from_turns_of_different_numbers_of_factors() {
        let price = after((0..64).map(|k| 4 + 13 * (k % 3)));
        let found_s = price.factor_s().unwrap();
        // the mean of a turn per factor is 79 µs, the factor's own share of it 20 µs
        assert!((found_s / 20e-6 - 1.0).abs() < 0.3, "{found_s}");
        let most = price.factors_max(3e-3, 0.0, 5).unwrap();
        assert!((75..=100).contains(&most), "{most} of 100 factors in 2 ms");
    }

    #[test]
    fn it_is_followed_where_it_changes() {
        let mut price = after((0..64).map(|k| 4 + 13 * (k % 3)));
        for k in 0..64 {
            let factors = 4 + 13 * (k % 3);
            price.note(
                Solved { solves: 1, factors, products: 0, contacts: 80, pile_contacts: 0 },
                1e-3 + 200e-6 * f64::from(factors),
            );
        }
        let found_s = price.factor_s().unwrap();
        assert!((found_s / 200e-6 - 1.0).abs() < 0.15, "{found_s}");
    }

    #[test]
    fn a_number_that_is_used_up_settles_where_the_turn_is_full() {
        let (turn_s, mut price, mut most) = (3e-3, FactorPrice::default(), 5);
        for _ in 0..200 {
            price.note(
                Solved { solves: 1, factors: most, products: 0, contacts: 8, pile_contacts: 0 },
                1e-3 + 20e-6 * f64::from(most),
            );
            most = price.factors_max(turn_s, 0.0, 5).unwrap();
        }
        assert!((95..=100).contains(&most), "{most}: 100 fill the turn, and never more");
    }

    #[test]
    fn each_of_several_solves_gets_its_share_of_the_time_there_is() {
        let mut price = FactorPrice::default();
        assert_eq!(price.factors_max(1.0, 0.0, 5), Some(5), "nothing is known");
        assert_eq!(price.factors_max(1.0, 0.0, 1), Some(FACTORS_SAFE), "nothing is known of safe ones either");
        price.note(Solved { solves: 4, factors: 40, products: 0, contacts: 8, pile_contacts: 0 }, 0.4e-3);
        assert_eq!(price.factors_max(0.801e-3, 0.0, 5), Some(20));
        assert_eq!(price.factors_max(0.041e-3, 0.0, 5), Some(FACTORS_SAFE), "one turn may be anything's");
        assert_eq!(price.factors_max(0.1, 0.0, 5), None, "there is time for all");
        price.note(Solved { solves: 4, factors: 0, products: 90, contacts: 8, pile_contacts: 0 }, 5e-3);
        price.note(Solved { solves: 0, factors: 0, products: 0, contacts: 0, pile_contacts: 0 }, 1e-4);
        assert_eq!(price.factors_max(0.801e-3, 0.0, 5), Some(20), "gradients say nothing of the price of a factor");
    }

    #[test]
    fn neither_lateness_nor_what_else_a_turn_does_leaves_fewer_factors_than_are_safe() {
        let price = after((0..64).map(|k| 4 + 13 * (k % 3)));
        assert_eq!(price.factors_max(3e-3, 1.0, 5), Some(FACTORS_SAFE), "late");
        // a millisecond of it is no factor's
        assert_eq!(price.factors_max(0.5e-3, 0.0, 5), Some(FACTORS_SAFE));
    }

    #[test]
    fn a_rigid_pile_is_priced_by_its_contacts_as_a_problem_solved_once() {
        let mut price = FactorPrice::default();
        // 10 µs a factor, and nothing else
        let solved = |factors: u32| Solved { solves: 4, factors, products: 0, contacts: 100, pile_contacts: 0 };
        (0..64).map(|k| 4 + 72 * (k % 2)).for_each(|factors| price.note(solved(factors), 10e-6 * f64::from(factors)));
        let left = price.factors_max(0.085e-3, 0.0, 5);
        assert_eq!(left, Some(2), "each of four solves has 20 µs");
        for _ in 0..1000 {
            price.note(Solved { solves: 0, factors: 0, contacts: 50, pile_contacts: 50, ..solved(0) }, 0.02e-3);
        }
        // a quarter of the solves, and each factor of half the contacts
        assert_eq!(price.factors_max(0.0825e-3, 0.0, 5), Some(16));
    }

    #[test]
    fn turns_whose_time_does_not_follow_their_factors_do_not_make_these_free() {
        let mut price = FactorPrice::default();
        for k in 0..64 {
            price.note(
                Solved { solves: 1, factors: 5 + 40 * (k % 2), products: 0, contacts: 8, pile_contacts: 0 },
                1e-3,
            );
        }
        let (found_s, mean_s) = (price.factor_s().unwrap(), 1e-3 / 25.0);
        assert!(found_s >= 0.09 * mean_s, "{found_s}");
        price.note(Solved { solves: 0, factors: 0, products: 0, contacts: 0, pile_contacts: 0 }, 1e-4);
        assert_eq!(price.factor_s(), Some(found_s), "no factor");
        price.note(Solved { solves: 1, factors: 5, products: 0, contacts: 8, pile_contacts: 0 }, f64::NAN);
        assert_eq!(price.factor_s(), Some(found_s));
    }
}
