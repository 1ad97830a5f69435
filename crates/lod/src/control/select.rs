//! The policies of the papers that choose for every object separately, applied to one frame.
//!
//! In: ladders, a time. Out: a rung for every object in view, and a promise. Never here: trees ([`super::hierarchy`]), policies that are
//! corrected by measured frames ([`super::adaptive`]). Theory: `docs/theory/budget.md`, sections 2, 3, 5 and 6.

use super::benefit;
use super::ladder::Rung;
use super::level::{Cut, LastCut};
use super::plan::{LevelDemand, SizedView};
use super::policy::Policy;
use super::query::{FrameQuery, Promise, TICKS, demand, left_out};
use crate::select::barrier::{Limits, interior_point};
use crate::select::funkhouser;
use crate::select::funkhouser::Scan;
use crate::select::gobbetti::{Mesh, Resolutions, closed_form};
use crate::select::incremental::{Keep, incremental};
use crate::select::marginal;
use crate::select::marginal::Fit;
use crate::select::robin_hood::{Instance, TooLittle, distribute};
use crate::select::threshold;
use crate::select::threshold::STATIC_PX;
use crate::select::{Entry, Level, Mode, Problem, Selection};
use metachron_core::AgentId;
use std::collections::BTreeMap;

/// Time of a Newton step of the interior point per mesh, seconds.
const NEWTON_S: f64 = 60e-9;

/// The interior point stops within a hundredth of the optimum and may come nearer the next time: a smaller relative change of r is ignored.
const SAME_R: f64 = 0.02;

/// State of these policies from frame to frame.
#[derive(Debug, Clone, Default)]
pub(super) struct Select {
    threshold: threshold::Feedback,
    /// Rungs of the frame before, for the incremental choice.
    last: BTreeMap<AgentId, Level>,
    /// Resolutions of the frame before, for the interior point.
    last_r: BTreeMap<AgentId, f64>,
}

impl Select {
    /// Reports the time of a frame, for the threshold that follows it.
    pub fn observe(&mut self, work_s: f64, target_s: f64) {
        self.threshold.observe(work_s, target_s);
    }

    /// Chooses by `policy`; `levels` has one entry per object, of which those in view with rungs are set.
    pub fn choose(&mut self, policy: Policy, query: &FrameQuery<'_>, levels: &mut [LevelDemand]) -> Promise {
        match policy {
            Policy::RobinHood => robin_hood(query, levels),
            Policy::Convex | Policy::ConvexBarrier => self.convex(policy == Policy::ConvexBarrier, query, levels),
            _ => self.knapsack(policy, query, levels),
        }
    }

    /// Every object has one rung; the cheapest of all if even those do not fit.
    fn knapsack(&mut self, policy: Policy, query: &FrameQuery<'_>, levels: &mut [LevelDemand]) -> Promise {
        let mut problem = Problem::new(Mode::ExactlyOne, query.budget());
        let objects: Vec<_> = query.drawable().collect();
        for &at in &objects {
            problem.push(id(query, at), &self.entries(policy, query, at));
        }
        let selection = self.solve(policy, query, &problem, &objects);
        self.last.clear();
        for (&at, level) in objects.iter().zip(&selection.levels) {
            self.last.insert(query.views[at].view.id, *level);
            set(query, at, *level, levels);
        }
        promise(query, &selection)
    }

    /// The rungs of an object as entries.
    fn entries(&self, policy: Policy, query: &FrameQuery<'_>, at: usize) -> Vec<Entry> {
        let (SizedView { view, .. }, rungs) = (&query.views[at], &query.ladders.of(at).rungs);
        let last = self.last.get(&view.id).copied();
        let steps = rungs.len().max(2) as f64 - 1.0;
        let change = |level: usize| last.flatten().map_or(0.0, |last| (level as f64 - f64::from(last)).abs() / steps);
        let weight = query.weight(at);
        let entry = |(level, rung): (usize, &Rung)| match policy.has_printed_benefit() {
            true => query.entry_of(rung, benefit::printed(view, rung, change(level), query.sliders)),
            false => query.entry(weight, rung),
        };
        rungs.iter().enumerate().map(entry).collect()
    }

