//! At least half of the best for a choice in a tree (MB97, §6).
//!
//! In: a [`Tree`] and an answer. Out: an answer that is worth at least half of the best cut. Never here: the answer's own method.
//! Theory: `docs/theory/budget.md`, eq. 18 and 20.
//!
//! The paper's own argument does not hold: neither its incremental form nor its flat one is ever within a constant of the optimum, as
//! opening a group changes many parts at once. The certificate holds: an answer of half the bound is of half the
//! optimum.

use alloc::vec::Vec;

use super::tree::{Cut, Tree};
use super::tree_exact::{cheapest, exact, lagrange};
use crate::select::statement::problem::{Entry, Level};

/// Parts of cuts that are stored at most to find the optimum, 40 bytes each: needed where single impostors are large beside the budget, so
/// that few parts fit.
const STATES_MAX: usize = 100_000;

/// The answer if its certificate proves that it is worth half of the best; else the better of the greedy answer and the best single
/// impostor; else the optimum, where it is found with few parts.
#[must_use]
pub fn at_least_half(tree: &Tree, answer: Cut) -> Cut {
    let proven = |cut: &Cut| !cut.feasible || 2.0 * cut.value as f64 >= cut.upper;
    if proven(&answer) {
        return answer;
    }
    let better = |a: Cut, b: Cut| if b.feasible && (!a.feasible || b.value > a.value) { b } else { a };
    let greedy = better(answer, lagrange(tree));
    let best = best_single(tree).map_or(greedy.clone(), |levels| better(greedy, tree.judge(levels)));
    if proven(&best) {
        return best;
    }
    exact(tree, STATES_MAX).map_or(best.clone(), |cut| better(best, cut))
}

/// The cut that differs from the cheapest by one impostor and by the groups that have to be open for it; of such cuts
/// that fit, the one worth most.
fn best_single(tree: &Tree) -> Option<Vec<Level>> {
    let base = cheapest_below(tree);
    let mut around = alloc::vec![Entry::default(); tree.len()];
    let mut best: Option<(u64, usize, u32)> = None;
    for &node in tree.order() {
        // its parent's, and the siblings before and after it; sums that saturate cannot be taken apart again
        let (mut before, mut after) = (around[node], Entry::default());
        for &child in tree.children(node) {
            around[child] = before;
            before = sum(before, base[child]);
        }
        for &child in tree.children(node).iter().rev() {
            around[child] = sum(around[child], after);
            after = sum(after, base[child]);
        }
        for (level, &own) in (0..).zip(tree.impostors(node)) {
            let all = sum(own, around[node]);
            if all.cost <= tree.budget() && best.is_none_or(|(value, ..)| all.benefit > value) {
                best = Some((all.benefit, node, level));
            }
        }
    }
    let (_, node, level) = best?;
    let mut levels = cheapest(tree);
    let above = core::iter::successors(Some(node), |&node| tree.parent(node)).collect::<Vec<_>>();
    for &open in above.iter().rev() {
        levels[open] = None;
        for &child in tree.children(open) {
            clear(tree, child, &mut levels);
            if open != node && !above.contains(&child) {
                set_cheapest(tree, &base, child, &mut levels);
            }
        }
    }
    levels[node] = Some(level);
    Some(levels)
}

/// The cheapest cut of everything below a node and itself.
fn cheapest_below(tree: &Tree) -> Vec<Entry> {
    let mut base = alloc::vec![Entry::default(); tree.len()];
    for &node in tree.order().iter().rev() {
        let parts = tree.children(node).iter().map(|&child| base[child]).fold(Entry::default(), sum);
        let parts = (!tree.children(node).is_empty()).then_some(parts);
        let own = tree.impostors(node).iter().copied();
        base[node] = own.chain(parts).min_by_key(|e| (e.cost, u64::MAX - e.benefit)).unwrap_or_default();
    }
    base
}

/// Sets the cheapest cut below a node that is clear.
fn set_cheapest(tree: &Tree, base: &[Entry], node: usize, levels: &mut [Level]) {
    match (0..).zip(tree.impostors(node)).find(|(_, own)| **own == base[node]) {
        Some((level, _)) => levels[node] = Some(level),
        None => tree.children(node).iter().for_each(|&child| set_cheapest(tree, base, child, levels)),
    }
}

fn clear(tree: &Tree, node: usize, levels: &mut [Level]) {
    levels[node] = None;
    tree.children(node).iter().for_each(|&child| clear(tree, child, levels));
}

fn sum(a: Entry, b: Entry) -> Entry {
    Entry { cost: a.cost.saturating_add(b.cost), benefit: a.benefit.saturating_add(b.benefit) }
}
