//! The policies of the papers that choose for every object separately, applied to one frame.
//!
//! In: ladders, a time. Out: a rung for every object in view, and a promise. Never here: trees ([`super::hierarchy`]), policies that are
//! corrected by measured frames ([`super::adaptive`]). Theory: `docs/theory/budget.md`, sections 2, 3, 5 and 6.

use super::convex::Convex;
use super::robin_hood;
use super::vanish::STAY_FACTOR;
use crate::control::demand::plan::{LevelDemand, SizedView};
use crate::control::demand::policy::Policy;
use crate::control::demand::query::{FrameQuery, Promise, TICKS, demand, left_out};
use crate::control::prices::benefit;
use crate::control::prices::ladder::Rung;
use crate::select::funkhouser::Scan;
use crate::select::incremental::{Keep, incremental};
use crate::select::marginal::Fit;
use crate::select::threshold::STATIC_PX;
use crate::select::{Entry, Level, Mode, Problem, Selection, funkhouser, marginal, threshold};
use metachron_core::AgentId;
use std::collections::BTreeMap;

/// State of these policies from frame to frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct Select {
    threshold: threshold::Feedback,
    /// Rungs of the frame before, for the incremental choice.
    last: BTreeMap<AgentId, Level>,
    convex: Convex,
}

impl Select {
    /// Reports the time of a frame, for the threshold that follows it.
    pub fn observe(&mut self, work_s: f64, target_s: f64) {
        self.threshold.observe(work_s, target_s);
    }

    /// Chooses by `policy`; `levels` has one entry per object, of which the entries in view with rungs are set.
    pub fn choose(&mut self, policy: Policy, query: &FrameQuery<'_>, levels: &mut [LevelDemand]) -> Promise {
        match policy {
            Policy::RobinHood => robin_hood::choose(query, levels),
            Policy::Convex | Policy::ConvexBarrier => {
                self.convex.choose(policy == Policy::ConvexBarrier, query, levels)
            }
            _ => self.knapsack(policy, query, levels),
        }
    }

    /// Every object has one rung; the cheapest of all if even the cheapest do not fit.
    fn knapsack(&mut self, policy: Policy, query: &FrameQuery<'_>, levels: &mut [LevelDemand]) -> Promise {
        let mut problem = Problem::new(Mode::ExactlyOne, query.budget());
        let objects: Vec<_> = query.drawable().collect();
        for &at in &objects {
            problem.push(query.id(at), &self.entries(policy, query, at));
        }
        let selection = self.solve(policy, query, &problem, &objects);
        self.last.clear();
        let mut holes = 0;
        for (&at, level) in objects.iter().zip(&selection.levels) {
            self.last.insert(query.views[at].view.id, *level);
            let rung = if has_null(policy, query, at) { level.and_then(|level| level.checked_sub(1)) } else { *level };
            holes += u32::from(rung.is_none());
            set(query, at, rung, levels);
        }
        Promise { holes, ..promise(query, &selection) }
    }

    /// The rungs of an object as entries; before them "no polygons at all" where that is a level as any other (FS93, §3).
    fn entries(&self, policy: Policy, query: &FrameQuery<'_>, at: usize) -> Vec<Entry> {
        let (SizedView { view, .. }, rungs) = (&query.views[at], &query.ladders.of(at).rungs);
        let last = self.last.get(&view.id).copied();
        let null = has_null(policy, query, at).then(|| Entry::new(0, 0));
        let first = usize::from(null.is_some());
        let steps = (first + rungs.len()).max(2) as f64 - 1.0;
        let change = |level: usize| last.flatten().map_or(0.0, |last| (level as f64 - f64::from(last)).abs() / steps);
        let weight = query.weight(at);
        // what was drawn does not go out for a slight change of size
        let stays = if first > 0 && last.flatten() > Some(0) { STAY_FACTOR } else { 1.0 };
        let entry = |(level, rung): (usize, &Rung)| match policy.has_printed_benefit() {
            true => query.entry_of(rung, stays * benefit::printed(view, rung, change(first + level), query.sliders)),
            false => query.entry(weight, rung),
        };
        null.into_iter().chain(rungs.iter().enumerate().map(entry)).collect()
    }

    fn solve(&self, policy: Policy, query: &FrameQuery<'_>, problem: &Problem, objects: &[usize]) -> Selection {
        match policy {
            Policy::Static => by_size(query, problem, objects, STATIC_PX),
            Policy::Threshold => by_size(query, problem, objects, self.threshold.threshold_px()),
            Policy::GreedyIncremental => {
                let rungs =
                    |at: usize| query.ladders.of(at).rungs.len() as u32 + u32::from(has_null(policy, query, at));
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
}

/// Whether an object may be left out in favour of more detail of others, as printed. Other policies leave something out as the last resort alone
/// ([`super::vanish`]).
fn has_null(policy: Policy, query: &FrameQuery<'_>, at: usize) -> bool {
    policy.has_printed_benefit() && query.views[at].view.may_vanish
}

/// Draws an object at a rung, or leaves it out.
pub(crate) fn set(query: &FrameQuery<'_>, at: usize, level: Level, levels: &mut [LevelDemand]) {
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
        holes: 0,
        passes: 0,
    }
}
