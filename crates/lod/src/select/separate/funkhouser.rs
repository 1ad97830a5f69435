//! The greedy choice of Funkhouser and Séquin (FS93, §6): whole levels in falling benefit per cost.
//!
//! In: a [`Problem`]. Out: a [`Selection`]. Never here: the incremental form ([`super::incremental`]).
//! Theory: `docs/theory/budget.md`, eq. 10 and 11: the paper promises half of the optimum, which is false; a third is guaranteed with
//! [`repaired`].

use alloc::vec::Vec;

use super::marginal::best_single;
use crate::select::statement::problem::{Problem, Selection};
use crate::select::statement::ratio::{Rank, Ratio};

/// The rule at a level that does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scan {
    /// The scan ends, "until the maximum cost is completely claimed" (FS93): one large object can block everything.
    Stop,
    /// The level is skipped and the scan goes on.
    Skip,
}

/// Scans all levels in falling benefit per cost; a level replaces another of its object if its benefit is greater.
#[must_use]
pub fn greedy(problem: &Problem, scan: Scan) -> Selection {
    if let Some(infeasible) = problem.infeasible() {
        return infeasible;
    }
    let mut levels = problem.cheapest();
    let mut spent = problem.cost(&levels);
    for rank in ranked(problem) {
        let (object, level) = (rank.object as usize, rank.level);
        let (held, to) = (problem.entry(object, levels[object]), problem.levels(object)[level as usize]);
        if to.benefit <= held.benefit {
            continue;
        }
        if spent - held.cost + to.cost <= problem.budget() {
            spent = spent - held.cost + to.cost;
            levels[object] = Some(level);
        } else if scan == Scan::Stop {
            break;
        }
    }
    problem.judge(levels)
}

/// The better of [`greedy`] with [`Scan::Skip`] and the best single change: never below a third of the optimum if objects may be left out
/// (eq. 11).
#[must_use]
pub fn repaired(problem: &Problem) -> Selection {
    greedy(problem, Scan::Skip).or_better(best_single(problem))
}

fn ranked(problem: &Problem) -> Vec<Rank> {
    let of = |object| {
        (0..).zip(problem.levels(object)).map(move |(level, e)| {
            Rank::new(Ratio { benefit: e.benefit, cost: e.cost }, problem.id(object), object, level)
        })
    };
    let mut ranked: Vec<_> = (0..problem.len()).flat_map(of).collect();
    ranked.sort_unstable();
    ranked
}
