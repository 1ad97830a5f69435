//! The hierarchical choice of Maciel and Shirley (MS95): always refines the most important node.
//!
//! In: a [`Tree`] and the importance of its leaves. Out: a [`Cut`]. Never here: costs or benefits of impostors as a criterion; the other
//! policies do that better. Theory: `docs/theory/budget.md`, eq. 21.

use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::Reverse;

use super::tree::{Cut, Tree};
use super::tree_exact::infeasible;

/// Starts from the root's lowest form; the most important node that is drawn goes to its next form, until that no longer fits.
///
/// `importance` has one entry per node; entries of groups are ignored, a group is as important as its most important
/// part. NaN or missing entries count as 0. If the root's lowest form does not fit, the result is the cheapest cut.
#[must_use]
pub fn choose(tree: &Tree, importance: &[f64]) -> Cut {
    if let Some(cut) = infeasible(tree) {
        return cut;
    }
    let importance = of_groups(tree, importance);
    let mut levels = alloc::vec![None; tree.len()];
    let mut queue = BinaryHeap::new();
    if !tree.is_empty() {
        tree.lowest(0, &mut levels);
    }
    let queued = |node: usize| (importance[node], Reverse(node));
    queue.extend((0..tree.len()).filter(|&i| levels[i].is_some()).map(queued));
    let mut spent = tree.certified(levels.clone(), 0.0).cost;
    if spent > tree.budget() {
        return tree.judge(super::tree_exact::cheapest(tree));
    }
    while let Some((_, Reverse(node))) = queue.pop() {
        let Some((next, cost)) = next_form(tree, node, levels[node].unwrap_or(0)) else { continue };
        let held = tree.impostors(node)[levels[node].unwrap_or(0) as usize].cost;
        if spent - held + cost > tree.budget() {
            break;
        }
        spent = spent - held + cost;
        levels[node] = None;
        for (part, level) in next {
            levels[part] = Some(level);
            queue.push(queued(part));
        }
    }
    tree.judge(levels)
}

/// The replacement of a node's impostor, and its cost; `None` at the finest.
fn next_form(tree: &Tree, node: usize, level: u32) -> Option<(Vec<(usize, u32)>, u64)> {
    if let Some(e) = tree.impostors(node).get(level as usize + 1) {
        return Some((alloc::vec![(node, level + 1)], e.cost));
    }
    let (mut open, mut parts, mut cost) = (tree.children(node).to_vec(), Vec::new(), 0);
    while let Some(part) = open.pop() {
        match tree.impostors(part).first() {
            Some(e) => {
                parts.push((part, 0));
                cost += e.cost;
            }
            None => open.extend(tree.children(part)),
        }
    }
    (!parts.is_empty()).then_some((parts, cost))
}

/// Importance as integers that can be sorted: a group's is the greatest of its parts'.
fn of_groups(tree: &Tree, importance: &[f64]) -> Vec<u64> {
    let mut of = alloc::vec![0; tree.len()];
    for &node in tree.order().iter().rev() {
        // the bits of non-negative doubles sort like the doubles
        let own = importance.get(node).map_or(0, |x| if *x > 0.0 { x.to_bits() } else { 0 });
        let parts = tree.children(node).iter().map(|&c| of[c]).max();
        of[node] = parts.unwrap_or(own);
    }
    of
}
