//! The optimum of the multiple-choice knapsack, by a list of non-dominated partial answers.
//!
//! In: a [`Problem`]. Out: the best [`Selection`], or an error if the problem is too hard. Never here: a time limit; this is for tests and
//! offline use. Theory: `docs/theory/budget.md`, eq. 9, after (KPP04).

use alloc::vec::Vec;

use super::problem::{Entry, Level, Problem, Selection};
use crate::select::separate::marginal::{Fit, marginal};

/// The list of partial answers grew past the allowed size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooHard {
    /// Number of partial answers at which the search stopped.
    pub states: usize,
}

/// A choice for the first objects in the order of ids, with its cost and value.
#[derive(Clone, Copy)]
struct State {
    cost: u64,
    value: u64,
    /// Index of the predecessor state (one object fewer), and the level of the last object.
    from: u32,
    level: Level,
}

/// The optimum. `states_max` bounds the memory: 24 bytes for each partial answer stored, over all objects together.
///
/// # Errors
/// [`TooHard`] if more partial answers than that could each still be part of the optimum.
pub fn exact(problem: &Problem, states_max: usize) -> Result<Selection, TooHard> {
    if let Some(infeasible) = problem.infeasible() {
        return Ok(infeasible);
    }
    let order = problem.by_id();
    let bounds = Bounds::of(problem, &order);
    let mut layers: Vec<Vec<State>> = alloc::vec![alloc::vec![State { cost: 0, value: 0, from: 0, level: None }]];
    let mut kept = 1;
    for (done, &object) in order.iter().enumerate() {
        let next = extend(problem, object, &layers[done], |cost, value| bounds.hopeless(done + 1, cost, value));
        kept += next.len();
        if kept > states_max {
            return Err(TooHard { states: kept });
        }
        layers.push(next);
    }
    let levels = trace(&layers, &order);
    let value = problem.value(&levels);
    Ok(problem.certified(levels, value as f64))
}

/// Upper bounds for the objects still to come, and a value that is known to be reachable.
struct Bounds {
    budget: u64,
    /// Known to be reachable: a state that cannot reach this is dropped.
    reached: u64,
    /// For each number of objects done: least cost of the rest, and steps of its relaxation as running sums of (cost, value).
    rest: Vec<Vec<(u64, u64)>>,
}

impl Bounds {
    fn of(problem: &Problem, order: &[usize]) -> Self {
        let reached = marginal(problem, Fit::Fill).value;
        let rest = (0..=order.len()).map(|done| relaxation(problem, &order[done..])).collect();
        Self { budget: problem.budget(), reached, rest }
    }

    /// Whether no completion of this partial answer can reach the known value.
    fn hopeless(&self, done: usize, cost: u64, value: u64) -> bool {
        let sums = &self.rest[done];
        let Some(spare) = self.budget.checked_sub(cost + sums[0].0) else { return true };
        let at = sums.partition_point(|s| s.0 - sums[0].0 <= spare) - 1;
        let part = sums.get(at + 1).map_or(0, |next| {
            let left = u128::from(spare - (sums[at].0 - sums[0].0));
            let gain = u128::from(next.1 - sums[at].1);
            (left * gain / u128::from(next.0 - sums[at].0)) as u64
        });
        value + sums[at].1 + part < self.reached
    }
}

/// The relaxation of some objects as running sums, from their cheapest set to the top of all hulls.
fn relaxation(problem: &Problem, objects: &[usize]) -> Vec<(u64, u64)> {
    let mut sub = Problem::new(problem.mode(), i64::MAX);
    for &object in objects {
        sub.push(problem.id(object), problem.levels(object));
    }
    let hulls = super::hull::Hulls::of(&sub);
    let mut sums = alloc::vec![(sub.cost(&hulls.bases), sub.value(&hulls.bases))];
    for step in &hulls.steps {
        let last = sums[sums.len() - 1];
        let next = (last.0 + step.gain.cost, last.1 + step.gain.benefit);
        if step.gain.cost == 0 {
            sums.pop(); // a free step is included from the start
        }
        sums.push(next);
    }
    sums
}

/// Every state combined with every level of one more object, without dominated ones.
fn extend(problem: &Problem, object: usize, states: &[State], hopeless: impl Fn(u64, u64) -> bool) -> Vec<State> {
    let choices = choices(problem, object);
    let mut next = Vec::new();
    for (from, state) in states.iter().enumerate() {
        for &(level, entry) in &choices {
            let (cost, value) = (state.cost + entry.cost, state.value + entry.benefit);
            if cost <= problem.budget() && !hopeless(cost, value) {
                next.push(State { cost, value, from: from as u32, level });
            }
        }
    }
    next.sort_unstable_by_key(|s| (s.cost, u64::MAX - s.value, s.level, s.from));
    let mut most = None;
    next.retain(|s| {
        let better = most.is_none_or(|m| s.value > m);
        most = if better { Some(s.value) } else { most };
        better
    });
    next
}

fn choices(problem: &Problem, object: usize) -> Vec<(Level, Entry)> {
    let levels = problem.levels(object);
    let none = problem.least(object).is_none().then_some((None, Entry::default()));
    none.into_iter().chain((0..).map(Some).zip(levels.iter().copied())).collect()
}

/// The levels of the last state, which is the best.
fn trace(layers: &[Vec<State>], order: &[usize]) -> Vec<Level> {
    let mut levels = alloc::vec![None; order.len()];
    let mut at = layers[order.len()].len().saturating_sub(1);
    for (done, &object) in order.iter().enumerate().rev() {
        let state = layers[done + 1][at];
        levels[object] = state.level;
        at = state.from as usize;
    }
    levels
}
