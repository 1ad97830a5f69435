//! The incremental choice of Funkhouser and Séquin (FS93, §6): from the last frame's levels, one rise, then as many falls as needed.
//!
//! In: a [`Problem`] and the levels of the frame before. Out: a [`Selection`], and how many passes it took.
//! Never here: a guarantee; the result equals the greedy choice only if benefit per cost falls with every level.
//! Theory: `docs/theory/budget.md`, eq. 12.

use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::Reverse;

use super::passes::{Convergence, Search, converge};
use crate::select::statement::linear::linear;
use crate::select::statement::problem::{Level, Mode, Problem, Selection};
use crate::select::statement::ratio::{Rank, Ratio};

/// Which of the visited states is the answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keep {
    /// The last, as in the paper: its value can be below that of an earlier one.
    Last,
    /// The best that fitted.
    Best,
}

/// The result of the passes.
#[derive(Debug, Clone, PartialEq)]
pub struct Passes {
    /// The answer.
    pub selection: Selection,
    /// Passes of one rise and as many falls as needed.
    pub passes: u32,
    /// Whether the search converged; otherwise the limit of passes was reached.
    pub settled: bool,
}

/// Starts from `last`, the levels of the frame before (`None` for new objects; empty for a cold start), and passes until an object rises
/// and falls in the same pass.
#[must_use]
pub fn incremental(problem: &Problem, last: &[Level], keep: Keep) -> Passes {
    if let Some(selection) = problem.infeasible() {
        return Passes { selection, passes: 0, settled: true };
    }
    let mut search = ObjectSearch::from(problem, last);
    // from any start, every level of every object can rise and fall once before a state must repeat
    let most = 2 * (0..problem.len()).map(|i| problem.levels(i).len() as u32 + 1).sum::<u32>() + 8;
    let Convergence { passes, settled } = converge(&mut search, most);
    let levels = match keep {
        Keep::Last if search.spent <= problem.budget() => search.levels,
        _ => search.best.1,
    };
    let upper = linear(problem).map_or(0.0, |l| l.value);
    Passes { selection: problem.certified(levels, upper), passes, settled }
}

struct ObjectSearch<'a> {
    problem: &'a Problem,
    levels: Vec<Level>,
    spent: u64,
    value: u64,
    /// The best state that fitted: value and levels. The cheapest set, at first.
    best: (u64, Vec<Level>),
    /// Candidates for a rise and for a fall; outdated entries are skipped.
    rises: BinaryHeap<Reverse<Rank>>,
    falls: BinaryHeap<Rank>,
}

impl<'a> ObjectSearch<'a> {
    fn from(problem: &'a Problem, last: &[Level]) -> Self {
        let cheapest = problem.cheapest();
        let start = |i: usize| {
            let held = last.get(i).copied().flatten().filter(|&l| (l as usize) < problem.levels(i).len());
            held.map_or(cheapest[i], |l| Some(l.max(cheapest[i].unwrap_or(0))))
        };
        let levels: Vec<_> = (0..problem.len()).map(start).collect();
        let (spent, value) = (problem.cost(&levels), problem.value(&levels));
        let best = (problem.value(&cheapest), cheapest);
        let mut search =
            Self { problem, levels, spent, value, best, rises: BinaryHeap::new(), falls: BinaryHeap::new() };
        (0..problem.len()).for_each(|i| search.offer(i));
        search.keep_best();
        search
    }

    fn change(&mut self, object: usize, level: Level) {
        let (from, to) = (self.problem.entry(object, self.levels[object]), self.problem.entry(object, level));
        self.spent = self.spent - from.cost + to.cost;
        self.value = self.value - from.benefit + to.benefit;
        self.levels[object] = level;
        self.offer(object);
    }

    /// Queues the object's next rise and next fall.
    fn offer(&mut self, object: usize) {
        let levels = self.problem.levels(object);
        let rank = |level: u32| {
            let e = levels[level as usize];
            Rank::new(Ratio { benefit: e.benefit, cost: e.cost }, self.problem.id(object), object, level)
        };
        let next = above(self.levels[object]);
        if (next as usize) < levels.len() {
            self.rises.push(Reverse(rank(next)));
        }
        let lowest = if self.problem.mode() == Mode::AtMostOne { None } else { self.problem.least(object) };
        if let Some(held) = self.levels[object].filter(|_| self.levels[object] > lowest) {
            self.falls.push(rank(held));
        }
    }
}

impl Search for ObjectSearch<'_> {
    fn is_over(&self) -> bool {
        self.spent > self.problem.budget()
    }

    fn rise(&mut self) -> Option<usize> {
        while let Some(Reverse(rank)) = self.rises.pop() {
            if above(self.levels[rank.object as usize]) == rank.level {
                self.change(rank.object as usize, Some(rank.level));
                return Some(rank.object as usize);
            }
        }
        None
    }

    fn fall(&mut self) -> Option<usize> {
        while let Some(rank) = self.falls.pop() {
            if self.levels[rank.object as usize] == Some(rank.level) {
                self.change(rank.object as usize, rank.level.checked_sub(1));
                return Some(rank.object as usize);
            }
        }
        None
    }

    fn keep_best(&mut self) {
        if !self.is_over() && self.value > self.best.0 {
            self.best.0 = self.value;
            self.best.1.clone_from(&self.levels);
        }
    }
}

/// The level above one, whether it exists or not.
fn above(level: Level) -> u32 {
    level.map_or(0, |l| l + 1)
}
