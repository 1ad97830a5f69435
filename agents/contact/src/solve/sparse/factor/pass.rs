//! A pass over the fronts whose numbers have changed: each is filled, takes the updates of those below it, and is
//! eliminated.
//!
//! In: where the numbers of fronts are, the numbers of the matrix. Out: the factor's numbers. Never here: which fronts
//! are stale, solutions.

use super::super::fronts::Front;
use super::super::tiles::{TILE, eliminate, triangle};
use super::{Entries, Layout, Target};
use fearless_simd::Level;
use metachron_core::ParallelFor;
use std::ops::Range;

/// Trees of fronts that cost less than two of these together are not divided: some 50 µs, in multiplications.
const JOB_MIN: f64 = 2e5;

/// One pass over the fronts that are to be factored again.
pub(super) struct Pass<'a> {
    pub level: Level,
    pub fronts: &'a [Front],
    pub layouts: &'a [Layout],
    pub children: &'a [Vec<usize>],
    /// For each front the first of the tree that ends with it.
    pub trees: &'a [usize],
    pub targets: &'a [Target],
    /// The matrix without the terms that `more` adds.
    pub base: &'a [f64],
    /// Which fronts are to be factored again.
    pub stale: &'a [bool],
    /// The cost of the stale fronts before each one together, in multiplications.
    pub costs: &'a [f64],
    /// Adds to the numbers of a front.
    pub more: &'a (dyn Fn(usize, &mut Entries<'_>) + Sync),
    pub threads: &'a dyn ParallelFor,
}

/// Fronts that follow each other, all that is below any of them included, and where their numbers are.
pub(super) struct Part<'a> {
    pub fronts: Range<usize>,
    pub lower: &'a mut [f64],
    pub update: &'a mut [f64],
}

impl Pass<'_> {
    /// Factors a part. Fails with the first place in the order at which it is not positive definite.
    pub(super) fn factor(&self, part: &mut Part<'_>) -> Result<(), usize> {
        let Range { start, end } = part.fronts;
        if self.cost(start..end) < 2.0 * JOB_MIN {
            return (start..end).try_for_each(|front| self.factor_front(front, part));
        }
        // fronts that all others are below come last
        let mut top = end;
        while top > start && self.trees[top - 1] == start {
            top -= 1;
        }
        if let Some(at) = self.balanced_split(start..top) {
            let [mut first, mut second] = part.split(at, top, self.layouts);
            let [mut one, mut other] = [Ok(()); 2];
            self.threads.join(&mut || one = self.factor(&mut first), &mut || other = self.factor(&mut second));
            one.and(other)?;
        }
        (top..end).try_for_each(|front| self.factor_front(front, part))
    }

    /// The cost of the stale ones of these fronts.
    fn cost(&self, fronts: Range<usize>) -> f64 {
        self.costs[fronts.end] - self.costs[fronts.start]
    }

    /// Where a tree begins such that the trees before it cost about as much as it does with those that follow; `None`
    /// of one tree or none.
    fn balanced_split(&self, fronts: Range<usize>) -> Option<usize> {
        let Range { start, end } = fronts;
        let off = |at: usize| (self.cost(start..at) - self.cost(at..end)).abs();
        let mut best = self.trees[..end].last().copied().filter(|&at| at > start)?;
        let mut at = best;
        while at > start {
            if off(at) < off(best) {
                best = at;
            }
            at = self.trees[at - 1];
        }
        Some(best)
    }

    fn factor_front(&self, front: usize, part: &mut Part<'_>) -> Result<(), usize> {
        if !self.stale[front] {
            return Ok(());
        }
        let (layout, first) = (&self.layouts[front], &self.layouts[part.fronts.start]);
        let own = layout.lower - first.lower..layout.lower - first.lower + layout.size();
        part.lower[own.clone()].copy_from_slice(layout.of(self.base));
        (self.more)(front, &mut Entries { values: &mut part.lower[own.clone()], chunk: TILE * layout.columns });
        let (below, update) = part.update.split_at_mut(layout.update - first.update);
        let update = &mut update[..triangle(layout.rows / TILE)];
        let lower = &mut part.lower[own];
        self.gather(front, Goal { lower, update }, |child| &below[self.layouts[child].update - first.update..]);
        eliminate(self.level, lower, update, layout.columns).map_err(|at| self.fronts[front].first + at / 3)
    }

    /// Adds the updates of the fronts right below one; `of` gives numbers that begin with those of a child.
    fn gather<'b>(&self, front: usize, goal: Goal<'_>, of: impl Fn(usize) -> &'b [f64]) {
        let Goal { lower, update: own } = goal;
        own.fill(0.0);
        for &child in &self.children[front] {
            let Layout { rows, targets: start, inner, .. } = self.layouts[child];
            let count = 3 * self.fronts[child].rows.len();
            let (goals, update) = (&self.targets[start..start + count], of(child));
            for row in 0..rows / TILE {
                let tiles = &update[triangle(row)..triangle(row + 1)];
                let here = &goals[row * TILE..count.min((row + 1) * TILE)];
                for (column, values) in tiles.as_chunks::<TILE>().0.iter().enumerate() {
                    // of the tile on the diagonal the lower half alone
                    let start = column.saturating_sub(row * TILE);
                    let Some(goal) = goals.get(column) else { break };
                    let pairs = here.iter().zip(values).skip(start);
                    if column < inner {
                        pairs.for_each(|(target, value)| lower[target.near + goal.column] += value);
                    } else {
                        pairs.for_each(|(target, value)| own[target.far + goal.column] += value);
                    }
                }
            }
        }
    }
}

/// The numbers of a front: its columns, and the update that it hands on.
struct Goal<'a> {
    lower: &'a mut [f64],
    update: &'a mut [f64],
}

impl Part<'_> {
    /// Its fronts before `at`, and those from there to `end`.
    fn split(&mut self, at: usize, end: usize, layouts: &[Layout]) -> [Part<'_>; 2] {
        let Self { fronts, lower, update } = self;
        let (first, middle) = (&layouts[fronts.start], &layouts[at]);
        let lower = lower.split_at_mut(middle.lower - first.lower);
        let update = update.split_at_mut(middle.update - first.update);
        [
            Part { fronts: fronts.start..at, lower: lower.0, update: update.0 },
            Part { fronts: at..end, lower: lower.1, update: update.1 },
        ]
    }
}
