//! The incremental hierarchical choice of Mason and Blake (MB97, §4): one rise in the tree, then as many falls as needed.
//!
//! In: a [`Tree`] and the cut of the frame before. Out: a [`Cut`] that covers every leaf, always.
//! Never here: a guarantee; the search stops at the first rise that does not fit. Theory: `docs/theory/budget.md`, eq. 17 and 18.

use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::Reverse;

use super::tree::{Cut, Tree};
use super::tree_exact::infeasible;
use crate::select::separate::incremental::Keep;
use crate::select::separate::passes::{Convergence, Search, converge};
use crate::select::statement::problem::Level;
use crate::select::statement::ratio::Rank;

/// The result of the passes.
#[derive(Debug, Clone, PartialEq)]
pub struct Passes {
    /// The answer.
    pub cut: Cut,
    /// Passes of one rise and as many falls as needed.
    pub passes: u32,
    /// Whether the search converged; otherwise the limit of passes was reached.
    pub settled: bool,
}

/// Starts from `last`, the cut of the frame before (the root's lowest form if that is no cut of this tree), and passes until a node rises
/// and falls in the same pass.
#[must_use]
pub fn incremental(tree: &Tree, last: &[Level], keep: Keep) -> Passes {
    if let Some(cut) = infeasible(tree) {
        return Passes { cut, passes: 0, settled: true };
    }
    let mut search = TreeSearch::from(tree, last);
    let most = 2 * (0..tree.len()).map(|i| tree.impostors(i).len() as u32 + 1).sum::<u32>() + 8;
    let Convergence { passes, settled } = converge(&mut search, most);
    let cut = match (keep, search.best) {
        (Keep::Best, Some((_, levels))) => tree.judge(levels),
        (Keep::Last, Some((_, levels))) if search.spent > tree.budget() => tree.judge(levels),
        // started over the budget and never came below it: the answer is the cheapest cut
        (_, None) => tree.judge(super::tree_exact::cheapest(tree)),
        _ => tree.judge(search.levels),
    };
    Passes { cut, passes, settled }
}

/// A node that can fall: from this impostor, or from its children where `level` is `None`.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Fall {
    rank: Rank,
    node: usize,
    level: Level,
}

struct TreeSearch<'a> {
    tree: &'a Tree,
    levels: Vec<Level>,
    spent: u64,
    value: u64,
    best: Option<(u64, Vec<Level>)>,
    /// For each node: the best rank among its children's lowest forms.
    opened: Vec<Option<Rank>>,
    /// For each node: how many of its children are at their lowest.
    low: Vec<usize>,
    rises: BinaryHeap<Reverse<(Rank, usize, Level)>>,
    falls: BinaryHeap<Fall>,
}

impl<'a> TreeSearch<'a> {
    fn from(tree: &'a Tree, last: &[Level]) -> Self {
        let none = || alloc::vec![None; tree.len()];
        let mut start = none();
        if tree.is_cut(last) {
            start.clone_from_slice(last);
        } else if !tree.is_empty() {
            tree.lowest(0, &mut start);
        }
        let mut search = Self {
            tree,
            levels: none(),
            spent: 0,
            value: 0,
            best: None,
            opened: opened(tree),
            low: alloc::vec![0; tree.len()],
            rises: BinaryHeap::new(),
            falls: BinaryHeap::new(),
        };
        for (node, level) in start.into_iter().enumerate().filter(|(_, l)| l.is_some()) {
            search.set(node, level);
        }
        search.keep_best();
        search
    }

    /// Replaces a node by the lowest forms of its children.
    fn open(&mut self, node: usize) {
        for i in 0..self.tree.children(node).len() {
            let child = self.tree.children(node)[i];
            if self.tree.impostors(child).is_empty() {
                self.open(child);
            } else {
                self.set(child, Some(0));
            }
        }
    }

    fn clear_below(&mut self, node: usize) {
        for i in 0..self.tree.children(node).len() {
            let child = self.tree.children(node)[i];
            if self.levels[child].is_some() {
                self.set(child, None);
            } else {
                self.clear_below(child);
            }
        }
    }

