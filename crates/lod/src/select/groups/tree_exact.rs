//! The best cut of a tree, and the bound from the concave hull of all its cuts.
//!
//! In: a [`Tree`]. Out: the optimum, the best vertex of the root's hull, the bound. Never here: a time limit for the optimum.
//! Theory: `docs/theory/budget.md`, eq. 19 and 20.

use alloc::vec::Vec;

use super::tree::{Cut, Tree};
use crate::select::statement::exact::TooHard;
use crate::select::statement::hull::concave;
use crate::select::statement::problem::{Entry, Level};
use crate::select::statement::ratio::Ratio;

/// The cheapest cut, marked infeasible, if no cut is within the budget.
pub(crate) fn infeasible(tree: &Tree) -> Option<Cut> {
    let hulls = Hulls::of(tree);
    let cheapest = hulls.root().map_or(0, |h| h.vertices[0].entry.cost);
    (cheapest > tree.budget()).then(|| tree.certified(hulls.cut(tree, 0), 0.0))
}

/// The cheapest cut.
pub(crate) fn cheapest(tree: &Tree) -> Vec<Level> {
    Hulls::of(tree).cut(tree, 0)
}

/// No cut within the budget has a greater value than this (eq. 20); 0 where there is none.
pub(crate) fn upper(tree: &Tree) -> f64 {
    Hulls::of(tree).split(tree.budget()).map_or(0.0, |s| s.upper)
}

/// The best vertex of the hull of all cuts that fits: the result of one price λ for all nodes.
#[must_use]
pub fn lagrange(tree: &Tree) -> Cut {
    let hulls = Hulls::of(tree);
    let Some(split) = hulls.split(tree.budget()) else {
        return tree.certified(hulls.cut(tree, 0), 0.0);
    };
    tree.certified(hulls.cut(tree, split.vertex), split.upper)
}

/// A vertex of the hull of a node's cuts.
#[derive(Clone, Copy)]
struct Vertex {
    entry: Entry,
    origin: Origin,
}

/// The origin of a vertex.
#[derive(Clone, Copy)]
enum Origin {
    /// One of the node's own impostors.
    Impostor(u32),
    /// The children's hulls, after this many of their steps.
    Steps(u32),
}

#[derive(Default)]
struct Hull {
    /// In rising cost, and falling gain per cost.
    vertices: Vec<Vertex>,
    /// Steps of all children, best first: the child of each.
    steps: Vec<u32>,
}

struct Split {
    vertex: usize,
    upper: f64,
}

struct Hulls {
    of: Vec<Hull>,
}

impl Hulls {
    fn of(tree: &Tree) -> Self {
        let mut hulls = Self { of: (0..tree.len()).map(|_| Hull::default()).collect() };
        for &node in tree.order().iter().rev() {
            hulls.of[node] = hulls.join(tree, node);
        }
        hulls
    }

    fn root(&self) -> Option<&Hull> {
        self.of.first()
    }

    /// The hull of a node's impostors and of the sums of its children's hulls.
    fn join(&self, tree: &Tree, node: usize) -> Hull {
        let mut points: Vec<_> = (0..).zip(tree.impostors(node)).map(|(l, &e)| (e, Origin::Impostor(l))).collect();
        let steps = self.steps(tree, node);
        if !tree.children(node).is_empty() {
            let first = |&child: &usize| self.of[child].vertices[0].entry;
            let mut sum = tree.children(node).iter().map(first).fold(Entry::default(), add);
            points.push((sum, Origin::Steps(0)));
            for (taken, &(_, gain)) in (1..).zip(&steps) {
                sum = add(sum, gain);
                points.push((sum, Origin::Steps(taken)));
            }
        }
        let vertices = hull_of(&points);
        Hull { vertices, steps: steps.into_iter().map(|(child, _)| child).collect() }
    }

    /// The steps of all children, best first.
    fn steps(&self, tree: &Tree, node: usize) -> Vec<(u32, Entry)> {
        let of = |&child: &usize| {
            let pairs = self.of[child].vertices.windows(2);
            pairs.map(move |pair| (child as u32, less(pair[1].entry, pair[0].entry)))
        };
        let mut steps: Vec<_> = tree.children(node).iter().flat_map(of).collect();
        let ratio = |e: Entry| Ratio { benefit: e.benefit, cost: e.cost };
        steps.sort_by(|a, b| ratio(b.1).cmp(&ratio(a.1)).then(a.0.cmp(&b.0))); // stable: a child's steps keep their order
        steps
    }

    /// The point where the budget cuts the root's hull; `None` if even its first vertex does not fit.
    fn split(&self, budget: u64) -> Option<Split> {
        let Some(root) = self.root() else { return Some(Split { vertex: 0, upper: 0.0 }) };
        let fitting = root.vertices.partition_point(|v| v.entry.cost <= budget);
        let vertex = fitting.checked_sub(1)?;
        let at = root.vertices[vertex].entry;
        let upper = root.vertices.get(fitting).map_or(at.benefit as f64, |next| {
            let step = less(next.entry, at);
            at.benefit as f64 + step.benefit as f64 / step.cost as f64 * (budget - at.cost) as f64
        });
        Some(Split { vertex, upper })
    }

