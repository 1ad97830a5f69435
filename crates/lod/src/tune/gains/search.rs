//! Search for the best gains: given laws and a coarse grid, then Nelder and Mead's simplex from the best of these (NM65).
//!
//! In: how a candidate is judged, laws to start from. Out: the best verdict so far, whenever it is stopped; it is never
//! after that of a law it started from ([`Verdict::compare`]). Deterministic. Never here: the objective ([`crate::tune::judge`] has it).

use super::trials::Verdict;
use crate::adaptive::MARGIN_MAX;
use crate::control::Law;
use crate::tune::loops::candidate::Candidate;
use metachron_core::{NumberRange, gains};
use std::cmp::Ordering;

/// A search.
pub struct Search<'a> {
    /// Judges a candidate, each by the same trials: [`crate::tune::judge`] on a plant, at a target, of an extent.
    pub judge: &'a mut dyn FnMut(Candidate) -> Verdict,
    /// Called after every candidate with the fraction done and the best so far; returns whether to continue.
    pub go_on: &'a mut dyn FnMut(f64, &Verdict) -> bool,
}

/// The result of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchResult {
    /// The best verdict.
    pub best: Verdict,
    /// The verdicts on the laws it started from, in their order.
    pub starts: Vec<Verdict>,
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
/// The simplex ends where the standard deviation of its costs is less.
const SPREAD_MIN: f64 = 1e-5;
/// A simplex of logarithms cannot start from a margin or a λ of 0, nor leave one near it: it starts no nearer than this.
const MARGIN_LEAST: f64 = 1e-3;
const LEAD_LEAST: f64 = 0.05;

impl Family {
    /// Every family.
    pub const ALL: [Self; 4] = [Self::Corrected, Self::Pi, Self::Printed, Self::Adaptive];

    /// The candidate with the gains whose logarithms are `at`, inside the ranges of gains.
    fn candidate(self, at: &[f64]) -> Candidate {
        let gain = |k: usize, range: NumberRange| range.nearest(libm::exp(at[k]));
        match self {
            Self::Corrected => {
                Law::Corrected { kappa: gain(0, gains::KAPPA), lead: 0.0, margin: gain(1, gains::MARGIN) }.into()
            }
            Self::Pi => Law::Corrected {
                kappa: gain(0, gains::KAPPA),
                lead: gain(2, gains::LEAD),
                margin: gain(1, gains::MARGIN),
            }
            .into(),
            Self::Printed => Law::Printed { alpha: gain(0, gains::ALPHA), beta: gain(1, gains::BETA) }.into(),
            Self::Adaptive => {
                Candidate::Adaptive { margin: gain(0, NumberRange { greatest: MARGIN_MAX, ..gains::MARGIN }) }
            }
        }
    }

