//! The gains that do best: a coarse grid, then Nelder and Mead's simplex from the best of it (NM65).
//!
//! In: a plant, a target, how much to play. Out: the best verdict so far, whenever it is stopped. Deterministic.
//! Never here: what good is ([`super::judge`] says).

use super::plant::Plant;
use super::trials::{Extent, Verdict, judge};
use crate::control::Law;
use argmin::core::{CostFunction, Error, Executor};
use argmin::solver::neldermead::NelderMead;
use std::cell::RefCell;

/// A search.
pub struct Search<'a> {
    /// What is to be held.
    pub plant: &'a Plant,
    /// Frames a second, > 0.
    pub target_hz: f64,
    /// How much is played for each candidate.
    pub extent: Extent,
    /// Told of every candidate: the share that is done, and the best so far; answers whether to go on.
    pub go_on: &'a mut dyn FnMut(f64, &Verdict) -> bool,
}

/// What a search came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// The best.
    pub best: Verdict,
    /// Every candidate with its objective, in the order they were tried.
    pub tried: Vec<(Law, f64)>,
    /// Whether it was stopped before its end.
    pub interrupted: bool,
}

/// A family of laws, by two numbers of any size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// The corrected law: κ and margin.
    Corrected,
    /// The printed law: α and β.
    Printed,
}

/// Iterations of the simplex.
const ITERATIONS: u64 = 14;
/// About so many candidates a simplex iteration tries.
const TRIES: f64 = 2.0;
/// Spread of the first simplex.
const SPREAD: f64 = 0.35;

impl Family {
    /// The law that two numbers stand for: the first goes by its logarithm, the second by its odds or its logarithm.
    fn law(self, at: &[f64]) -> Law {
        match self {
            Self::Corrected => {
                let (kappa, margin) = (libm::exp(at[0]).clamp(0.01, 0.99), libm::exp(at[1]).clamp(0.005, 0.5));
                Law::Corrected { kappa, lead: 0.0, margin }
            }
            Self::Printed => {
                Law::Printed { alpha: libm::exp(at[0]).clamp(1e-9, 1.0), beta: libm::exp(at[1]).clamp(1e-6, 1e3) }
            }
        }
    }

    /// Where the grid's candidates lie.
    fn grid(self) -> Vec<[f64; 2]> {
        let (first, second): (&[f64], &[f64]) = match self {
            Self::Corrected => (&[0.15, 0.3, 0.5, 0.7], &[0.03, 0.06, 0.1, 0.2]),
            Self::Printed => (&[3e-6, 1e-5, 1e-4, 1e-3, 1e-2], &[1e-3, 0.5, 5.0]),
        };
        first.iter().flat_map(|&a| second.iter().map(move |&b| [libm::log(a), libm::log(b)])).collect()
    }
}

/// The state of a search that the solver's cost function shares.
struct Judging<'a, 'b> {
    search: &'b mut Search<'a>,
    family: Family,
    best: Option<Verdict>,
    tried: Vec<(Law, f64)>,
    expected: f64,
    interrupted: bool,
}

impl Judging<'_, '_> {
    fn cost(&mut self, at: &[f64]) -> Option<f64> {
        if self.interrupted {
            return None;
        }
        let law = self.family.law(at);
        let verdict = judge(self.search.plant, law, self.search.target_hz, self.search.extent);
        let objective = verdict.objective;
        self.tried.push((law, objective));
        if self.best.as_ref().is_none_or(|best| objective < best.objective) {
            self.best = Some(verdict);
        }
        let done = (self.tried.len() as f64 / self.expected).min(1.0);
        if let Some(best) = &self.best {
            self.interrupted = !(self.search.go_on)(done, best);
        }
        Some(objective)
    }
}

/// Looks for the gains of `family` that do best; `None` where not one candidate was judged.
#[must_use]
pub fn search(search: &mut Search<'_>, family: Family) -> Option<Found> {
    let grid = family.grid();
    let expected = grid.len() as f64 + TRIES * ITERATIONS as f64;
    let mut judging = Judging { search, family, best: None, tried: Vec::new(), expected, interrupted: false };
    let mut corner = None::<([f64; 2], f64)>;
    for at in grid {
        let Some(objective) = judging.cost(&at) else { break };
        if corner.is_none_or(|(_, held)| objective < held) {
            corner = Some((at, objective));
        }
    }
    let (corner, _) = corner?;
    let judging = RefCell::new(judging);
    if !judging.borrow().interrupted {
        // a search that is stopped ends as an error of its cost function; the best so far is kept here
        let _ = polish(&judging, corner);
    }
    let Judging { best, tried, interrupted, .. } = judging.into_inner();
    Some(Found { best: best?, tried, interrupted })
}

fn polish(judging: &RefCell<Judging<'_, '_>>, corner: [f64; 2]) -> Result<(), Error> {
    let simplex = vec![corner.to_vec(), vec![corner[0] + SPREAD, corner[1]], vec![corner[0], corner[1] + SPREAD]];
    let solver = NelderMead::new(simplex).with_sd_tolerance(1e-5)?;
    Executor::new(Cost(judging), solver).configure(|state| state.max_iters(ITERATIONS)).run()?;
    Ok(())
}

/// The cost function as the solver wants it.
struct Cost<'a, 'b, 'c>(&'c RefCell<Judging<'a, 'b>>);

impl CostFunction for Cost<'_, '_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, at: &Self::Param) -> Result<f64, Error> {
        self.0.borrow_mut().cost(at).ok_or_else(|| Error::msg("stopped"))
    }
}

#[cfg(test)]
mod tests {
    use super::super::plant::tests::observed;
    use super::*;

    fn found(family: Family, stop_after: usize) -> Found {
        let plant = Plant::identify(&observed(7e-3, 0.22e-6, 0)).unwrap();
        let mut told = 0;
        let mut go_on = |_: f64, _: &Verdict| {
            told += 1;
            told < stop_after
        };
        let extent = Extent { seeds: 1, millis: 1500 };
        let mut setting = Search { plant: &plant, target_hz: 30.0, extent, go_on: &mut go_on };
        search(&mut setting, family).unwrap()
    }

    #[test]
    fn what_is_found_is_safe_and_better_than_all_that_was_tried() {
        let found = found(Family::Corrected, usize::MAX);
        assert!(found.tried.iter().all(|(_, objective)| *objective >= found.best.objective));
        assert!(found.best.gain_margin >= 2.0 && found.best.delay_margin >= 2, "{:?}", found.best);
        assert!(found.best.settle_s.unwrap() <= 1.0, "{:?}", found.best);
        assert!(!found.interrupted);
    }

    #[test]
    fn a_search_that_is_stopped_keeps_its_best() {
        let found = found(Family::Corrected, 5);
        assert!(found.interrupted && found.tried.len() == 5, "{}", found.tried.len());
    }

    #[test]
    fn equal_searches_find_equal_gains() {
        assert_eq!(found(Family::Printed, 9).best, found(Family::Printed, 9).best);
    }
}