    /// The cut behind a vertex of the root.
    fn cut(&self, tree: &Tree, vertex: usize) -> Vec<Level> {
        let mut levels = alloc::vec![None; tree.len()];
        let mut open: Vec<_> = (!tree.is_empty()).then_some((0, vertex)).into_iter().collect();
        while let Some((node, vertex)) = open.pop() {
            match self.of[node].vertices[vertex].origin {
                Origin::Impostor(level) => levels[node] = Some(level),
                Origin::Steps(taken) => {
                    let steps = &self.of[node].steps[..taken as usize];
                    let of = |child: usize| steps.iter().filter(|&&s| s as usize == child).count();
                    open.extend(tree.children(node).iter().map(|&child| (child, of(child))));
                }
            }
        }
        levels
    }
}

/// The vertices of the concave hull of points, from the cheapest on.
fn hull_of(points: &[(Entry, Origin)]) -> Vec<Vertex> {
    let least = points.iter().copied().min_by_key(|(e, _)| (e.cost, u64::MAX - e.benefit));
    let Some((entry, origin)) = least else { return Vec::new() };
    let entries: Vec<_> = points.iter().map(|p| p.0).collect();
    let mut above = Vec::new();
    concave(entry, &entries, u64::MAX, &mut above);
    let rest = above.iter().map(|&(i, entry)| Vertex { entry, origin: points[i as usize].1 });
    core::iter::once(Vertex { entry, origin }).chain(rest).collect()
}

fn add(a: Entry, b: Entry) -> Entry {
    Entry { cost: a.cost + b.cost, benefit: a.benefit + b.benefit }
}

fn less(a: Entry, b: Entry) -> Entry {
    Entry { cost: a.cost - b.cost, benefit: a.benefit - b.benefit }
}

/// A part of a cut that is not dominated by another part with the same leaves.
#[derive(Clone, Copy)]
struct State {
    entry: Entry,
    parts: Parts,
}

/// The parts that a state joins.
#[derive(Clone, Copy)]
enum Parts {
    Nothing,
    Impostor(u32, u32),
    Both(u32, u32),
}

/// The optimal cut (eq. 19). `states_max` bounds the memory: 40 bytes for each part of a cut stored, over all nodes together.
///
/// # Errors
/// [`TooHard`] if more parts than that could each still belong to the optimum.
pub fn exact(tree: &Tree, states_max: usize) -> Result<Cut, TooHard> {
    if let Some(infeasible) = infeasible(tree) {
        return Ok(infeasible);
    }
    let mut arena = alloc::vec![State { entry: Entry::default(), parts: Parts::Nothing }];
    let mut of: Vec<Vec<u32>> = alloc::vec![Vec::new(); tree.len()];
    for &node in tree.order().iter().rev() {
        let impostors = (0..).zip(tree.impostors(node));
        let own = impostors.map(|(l, &entry)| State { entry, parts: Parts::Impostor(node as u32, l) });
        let mut list = keep(&mut arena, own.collect(), tree.budget());
        if !tree.children(node).is_empty() {
            let mut parts = alloc::vec![0];
            for &child in tree.children(node) {
                parts = product(&mut arena, &parts, &of[child], tree.budget());
                if arena.len() > states_max {
                    return Err(TooHard { states: arena.len() });
                }
            }
            list.extend(parts);
            list = best(&arena, list);
        }
        of[node] = list;
    }
    let levels = trace(tree, &arena, of.first().and_then(|list| list.last()).copied().unwrap_or(0));
    let cut = tree.certified(levels, 0.0);
    Ok(Cut { upper: cut.value as f64, ..cut })
}

/// Combines every part of one list with every part of another.
fn product(arena: &mut Vec<State>, a: &[u32], b: &[u32], budget: u64) -> Vec<u32> {
    let pair = |&(i, j): &(u32, u32)| State {
        entry: add(arena[i as usize].entry, arena[j as usize].entry),
        parts: Parts::Both(i, j),
    };
    let states = a.iter().flat_map(|&i| b.iter().map(move |&j| (i, j))).map(|p| pair(&p)).collect();
    keep(arena, states, budget)
}

/// Adds the parts that fit and are not dominated to the arena.
fn keep(arena: &mut Vec<State>, mut states: Vec<State>, budget: u64) -> Vec<u32> {
    states.retain(|s| s.entry.cost <= budget);
    states.sort_by_key(|s| (s.entry.cost, u64::MAX - s.entry.benefit));
    let mut most = None;
    let mut list = Vec::new();
    for state in states {
        let benefit = Some(state.entry.benefit);
        if benefit > most {
            most = benefit;
            list.push(arena.len() as u32);
            arena.push(state);
        }
    }
    list
}

/// The parts in the arena that are not dominated.
fn best(arena: &[State], mut list: Vec<u32>) -> Vec<u32> {
    list.sort_by_key(|&i| (arena[i as usize].entry.cost, u64::MAX - arena[i as usize].entry.benefit));
    let mut most = None;
    list.retain(|&i| {
        let benefit = Some(arena[i as usize].entry.benefit);
        let better = benefit > most;
        most = most.max(benefit);
        better
    });
    list
}

fn trace(tree: &Tree, arena: &[State], last: u32) -> Vec<Level> {
    let mut levels = alloc::vec![None; tree.len()];
    let mut open = alloc::vec![last];
    while let Some(i) = open.pop() {
        match arena[i as usize].parts {
            Parts::Nothing => {}
            Parts::Impostor(node, level) => levels[node as usize] = Some(level),
            Parts::Both(a, b) => open.extend([a, b]),
        }
    }
    levels
}