    /// The logarithms of gains from which the simplex looks around `candidate`; `None` if it is not of this family.
    fn place(self, candidate: Candidate) -> Option<Vec<f64>> {
        let gains = match (self, candidate) {
            (Self::Corrected, Candidate::Feedback(Law::Corrected { kappa, lead: 0.0, margin })) => {
                vec![kappa, margin.max(MARGIN_LEAST)]
            }
            (Self::Pi, Candidate::Feedback(Law::Corrected { kappa, lead, margin })) => {
                vec![kappa, margin.max(MARGIN_LEAST), lead.max(LEAD_LEAST)]
            }
            (Self::Printed, Candidate::Feedback(Law::Printed { alpha, beta })) => vec![alpha, beta],
            (Self::Adaptive, Candidate::Adaptive { margin }) => vec![margin.max(MARGIN_LEAST)],
            _ => return None,
        };
        Some(gains.into_iter().map(libm::log).collect())
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

/// The state of a search.
struct SearchState<'a, 'b> {
    search: &'b mut Search<'a>,
    family: Family,
    best: Option<Verdict>,
    tried: Vec<Verdict>,
    expected: f64,
    interrupted: bool,
}

impl SearchState<'_, '_> {
    /// Judges a candidate; `None` once the search was stopped.
    fn judge(&mut self, candidate: Candidate) -> Option<f64> {
        if self.interrupted {
            return None;
        }
        let verdict = (self.search.judge)(candidate);
        let rank = verdict.rank();
        let best = self.best.take().filter(|best| best.compare(&verdict).is_le()).unwrap_or_else(|| verdict.clone());
        self.tried.push(verdict);
        let done = (self.tried.len() as f64 / self.expected).min(1.0);
        self.interrupted = !(self.search.go_on)(done, &best);
        self.best = Some(best);
        Some(rank)
    }

    /// Judges the given laws and the grid; the place of the best of the family among them.
    fn best_corner(&mut self, starts: &[Candidate]) -> Option<Vec<f64>> {
        let family = self.family;
        let given = starts.iter().map(|&candidate| (family.place(candidate), candidate));
        let grid = family.candidates().into_iter().map(|at| (Some(at.clone()), family.candidate(&at)));
        let mut corner = None::<(Vec<f64>, f64)>;
        for (place, candidate) in given.chain(grid) {
            let Some(rank) = self.judge(candidate) else { break };
            let Some(at) = place else { continue };
            if corner.as_ref().is_none_or(|(_, held)| rank < *held) {
                corner = Some((at, rank));
            }
        }
        corner.map(|(at, _)| at)
    }
}

/// Searches for the best gains of `family`, and judges `starts` first, of which the family's own are points to start
/// from; `None` if no candidate was judged.
#[must_use]
pub fn search(search: &mut Search<'_>, family: Family, starts: &[Candidate]) -> Option<SearchResult> {
    let count = starts.len() + family.candidates().len();
    let expected = count as f64 + TRIES * family.iterations() as f64;
    let mut state = SearchState { search, family, best: None, tried: Vec::new(), expected, interrupted: false };
    let corner = state.best_corner(starts);
    if let Some(corner) = corner.filter(|_| !state.interrupted) {
        run_simplex(&mut state, corner);
    }
    let SearchState { best, tried, interrupted, .. } = state;
    let starts = tried.iter().take(starts.len()).cloned().collect();
    let tried = tried.iter().map(|verdict| (verdict.candidate, verdict.objective)).collect();
    Some(SearchResult { best: best?, starts, tried, interrupted })
}

/// Nelder and Mead's simplex from the best of the grid; `None` once the search was stopped.
fn run_simplex(state: &mut SearchState<'_, '_>, corner: Vec<f64>) -> Option<()> {
    let iterations = state.family.iterations();
    let mut cost = |at: Vec<f64>| {
        let rank = state.judge(state.family.candidate(&at))?;
        Some((at, rank))
    };
    let aside = (0..corner.len()).map(|axis| {
        let mut aside = corner.clone();
        aside[axis] += SPREAD;
        aside
    });
    let mut simplex = std::iter::once(corner.clone()).chain(aside).map(&mut cost).collect::<Option<Vec<Vertex>>>()?;
    let by_cost = |a: &Vertex, b: &Vertex| a.1.partial_cmp(&b.1).unwrap_or(Ordering::Equal);
    simplex.sort_by(by_cost);
    for _ in 0..iterations {
        if spread(&simplex) < SPREAD_MIN {
            break;
        }
        let last = simplex.len() - 1;
        let (best, second, worst) = (simplex[0].1, simplex[last - 1].1, simplex[last].clone());
        let centroid: Vec<f64> = (0..corner.len())
            .map(|axis| simplex[..last].iter().map(|(at, _)| at[axis]).sum::<f64>() * (1.0 / last as f64))
            .collect();
        let reflected = cost(between(&centroid, &worst.0, -1.0))?;
        let next = if reflected.1 < best {
            let expanded = cost(between(&centroid, &reflected.0, 2.0))?;
            Some(if expanded.1 < reflected.1 { expanded } else { reflected })
        } else if reflected.1 < second {
            Some(reflected)
        } else if reflected.1 < worst.1 {
            Some(cost(between(&centroid, &reflected.0, 0.5))?).filter(|(_, cost)| *cost <= reflected.1)
        } else {
            Some(cost(between(&centroid, &worst.0, 0.5))?).filter(|(_, cost)| *cost < worst.1)
        };
        if let Some(next) = next {
            simplex[last] = next;
        } else {
            // shrink towards the best
            for vertex in 1..=last {
                simplex[vertex] = cost(between(&simplex[0].0, &simplex[vertex].0, 0.5))?;
            }
        }
        simplex.sort_by(by_cost);
    }
    Some(())
}

/// A corner of a simplex, and its cost.
type Vertex = (Vec<f64>, f64);

/// `from` + `share` (`to` − `from`).
fn between(from: &[f64], to: &[f64], share: f64) -> Vec<f64> {
    from.iter().zip(to).map(|(from, to)| from + (to - from) * share).collect()
}

/// The standard deviation of the costs.
fn spread(simplex: &[Vertex]) -> f64 {
    let count = simplex.len() as f64;
    let mean = simplex.iter().map(|(_, cost)| cost).sum::<f64>() / count;
    libm::sqrt(1.0 / (count - 1.0) * simplex.iter().map(|(_, cost)| (cost - mean) * (cost - mean)).sum::<f64>())
}

#[cfg(test)]
mod tests {
    use super::super::trials::{Extent, judge};
    use super::*;
    use crate::tune::loops::margins::Loop;
    use crate::tune::loops::plant::DEAD_TIME_MAX;
    use crate::tune::loops::plant::Plant;
    use crate::tune::loops::plant::tests::observed;

    fn found(family: Family, stop_after: usize) -> SearchResult {
        let plant = Plant::identify(&observed(7e-3, 0.22e-6, 0)).unwrap();
        let mut calls = 0;
        let mut go_on = |_: f64, _: &Verdict| {
            calls += 1;
            calls < stop_after
        };
        let extent = Extent { seeds: 1, millis: 1500, threads: None };
        let mut judge = |candidate| judge(&plant, candidate, 30.0, extent);
        search(&mut Search { judge: &mut judge, go_on: &mut go_on }, family, &[]).unwrap()
    }

    #[test]
    fn the_result_of_a_search_is_safe_and_better_than_all_candidates() {
        let found = found(Family::Corrected, usize::MAX);
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
    fn gains_that_are_found_are_inside_the_ranges_of_gains() {
        // the ends of the box, and far beyond them
        for family in Family::ALL {
            for wish in [-1e3, 1e3] {
                let within = |value: f64, range: NumberRange| assert!(range.contains(value), "{family:?} {value}");
                match family.candidate(&[wish; 3]) {
                    Candidate::Feedback(Law::Corrected { kappa, lead, margin }) => {
                        within(kappa, gains::KAPPA);
                        within(lead, gains::LEAD);
                        within(margin, gains::MARGIN);
                    }
                    Candidate::Feedback(Law::Printed { alpha, beta }) => {
                        within(alpha, gains::ALPHA);
                        within(beta, gains::BETA);
                    }
                    Candidate::Adaptive { margin } => within(margin, gains::MARGIN),
                }
            }
        }
    }

    #[test]
    fn the_place_of_a_law_in_its_family_leads_back_to_it() {
        let law = Law::Corrected { kappa: 0.4, lead: 0.3, margin: 0.05 };
        assert_eq!(Family::Corrected.place(law.into()), None, "its λ is not 0");
        let place = Family::Pi.place(law.into()).unwrap();
        let Candidate::Feedback(Law::Corrected { kappa, lead, margin }) = Family::Pi.candidate(&place) else {
            panic!("a PI law")
        };
        assert!(
            [kappa - 0.4, lead - 0.3, margin - 0.05].iter().all(|off| off.abs() < 1e-12),
            "{kappa} {lead} {margin}"
        );
    }

    #[test]
    fn every_grid_of_the_corrected_law_holds_gains_with_margins_at_every_delay() {
        // all of a frame's time goes with polygons: the loop's gain is κ, at its largest
        for dead_time in 0..=DEAD_TIME_MAX {
            let safe = |kappa: &f64| {
                let near = Loop { gain: *kappa, lead: 0.0, dead_time };
                near.gain_margin() >= 2.0 && near.delay_margin() >= 2
            };
            assert!(Family::Corrected.grid()[0].iter().any(safe), "{dead_time} frames");
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
