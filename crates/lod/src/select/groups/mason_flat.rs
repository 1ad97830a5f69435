//! The flat reading of Mason and Blake (MB97, §6): impostors of groups as items shared by several leaves.
//!
//! In: a [`Tree`]. Out: a [`Cut`] that covers every leaf. Never here: the incremental form ([`super::mason`]); the two are not equal,
//! contrary to the paper. Theory: `docs/theory/budget.md`, eq. 18.

use alloc::vec::Vec;
use core::ops::Range;

use super::tree::{Cut, Tree};
use super::tree_exact::{cheapest, infeasible};
use crate::select::statement::problem::Level;
use crate::select::statement::ratio::Rank;

/// Scans all impostors in falling benefit per cost; one that overlaps others in the knapsack replaces them together with the best remaining
/// ones that cover the rest of their leaves, if they fit and have a greater benefit; else it is skipped.
#[must_use]
pub fn flat(tree: &Tree) -> Cut {
    if let Some(cut) = infeasible(tree) {
        return cut;
    }
    let mut knapsack = Knapsack::of(tree);
    for at in 0..knapsack.items.len() {
        knapsack.consider(at);
    }
    match knapsack.levels() {
        Some(levels) => tree.judge(levels),
        // no covering set fitted in the order of the scan
        None => tree.judge(cheapest(tree)),
    }
}

struct Knapsack<'a> {
    tree: &'a Tree,
    /// All impostors in falling benefit per cost: rank, node, level.
    items: Vec<(Rank, usize, u32)>,
    /// For each node: its leaves, numbered from left to right.
    leaves: Vec<Range<usize>>,
    /// For each leaf: the item that covers it; initially one virtual item for all, without cost and benefit.
    covered_by: Vec<Option<usize>>,
    spent: u64,
}

impl<'a> Knapsack<'a> {
    fn of(tree: &'a Tree) -> Self {
        let of = |node| (0..).zip(tree.impostors(node)).map(move |(l, _)| (tree.rank(node, l), node, l));
        let mut items: Vec<_> = (0..tree.len()).flat_map(of).collect();
        items.sort_unstable();
        let leaves = leaves(tree);
        let covered_by = alloc::vec![None; leaves.first().map_or(0, |all| all.len())];
        Self { tree, items, leaves, covered_by, spent: 0 }
    }

    fn consider(&mut self, at: usize) {
        let own = self.leaves[self.items[at].1].clone();
        let met = self.met(&own);
        // a replaced item of a group above covers other leaves too
        let all = met.iter().fold(own, |all, &item| {
            let theirs = self.covers(item);
            all.start.min(theirs.start)..all.end.max(theirs.end)
        });
        let Some(set) = self.replacement(at, &all) else { return };
        let sum = |items: &mut dyn Iterator<Item = usize>| {
            items.fold((0, 0), |(cost, value), item| {
                let e = self.tree.impostors(self.items[item].1)[self.items[item].2 as usize];
                (cost + e.cost, value + e.benefit)
            })
        };
        let (old_cost, old_value) = sum(&mut met.iter().filter_map(|&item| item));
        let (cost, value) = sum(&mut set.iter().copied());
        if value > old_value && self.spent - old_cost + cost <= self.tree.budget() {
            self.spent = self.spent - old_cost + cost;
            for item in set {
                self.covered_by[self.leaves[self.items[item].1].clone()].fill(Some(item));
            }
        }
    }

    /// The items that cover some of these leaves, each once.
    fn met(&self, leaves: &Range<usize>) -> Vec<Option<usize>> {
        let mut met = self.covered_by[leaves.clone()].to_vec();
        met.dedup(); // an item's leaves are neighbours
        met
    }

    fn covers(&self, item: Option<usize>) -> Range<usize> {
        item.map_or(0..self.covered_by.len(), |item| self.leaves[self.items[item].1].clone())
    }

    /// Item `at` and the best remaining ones that cover the rest of `all`; `None` if they cannot.
    fn replacement(&self, at: usize, all: &Range<usize>) -> Option<Vec<usize>> {
        let own = &self.leaves[self.items[at].1];
        let mut open: Vec<_> = all.clone().map(|leaf| !own.contains(&leaf)).collect();
        let mut missing = open.iter().filter(|&&o| o).count();
        let mut set = alloc::vec![at];
        for (item, &(_, node, _)) in self.items.iter().enumerate().skip(at + 1) {
            if missing == 0 {
                break;
            }
            let theirs = &self.leaves[node];
            if theirs.start < all.start || theirs.end > all.end {
                continue;
            }
            let part = &mut open[theirs.start - all.start..theirs.end - all.start];
            if part.iter().all(|&o| o) {
                missing -= part.len();
                part.fill(false);
                set.push(item);
            }
        }
        (missing == 0).then_some(set)
    }

    /// The cut, if every leaf is covered.
    fn levels(&self) -> Option<Vec<Level>> {
        let mut levels = alloc::vec![None; self.tree.len()];
        for item in &self.covered_by {
            let (_, node, level) = self.items[(*item)?];
            levels[node] = Some(level);
        }
        Some(levels)
    }
}

/// The leaves of every node, numbered so that leaves of one group are neighbours.
fn leaves(tree: &Tree) -> Vec<Range<usize>> {
    let mut count = alloc::vec![0; tree.len()];
    for &node in tree.order().iter().rev() {
        let parts: usize = tree.children(node).iter().map(|&c| count[c]).sum();
        count[node] = parts.max(1);
    }
    let mut leaves = alloc::vec![0..0; tree.len()];
    if let Some(all) = count.first() {
        leaves[0] = 0..*all;
    }
    for &node in tree.order() {
        let mut start = leaves[node].start;
        for &child in tree.children(node) {
            leaves[child] = start..start + count[child];
            start += count[child];
        }
    }
    leaves
}
