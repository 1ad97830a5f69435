//! Search for the best gains: a coarse grid, then Nelder and Mead's simplex from the best grid point (NM65).
//!
//! In: a plant, a target, the extent of the trials. Out: the best verdict so far, whenever it is stopped. Deterministic. Never here: the
//! objective ([`crate::tune::judge`] has it).

use super::candidate::Candidate;
use super::plant::Plant;
use super::trials::{Extent, Verdict, judge};
use crate::control::Law;
use argmin::core::{CostFunction, Error, Executor};
use argmin::solver::neldermead::NelderMead;
use std::cell::RefCell;

/// A search.
pub struct Search<'a> {
    /// The plant to be controlled.
    pub plant: &'a Plant,
    /// Frames a second, > 0.
    pub target_hz: f64,
    /// The extent of the trials for each candidate.
    pub extent: Extent,
    /// Called after every candidate with the fraction done and the best so far; returns whether to continue.
    pub go_on: &'a mut dyn FnMut(f64, &Verdict) -> bool,
}

/// The result of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchResult {
    /// The best verdict.
    pub best: Verdict,
    /// Every candidate with its objective, in the order they were tried.
    pub tried: Vec<(Candidate, f64)>,
    /// Whether it was stopped before its end.
    pub interrupted: bool,
}

/// A family of candidates, parametrised by a few numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// The corrected law: κ and margin.
    Corrected,
    /// The same with a proportional part: κ, margin and λ.
    Pi,
    /// The printed law: α and β.
    Printed,
    /// The policy that predicts: its margin.
    Adaptive,
}

/// Average number of candidates per simplex iteration.
const TRIES: f64 = 2.0;
/// Spread of the first simplex.
const SPREAD: f64 = 0.35;

impl Family {
    /// Every family.
    pub const ALL: [Self; 4] = [Self::Corrected, Self::Pi, Self::Printed, Self::Adaptive];

    /// The candidate with the gains whose logarithms are `at`.
    fn candidate(self, at: &[f64]) -> Candidate {
        let gain = |k: usize, (low, high): (f64, f64)| libm::exp(at[k]).clamp(low, high);
        let margin = (0.005, 0.5);
        match self {
            Self::Corrected => Law::Corrected { kappa: gain(0, Law::KAPPA), lead: 0.0, margin: gain(1, margin) }.into(),
            Self::Pi => {
                Law::Corrected { kappa: gain(0, Law::KAPPA), lead: gain(2, Law::LEAD), margin: gain(1, margin) }.into()
            }
            Self::Printed => Law::Printed { alpha: gain(0, Law::ALPHA), beta: gain(1, Law::BETA) }.into(),
            Self::Adaptive => Candidate::Adaptive { margin: gain(0, margin) },
        }
    }

    /// Gains on the grid, one list for each gain.
    const fn grid(self) -> &'static [&'static [f64]] {
        match self {
            Self::Corrected => &[&[0.15, 0.3, 0.5, 0.9], &[0.02, 0.04, 0.08, 0.16]],
            Self::Pi => &[&[0.2, 0.4, 1.0], &[0.02, 0.06], &[0.05, 0.3, 1.0]],
            Self::Printed => &[&[3e-6, 1e-5, 1e-4, 1e-3, 1e-2], &[1e-3, 0.5, 5.0]],
            Self::Adaptive => &[&[0.01, 0.03, 0.09]],
        }
    }

    /// Iterations of the simplex.
    const fn iterations(self) -> u64 {
        match self {
            Self::Corrected | Self::Printed => 14,
            Self::Pi => 20,
            Self::Adaptive => 4,
        }
    }

    /// The grid's candidates: every combination.
    fn candidates(self) -> Vec<Vec<f64>> {
        self.grid().iter().fold(vec![Vec::new()], |all, gains| {
            let with = |held: &Vec<f64>| {
                let held = held.clone();
                gains.iter().map(move |gain| [held.clone(), vec![libm::log(*gain)]].concat())
            };
            all.iter().flat_map(with).collect()
        })
    }
}

/// The state of a search, shared with the solver's cost function.
struct SearchState<'a, 'b> {
    search: &'b mut Search<'a>,
    family: Family,
    best: Option<Verdict>,
    tried: Vec<(Candidate, f64)>,
    expected: f64,
    interrupted: bool,
}

