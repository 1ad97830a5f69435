//! Steps of concave hulls in falling gain per cost, until the budget is spent.
//!
//! In: a [`Problem`]. Out: a [`Selection`] within λ · (budget left over) of the optimum.
//! Never here: a time; the per-frame version is [`crate::adaptive`]. Theory: `docs/theory/budget.md`, eq. 7 and 8, after (SZ79).

use alloc::vec::Vec;

use crate::select::statement::hull::Hulls;
use crate::select::statement::linear::split;
use crate::select::statement::problem::{Level, Problem, Selection};

/// The rule at a step that no longer fits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fit {
    /// Nothing more is taken: small moves of the view change few levels, and λ · (budget left over) certifies the answer.
    Stop,
    /// That object is closed and the others continue; then any level that still fits is taken, largest gain first.
    Fill,
}

/// Takes the steps of all hulls in falling gain per cost.
#[must_use]
pub fn marginal(problem: &Problem, fit: Fit) -> Selection {
    if let Some(infeasible) = problem.infeasible() {
        return infeasible;
    }
    let hulls = Hulls::of(problem);
    let (bound, whole) = split(problem, &hulls);
    let mut levels = hulls.bases.clone();
    for step in whole {
        levels[step.object as usize] = Some(step.level);
    }
    if fit == Fit::Fill {
        go_on(problem, &hulls, whole.len(), &mut levels);
        fill(problem, &mut levels);
    }
    problem.certified(levels, bound.value)
}

/// The better of [`Fit::Stop`] and the best answer with a single step above the cheapest set: never below half of the optimum's gain over
/// the cheapest set (eq. 8), and so never below half of the optimum.
#[must_use]
pub fn repaired(problem: &Problem) -> Selection {
    marginal(problem, Fit::Stop).or_better(best_single(problem))
}

/// The cheapest set with the single change that gains most: needed for every bound of one half.
#[must_use]
pub fn best_single(problem: &Problem) -> Selection {
    if let Some(infeasible) = problem.infeasible() {
        return infeasible;
    }
    let mut levels = problem.cheapest();
    if let Some((object, level)) = best_change(problem, &levels, problem.cost(&levels)) {
        levels[object] = Some(level);
    }
    problem.judge(levels)
}

/// After the first step that does not fit: its object is closed, the others continue.
fn go_on(problem: &Problem, hulls: &Hulls, taken: usize, levels: &mut [Level]) {
    let mut spent = problem.cost(levels);
    let mut closed: Vec<bool> = alloc::vec![false; levels.len()];
    for step in &hulls.steps[taken..] {
        let object = step.object as usize;
        if closed[object] {
            continue;
        }
        if spent + step.gain.cost <= problem.budget() {
            spent += step.gain.cost;
            levels[object] = Some(step.level);
        } else {
            closed[object] = true;
        }
    }
}

/// Takes the largest gain that fits, on a hull or not, until nothing fits.
fn fill(problem: &Problem, levels: &mut [Level]) {
    let mut spent = problem.cost(levels);
    while let Some((object, level)) = best_change(problem, levels, spent) {
        spent = spent - problem.entry(object, levels[object]).cost + problem.levels(object)[level as usize].cost;
        levels[object] = Some(level);
    }
}

/// The change of one object that gains most and fits; ties go to the lower id, then the lower level.
fn best_change(problem: &Problem, levels: &[Level], spent: u64) -> Option<(usize, u32)> {
    let mut best = None;
    for (object, &level) in levels.iter().enumerate() {
        let held = problem.entry(object, level);
        for (level, to) in (0_u32..).zip(problem.levels(object)) {
            let fits = spent - held.cost + to.cost <= problem.budget();
            if fits && to.benefit > held.benefit {
                let rank = (u64::MAX - (to.benefit - held.benefit), problem.id(object), level, object);
                best = Some(best.map_or(rank, |b: (u64, u64, u32, usize)| b.min(rank)));
            }
        }
    }
    best.map(|(_, _, level, object)| (object, level))
}