    /// Sets one node's level, updates the sums, and queues its next rise and fall.
    fn set(&mut self, node: usize, level: Level) {
        let was_lowest = self.at_lowest(node);
        let entry = |l: Level| l.map(|l| self.tree.impostors(node)[l as usize]).unwrap_or_default();
        let (from, to) = (entry(self.levels[node]), entry(level));
        self.spent = self.spent - from.cost + to.cost;
        self.value = self.value - from.benefit + to.benefit;
        self.levels[node] = level;
        self.update_parents(node, was_lowest);
        let Some(held) = level else { return };
        let above = held + 1;
        let finer = (above as usize) < self.tree.impostors(node).len();
        let rise = if finer { Some(self.tree.rank(node, above)) } else { self.opened[node] };
        self.rises.extend(rise.map(|rank| Reverse((rank, node, level))));
        if held > 0 {
            self.falls.push(Fall { rank: self.tree.rank(node, held), node, level });
        }
    }

    /// Whether a node is drawn in its lowest form.
    fn at_lowest(&self, node: usize) -> bool {
        let parts = self.tree.children(node).len();
        let open = self.tree.impostors(node).is_empty();
        self.levels[node] == Some(0) || (open && parts > 0 && self.low[node] == parts)
    }

    fn can_close(&self, node: usize) -> bool {
        let parts = self.tree.children(node).len();
        self.levels[node].is_none() && !self.tree.impostors(node).is_empty() && parts > 0 && self.low[node] == parts
    }

    /// Updates upwards how many children of each parent are at their lowest.
    fn update_parents(&mut self, node: usize, was_lowest: bool) {
        let (mut node, mut was) = (node, was_lowest);
        while let Some(parent) = self.tree.parent(node) {
            let is = self.at_lowest(node);
            if is == was {
                return;
            }
            was = self.at_lowest(parent);
            self.low[parent] = if is { self.low[parent] + 1 } else { self.low[parent] - 1 };
            if let (true, Some(rank)) = (self.can_close(parent), self.opened[parent]) {
                self.falls.push(Fall { rank, node: parent, level: None });
            }
            node = parent;
        }
    }
}

impl Search for TreeSearch<'_> {
    fn is_over(&self) -> bool {
        self.spent > self.tree.budget()
    }

    fn rise(&mut self) -> Option<usize> {
        while let Some(Reverse((_, node, level))) = self.rises.pop() {
            if self.levels[node] != level {
                continue;
            }
            let next = level.map_or(0, |l| l + 1);
            if (next as usize) < self.tree.impostors(node).len() {
                self.set(node, Some(next));
            } else {
                self.set(node, None);
                self.open(node);
            }
            return Some(node);
        }
        None
    }

    fn fall(&mut self) -> Option<usize> {
        while let Some(Fall { node, level, .. }) = self.falls.pop() {
            match level {
                Some(held) if self.levels[node] == level => self.set(node, Some(held - 1)),
                None if self.can_close(node) => {
                    self.clear_below(node);
                    self.set(node, Some(self.tree.impostors(node).len() as u32 - 1));
                }
                _ => continue,
            }
            return Some(node);
        }
        None
    }

    fn keep_best(&mut self) {
        if !self.is_over() && self.best.as_ref().is_none_or(|b| self.value > b.0) {
            self.best = Some((self.value, self.levels.clone()));
        }
    }
}

/// For each node the best rank among its children's lowest forms; `None` for leaves.
fn opened(tree: &Tree) -> Vec<Option<Rank>> {
    let mut opened: Vec<Option<Rank>> = alloc::vec![None; tree.len()];
    for &node in tree.order().iter().rev() {
        let lowest = |&child: &usize| {
            if tree.impostors(child).is_empty() { opened[child] } else { Some(tree.rank(child, 0)) }
        };
        opened[node] = tree.children(node).iter().filter_map(lowest).min();
    }
    opened
}
