//! Groups of objects that can be drawn as one: a tree, of which a cut is drawn (MB97, §3).
//!
//! In: nodes with impostors. Out: a [`Tree`] that the hierarchical policies answer with a [`Cut`].
//! Never here: the choice of a cut. Theory: `docs/theory/budget.md`, eq. 17 and 18.

use alloc::vec::Vec;

use super::tree_exact;
use crate::select::statement::problem::{Entry, Level};
use crate::select::statement::ratio::{Rank, Ratio};

/// A node before it is in a tree.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Node {
    /// The node above it; `None` for the first, which is the root, and for no other.
    pub parent: Option<usize>,
    /// The node's own impostors, coarsest first; a leaf has at least one.
    pub impostors: Vec<Entry>,
}

/// Why nodes do not form a tree. No tree is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum TreeError {
    /// This node is not connected to the root: no such parent, its own parent, a cycle, or a second root.
    Loose(usize),
    /// This leaf has no impostor, so no cut could cover it.
    BareLeaf(usize),
}

impl core::fmt::Display for TreeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Loose(node) => write!(f, "node {node} does not hang from the first node"),
            Self::BareLeaf(node) => write!(f, "node {node} has neither children nor impostors"),
        }
    }
}

impl core::error::Error for TreeError {}

/// A hierarchy of objects with impostors, and the budget.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tree {
    budget: u64,
    impostors: Vec<Vec<Entry>>,
    parents: Vec<Option<usize>>,
    children: Vec<Vec<usize>>,
    /// Parents before their children.
    order: Vec<usize>,
}

impl Tree {
    /// A tree of nodes, the first of which is the root; `budget` in ticks, a negative one is 0. No nodes are an empty scene.
    ///
    /// # Errors
    /// [`TreeError`] names the first node that is not in the tree, or the first leaf that could not be drawn.
    pub fn new(budget: i64, nodes: &[Node]) -> Result<Self, TreeError> {
        let mut children = alloc::vec![Vec::new(); nodes.len()];
        for (i, node) in nodes.iter().enumerate() {
            match node.parent {
                Some(parent) if parent < nodes.len() && i > 0 => children[parent].push(i),
                None if i == 0 => {}
                _ => return Err(TreeError::Loose(i)),
            }
        }
        let mut order: Vec<usize> = (0..nodes.len().min(1)).collect();
        let mut at = 0;
        while at < order.len() {
            order.extend(&children[order[at]]);
            at += 1;
        }
        if let Some(loose) = (0..nodes.len()).find(|i| order.len() < nodes.len() && !order.contains(i)) {
            return Err(TreeError::Loose(loose));
        }
        if let Some(bare) = (0..nodes.len()).find(|&i| children[i].is_empty() && nodes[i].impostors.is_empty()) {
            return Err(TreeError::BareLeaf(bare));
        }
        let sound = |n: &Node| n.impostors.iter().map(|e| Entry::new(e.cost, e.benefit)).collect();
        let impostors = nodes.iter().map(sound).collect();
        let parents = nodes.iter().map(|n| n.parent).collect();
        Ok(Self { budget: budget.max(0) as u64, impostors, parents, children, order })
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.parents.len()
    }

    /// Whether there is nothing to draw.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.parents.is_empty()
    }

    /// The budget, ticks.
    #[must_use]
    pub fn budget(&self) -> u64 {
        self.budget
    }

    /// A node's own impostors, coarsest first.
    #[must_use]
    pub fn impostors(&self, node: usize) -> &[Entry] {
        &self.impostors[node]
    }

    /// The parts of a node.
    #[must_use]
    pub fn children(&self, node: usize) -> &[usize] {
        &self.children[node]
    }

    /// The group a node belongs to; `None` for the root.
    #[must_use]
    pub fn parent(&self, node: usize) -> Option<usize> {
        self.parents[node]
    }

    /// All nodes, parents before their children.
    #[must_use]
    pub fn order(&self) -> &[usize] {
        &self.order
    }

    /// The lowest form of a node: its first impostor, or the lowest forms of its children.
    pub(crate) fn lowest(&self, node: usize, levels: &mut [Level]) {
        if self.impostors[node].is_empty() {
            self.children[node].iter().for_each(|&child| self.lowest(child, levels));
        } else {
            levels[node] = Some(0);
        }
    }

    /// The position of an impostor in the order of falling benefit per cost.
    pub(crate) fn rank(&self, node: usize, level: u32) -> Rank {
        let e = self.impostors[node][level as usize];
        Rank::new(Ratio { benefit: e.benefit, cost: e.cost }, node as u64, node, level)
    }

    /// Whether the impostors given cover every leaf exactly once.
    #[must_use]
    pub fn is_cut(&self, levels: &[Level]) -> bool {
        if levels.len() != self.len() {
            return false;
        }
        let mut above = alloc::vec![0_u32; self.len()];
        for &node in &self.order {
            let own = match levels[node] {
                Some(l) if l as usize >= self.impostors[node].len() => return false,
                own => u32::from(own.is_some()),
            };
            above[node] = own + self.parents[node].map_or(0, |p| above[p]);
            if above[node] > 1 || (self.children[node].is_empty() && above[node] == 0) {
                return false;
            }
        }
        true
    }

    /// A cut with its cost, value and certificate. `levels` has one entry per node, each an existing impostor.
    #[must_use]
    pub fn judge(&self, levels: Vec<Level>) -> Cut {
        self.certified(levels, tree_exact::upper(self))
    }

    pub(crate) fn certified(&self, levels: Vec<Level>, upper: f64) -> Cut {
        let entries = || levels.iter().enumerate().filter_map(|(i, l)| Some(self.impostors[i][(*l)? as usize]));
        let (cost, value) = (entries().map(|e| e.cost).sum(), entries().map(|e| e.benefit).sum());
        Cut { levels, value, cost, feasible: cost <= self.budget, upper }
    }
}

/// A cut of a tree, and its certificate.
#[derive(Debug, Clone, PartialEq)]
pub struct Cut {
    /// One entry per node: the impostor drawn for it, `None` where its parts or a group above it are drawn.
    pub levels: Vec<Level>,
    /// Sum of the benefits.
    pub value: u64,
    /// Sum of the costs, ticks.
    pub cost: u64,
    /// Whether the cost is within the budget; `false` for the cheapest cut if no cut fits.
    pub feasible: bool,
    /// The certificate: no cut within the budget has a greater value. 0 where there is no such cut.
    pub upper: f64,
}

impl Cut {
    /// Upper bound of the relative loss against the optimum.
    #[must_use]
    pub fn gap(&self) -> f64 {
        if self.upper > 0.0 { (1.0 - self.value as f64 / self.upper).max(0.0) } else { 0.0 }
    }
}