    fn solve(&self, policy: Policy, query: &FrameQuery<'_>, problem: &Problem, objects: &[usize]) -> Selection {
        match policy {
            Policy::Static => by_size(query, problem, objects, STATIC_PX),
            Policy::Threshold => by_size(query, problem, objects, self.threshold.threshold_px()),
            Policy::GreedyIncremental => {
                let rungs = |at: usize| query.ladders.of(at).rungs.len() as u32;
                let last = |at: &usize| {
                    let level = self.last.get(&query.views[*at].view.id).copied().flatten();
                    level.filter(|level| *level < rungs(*at))
                };
                let last: Vec<_> = objects.iter().map(last).collect();
                incremental(problem, &last, Keep::Last).selection
            }
            Policy::GreedyRepaired => funkhouser::repaired(problem),
            Policy::MarginalStop => marginal::marginal(problem, Fit::Stop),
            Policy::MarginalFill => marginal::marginal(problem, Fit::Fill),
            _ => funkhouser::greedy(problem, Scan::Skip),
        }
    }

    /// Any number of triangles (GB99); objects with few levels are rounded down to one of them.
    fn convex(&mut self, by_barrier: bool, query: &FrameQuery<'_>, levels: &mut [LevelDemand]) -> Promise {
        let objects: Vec<_> = query.drawable().collect();
        let meshes: Vec<_> = objects.iter().map(|&at| mesh(query, at)).collect();
        let setups: f64 = objects.iter().map(|&at| setup_s(query, at)).sum();
        let budget_s = query.budget_s();
        let found = if by_barrier {
            let last = |at: &usize| self.last_r.get(&query.views[*at].view.id).copied();
            // a warm start needs all objects: a single new one has no resolution to start from
            let last: Option<Vec<_>> = objects.iter().map(last).collect();
            interior_point(budget_s, setups, &meshes, &last.unwrap_or_default(), limits(query, objects.len()))
        } else {
            closed_form(budget_s, setups, &meshes)
        };
        let before = std::mem::take(&mut self.last_r);
        let mut spent_s = 0.0;
        for (&at, r) in objects.iter().zip(&found.r) {
            let SizedView { view, span } = &query.views[at];
            let held = before.get(&view.id).filter(|held| by_barrier && (r / **held - 1.0).abs() <= SAME_R);
            let r = held.unwrap_or(r);
            self.last_r.insert(view.id, *r);
            let Cut { resolution, polygons } = LastCut::default().choose(view, *span, r * span.full);
            let best = query.ladders.of(at).rungs.last().map_or(levels[at].shading, |rung| rung.shading);
            levels[at] = LevelDemand { id: view.id, resolution, polygons, shading: best };
            spent_s += cost_s(query, at, polygons);
        }
        convex_promise(query, &found, spent_s)
    }
}

/// The optimiser's time limit as a number of steps, each linear in the number of meshes.
fn limits(query: &FrameQuery<'_>, meshes: usize) -> Limits {
    let usual = Limits::default();
    let step_s = NEWTON_S * meshes.max(1) as f64;
    // a cast of floats saturates
    let steps = query.choose_s.map_or(usual.steps, |choose_s| ((choose_s / step_s) as u32).clamp(1, usual.steps));
    Limits { steps, ..usual }
}

fn id(query: &FrameQuery<'_>, at: usize) -> u64 {
    u64::from(query.views[at].view.id.0)
}

/// Draws an object at a rung, or leaves it out.
pub(super) fn set(query: &FrameQuery<'_>, at: usize, level: Level, levels: &mut [LevelDemand]) {
    let ladder = query.ladders.of(at);
    levels[at] = match level.and_then(|level| ladder.rungs.get(level as usize)) {
        Some(rung) => demand(at, query.views, rung),
        None => left_out(at, query.views, ladder),
    };
}