impl SearchState<'_, '_> {
    fn cost(&mut self, at: &[f64]) -> Option<f64> {
        if self.interrupted {
            return None;
        }
        let candidate = self.family.candidate(at);
        let verdict = judge(self.search.plant, candidate, self.search.target_hz, self.search.extent);
        let objective = verdict.objective;
        self.tried.push((candidate, objective));
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

/// Searches for the best gains of `family`; `None` if no candidate was judged.
#[must_use]
pub fn search(search: &mut Search<'_>, family: Family) -> Option<SearchResult> {
    let grid = family.candidates();
    let expected = grid.len() as f64 + TRIES * family.iterations() as f64;
    let mut state = SearchState { search, family, best: None, tried: Vec::new(), expected, interrupted: false };
    let mut corner = None::<(Vec<f64>, f64)>;
    for at in grid {
        let Some(objective) = state.cost(&at) else { break };
        if corner.as_ref().is_none_or(|(_, held)| objective < *held) {
            corner = Some((at, objective));
        }
    }
    let (corner, _) = corner?;
    let state = RefCell::new(state);
    if !state.borrow().interrupted {
        // a search that is stopped ends as an error of its cost function; the best so far is stored in `judging`
        let _ = run_simplex(&state, corner);
    }
    let SearchState { best, tried, interrupted, .. } = state.into_inner();
    Some(SearchResult { best: best?, tried, interrupted })
}

/// Nelder and Mead's simplex from the best of the grid.
fn run_simplex(state: &RefCell<SearchState<'_, '_>>, corner: Vec<f64>) -> Result<(), Error> {
    let iterations = state.borrow().family.iterations();
    let aside = (0..corner.len()).map(|axis| {
        let mut aside = corner.clone();
        aside[axis] += SPREAD;
        aside
    });
    let simplex = std::iter::once(corner.clone()).chain(aside).collect();
    let solver = NelderMead::new(simplex).with_sd_tolerance(1e-5)?;
    Executor::new(Cost(state), solver).configure(|state| state.max_iters(iterations)).run()?;
    Ok(())
}

/// The cost function as the solver needs it.
struct Cost<'a, 'b, 'c>(&'c RefCell<SearchState<'a, 'b>>);

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

    fn found(family: Family, stop_after: usize) -> SearchResult {
        let plant = Plant::identify(&observed(7e-3, 0.22e-6, 0)).unwrap();
        let mut calls = 0;
        let mut go_on = |_: f64, _: &Verdict| {
            calls += 1;
            calls < stop_after
        };
        let extent = Extent { seeds: 1, millis: 1500, threads: None };
        let mut setting = Search { plant: &plant, target_hz: 30.0, extent, go_on: &mut go_on };
        search(&mut setting, family).unwrap()
    }

    #[test]
    fn the_result_of_a_search_is_safe_and_better_than_all_candidates() {
        let found = found(Family::Corrected, usize::MAX);
        assert!(found.tried.iter().all(|(_, objective)| *objective >= found.best.objective));
        assert!(found.best.is_safe(), "{:?}", found.best);
        assert!(found.best.settle_s.unwrap() <= 1.0, "{:?}", found.best);
        assert!(!found.interrupted);
    }

    #[test]
    fn no_margin_is_left_without_need() {
        // times scatter by 1 % at most here: a few hundredths of the frame suffice to keep frames on time
        let Candidate::Feedback(Law::Corrected { margin, .. }) = found(Family::Corrected, usize::MAX).best.candidate
        else {
            panic!("the corrected law was looked at")
        };
        assert!((0.005..0.1).contains(&margin), "{margin}");
    }

    #[test]
    fn a_grid_has_every_combination_once() {
        for (family, count) in Family::ALL.into_iter().zip([16, 18, 15, 3]) {
            let all = family.candidates();
            assert_eq!(all.len(), count, "{family:?}");
            assert!(all.iter().enumerate().all(|(k, at)| !all[..k].contains(at)), "{family:?}");
        }
    }

    #[test]
    fn a_stopped_search_keeps_its_best_candidate() {
        let found = found(Family::Corrected, 5);
        assert!(found.interrupted && found.tried.len() == 5, "{}", found.tried.len());
    }

    #[test]
    fn equal_searches_find_equal_gains() {
        assert_eq!(found(Family::Printed, 9).best, found(Family::Printed, 9).best);
    }
}
