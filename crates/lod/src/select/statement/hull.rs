//! The concave hull of every object's levels, as steps in falling gain per cost.
//!
//! In: a [`Problem`]. Out: the start of every object, and the steps on its hull, best first.
//! Never here: how many steps are taken. Theory: `docs/theory/budget.md`, eq. 4 and 5, after (SZ79).

use alloc::vec::Vec;

use super::problem::{Entry, Level, Problem};
use super::ratio::{Rank, Ratio};

/// One step from a vertex of an object's hull to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// Which object, in the order in which they were pushed.
    pub object: u32,
    /// The object's level after the step.
    pub level: u32,
    /// Benefit and cost that the step adds; cost in ticks.
    pub gain: Ratio,
}

/// The start of every object, and all steps of all hulls, best first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hulls {
    /// The cheapest set.
    pub bases: Vec<Level>,
    /// Steps in falling gain per cost; the steps of one object are in the order of its hull.
    pub steps: Vec<Step>,
}

impl Hulls {
    /// The hulls of a problem whose cheapest set fits; levels that can never fit are left out (otherwise no bound holds).
    #[must_use]
    pub fn of(problem: &Problem) -> Self {
        let bases = problem.cheapest();
        let spare = problem.budget().saturating_sub(problem.cost(&bases));
        let (mut ranked, mut hull) = (Vec::new(), Vec::new());
        for (object, &base) in bases.iter().enumerate() {
            let least = problem.entry(object, base);
            let reach = least.cost + spare;
            concave(least, problem.levels(object), reach, &mut hull);
            let mut from = least;
            for &(level, to) in &hull {
                let gain = Ratio { benefit: to.benefit - from.benefit, cost: to.cost - from.cost };
                ranked.push((Rank::new(gain, problem.id(object), object, level), gain));
                from = to;
            }
        }
        ranked.sort_unstable_by_key(|&(rank, _)| rank);
        let steps = ranked.into_iter().map(|(r, gain)| Step { object: r.object, level: r.level, gain }).collect();
        Self { bases, steps }
    }
}

/// The vertices of the concave hull above `least`, in rising cost; levels that cost more than `reach` are excluded.
pub(crate) fn concave(least: Entry, levels: &[Entry], reach: u64, hull: &mut Vec<(u32, Entry)>) {
    hull.clear();
    let mut order: Vec<_> = (0..levels.len() as u32).map(|l| (l, levels[l as usize])).collect();
    order.retain(|&(_, e)| e.cost <= reach && e.cost >= least.cost);
    order.sort_unstable_by_key(|&(l, e)| (e.cost, u64::MAX - e.benefit, l));
    for (level, to) in order {
        if to.benefit <= hull.last().map_or(least.benefit, |&(_, e)| e.benefit) {
            continue;
        }
        while let Some(&(_, middle)) = hull.last() {
            let before = hull.len().checked_sub(2).map_or(least, |i| hull[i].1);
            if slope(before, middle) > slope(middle, to) {
                break;
            }
            hull.pop();
        }
        hull.push((level, to));
    }
}

fn slope(from: Entry, to: Entry) -> Ratio {
    Ratio { benefit: to.benefit - from.benefit, cost: to.cost - from.cost }
}
