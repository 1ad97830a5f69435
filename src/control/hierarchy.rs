//! The policies that choose a cut through groups and their members (MB97, MS95).
//!
//! In: ladders, groups, a time. Out: a rung or a proxy for everything in view, and a promise. Never here: flat choices.
//! Theory: `docs/theory/budget.md`, section 4.

use super::ask::{Ask, Promise, TICKS, demand, left_out};
use super::groups::Groups;
use super::ladder::Rung;
use super::plan::LevelDemand;
use super::policy::Policy;
use super::select;
use metachron_agents::AgentId;
use metachron_budget::select::incremental::Keep;
use metachron_budget::select::tree::{Cut, Node, Tree};
use metachron_budget::select::{Entry, Level, maciel, mason, mason_flat};
use std::collections::BTreeMap;

/// What these policies remember from frame to frame.
#[derive(Debug, Clone, Default)]
pub(super) struct Hierarchy {
    /// The cut of the frame before.
    last: BTreeMap<AgentId, Level>,
    worth: Vec<f64>,
}

/// The tree of a frame: below a root without a picture all groups in view, below them what is in view of their members.
struct Forest {
    nodes: Vec<Node>,
    /// The object of every node; the root has none.
    objects: Vec<Option<usize>>,
}

impl Hierarchy {
    /// Chooses by `policy`; `levels` has one entry an object.
    pub fn choose(&mut self, policy: Policy, ask: &Ask<'_>, groups: &Groups, levels: &mut [LevelDemand]) -> Promise {
        groups.lowest_worth(ask, &mut self.worth);
        let forest = Forest::of(ask, groups, &self.worth);
        if forest.nodes.len() < 2 {
            let predicted_s = ask.fixed_s;
            return Promise { budget_s: ask.budget_s(), predicted_s, feasible: true, ..Promise::default() };
        }
        let Ok(tree) = Tree::new(ask.budget(), &forest.nodes) else { return Promise::default() };
        let cut = self.cut(policy, ask, (&tree, &forest));
        self.last.clear();
        for (object, level) in forest.objects.iter().zip(&cut.levels) {
            let Some(at) = *object else { continue };
            self.last.insert(ask.views[at].0.id, *level);
            draw(ask, at, *level, levels);
        }
        leave_out_members(ask, groups, levels);
        promise(ask, &cut)
    }

    fn cut(&self, policy: Policy, ask: &Ask<'_>, (tree, forest): (&Tree, &Forest)) -> Cut {
        match policy {
            Policy::HierarchicalFlat => mason_flat::flat(tree),
            Policy::MacielShirley => {
                let importance = |at: &Option<usize>| at.map_or(0.0, |at| ask.weight(at));
                maciel::choose(tree, &forest.objects.iter().map(importance).collect::<Vec<_>>())
            }
            _ => {
                let last = |at: &Option<usize>| self.last.get(&ask.views[(*at)?].0.id).copied().flatten();
                let known =
                    |(node, level): (usize, Level)| level.filter(|l| (*l as usize) < tree.impostors(node).len());
                let last: Vec<_> = forest.objects.iter().map(last).enumerate().map(known).collect();
                mason::incremental(tree, &last, Keep::Last).cut
            }
        }
    }
}

impl Forest {
    fn of(ask: &Ask<'_>, groups: &Groups, worth: &[f64]) -> Self {
        let mut forest = Self { nodes: vec![Node { parent: None, impostors: Vec::new() }], objects: vec![None] };
        let mut place = vec![0; ask.views.len()];
        // groups stand after their members, so backwards they come before them
        let in_view = |group: &&usize| worth[**group] > 0.0;
        for &group in groups.all().iter().rev().filter(in_view) {
            let Some(proxy) = ask.ladders.of(group).proxy else { continue };
            let entry = proxy_entry(ask, &proxy, worth[group]);
            place[group] = forest.push(groups.parent(group).map_or(0, |parent| place[parent]), group, vec![entry]);
        }
        for at in ask.drawable() {
            let weight = ask.weight(at);
            let entries = ask.ladders.of(at).rungs.iter().map(|rung| ask.entry(weight, rung)).collect();
            forest.push(groups.parent(at).map_or(0, |parent| place[parent]), at, entries);
        }
        forest
    }

    fn push(&mut self, parent: usize, object: usize, impostors: Vec<Entry>) -> usize {
        self.nodes.push(Node { parent: Some(parent), impostors });
        self.objects.push(Some(object));
        self.nodes.len() - 1
    }
}

/// A proxy as an entry: its worth is told already.
fn proxy_entry(ask: &Ask<'_>, proxy: &Rung, worth: f64) -> Entry {
    ask.entry(worth, &Rung { accuracy: 1.0, ..*proxy })
}

/// Draws an object at a rung or a group by its proxy, where the cut has it.
fn draw(ask: &Ask<'_>, at: usize, level: Level, levels: &mut [LevelDemand]) {
    match (ask.ladders.of(at).proxy, level) {
        (Some(proxy), Some(_)) => levels[at] = demand(at, ask.views, &proxy),
        (Some(_), None) => {}
        (None, level) => select::set(ask, at, level, levels),
    }
}

/// Whatever belongs to a group that is drawn by its proxy is left out, in view or not.
pub(super) fn leave_out_members(ask: &Ask<'_>, groups: &Groups, levels: &mut [LevelDemand]) {
    for at in 0..levels.len() {
        let closed = |group: usize| levels[group].polygons > 0.0;
        if groups.parent(at).is_some() && groups.is_within(at, closed) {
            levels[at] = left_out(at, ask.views, ask.ladders.of(at));
        }
    }
}

fn promise(ask: &Ask<'_>, cut: &Cut) -> Promise {
    Promise {
        budget_s: ask.budget_s(),
        predicted_s: ask.fixed_s + cut.cost as f64 / TICKS,
        value: cut.value as f64,
        upper: cut.upper,
        feasible: cut.feasible,
        holes: 0,
    }
}