fn by_size(query: &FrameQuery<'_>, problem: &Problem, objects: &[usize], threshold_px: f64) -> Selection {
    let level = |&at: &usize| {
        let polygons: Vec<_> = query.ladders.of(at).rungs.iter().map(|rung| rung.polygons as u32).collect();
        threshold::level(query.views[at].view.pixels, &polygons, threshold_px)
    };
    problem.judge(objects.iter().map(level).collect())
}

fn promise(query: &FrameQuery<'_>, selection: &Selection) -> Promise {
    Promise {
        budget_s: query.budget_s(),
        predicted_s: query.fixed_s + selection.cost as f64 / TICKS,
        value: selection.value as f64,
        upper: selection.upper,
        feasible: selection.feasible,
        holes: selection.levels.iter().filter(|level| level.is_none()).count() as u32,
    }
}

/// Gives every object its share of the time by value; an object that cannot pay for its cheapest form is not drawn (RH05, §1).
fn robin_hood(query: &FrameQuery<'_>, levels: &mut [LevelDemand]) -> Promise {
    let objects: Vec<_> = query.drawable().collect();
    let instance = |&at: &usize| {
        let rungs = &query.ladders.of(at).rungs;
        let forms: Vec<_> = rungs.iter().rev().map(|rung| rung.cost_s).collect();
        Instance { id: id(query, at), complexity: forms[0], value: value(query, at), forms }
    };
    let instances: Vec<_> = objects.iter().map(instance).collect();
    let budget_s = query.budget_s();
    let shares = distribute(budget_s, &instances, TooLittle::Nothing);
    let (mut value, mut holes) = (0.0, 0);
    for (&at, form) in objects.iter().zip(&shares.form) {
        let last = query.ladders.of(at).rungs.len() as u32 - 1;
        set(query, at, form.map(|form| last - form), levels);
        holes += u32::from(form.is_none());
        value +=
            form.map_or(0.0, |form| query.weight(at) * query.ladders.of(at).rungs[(last - form) as usize].accuracy);
    }
    let spent_s = budget_s.max(0.0) - shares.leftover;
    let least_s: f64 = objects.iter().map(|&at| query.ladders.of(at).rungs[0].cost_s).sum();
    let feasible = least_s <= budget_s.max(0.0);
    Promise { budget_s, predicted_s: query.fixed_s + spent_s, value, upper: 0.0, feasible, holes }
}

/// Value of an instance for Robin Hood: its surface is the area, its distance the depth.
fn value(query: &FrameQuery<'_>, at: usize) -> f64 {
    let view = &query.views[at].view;
    query.value.of(view.surface_m2(), view.distance_m, view.from_focus_m, view.importance)
}

/// A mesh of continuous resolution, from its least to one triangle per pixel.
fn mesh(query: &FrameQuery<'_>, at: usize) -> Mesh {
    let span = &query.views[at].span;
    let full_s = cost_s(query, at, span.full) - setup_s(query, at);
    let part = |polygons: f64| if span.full > 0.0 { polygons / span.full } else { 1.0 };
    Mesh { weight: query.weight(at), time: full_s, least: part(span.least), most: part(span.most) }.sound(full_s)
}

/// Seconds of an object with `polygons` triangles, on the line through the ends of its ladder.
fn cost_s(query: &FrameQuery<'_>, at: usize, polygons: f64) -> f64 {
    let rungs = &query.ladders.of(at).rungs;
    let (Some(first), Some(last)) = (rungs.first(), rungs.last()) else { return 0.0 };
    let rise = (last.cost_s - first.cost_s) / (last.polygons - first.polygons).max(1.0);
    first.cost_s + rise * (polygons - first.polygons)
}

/// The part of an object's time that is independent of its triangles.
fn setup_s(query: &FrameQuery<'_>, at: usize) -> f64 {
    cost_s(query, at, 0.0).max(0.0)
}

fn convex_promise(query: &FrameQuery<'_>, found: &Resolutions, spent_s: f64) -> Promise {
    Promise {
        budget_s: query.budget_s(),
        predicted_s: query.fixed_s + spent_s,
        value: found.value,
        upper: found.upper,
        feasible: found.feasible,
        holes: 0,
    }
}
