//! Wall time of a choice, from 100 objects to 100,000: the only experiment here that reads a clock.

use crate::chart::policies::numeric::LEVEL_PARTS;
use crate::chart::{Axis, Experiment, Figure, Finding, Layer, Measured, Named, Table, each, lines, median, table};
use metachron_lod::adaptive::{Adaptive, Offer, Settings, Time};
use metachron_lod::select::tree::{Node, Tree};
use metachron_lod::select::{Entry, Level, Mode, Problem, funkhouser, incremental, marginal, mason, mason_flat};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// The experiment.
pub struct Selection;

const OBJECTS: [usize; 7] = [100, 300, 1000, 3000, 10_000, 30_000, 100_000];
const QUICK_OBJECTS: [usize; 2] = [100, 1000];
/// Choices that are timed, one per frame with new weights.
const FRAMES: usize = 51;
/// A frame at 60 Hz, and the greatest share of it for choosing among 10,000 objects.
const FRAME_MS: f64 = 1e3 / 60.0;
const SHARE: f64 = 0.01;
const GOAL_OBJECTS: usize = 10_000;

type Time1 = fn(usize) -> Vec<f64>;

const POLICIES: [Named<Time1>; 6] = [
    Named("greedy", |n| papers(n, |p, _| funkhouser::greedy(p, funkhouser::Scan::Skip).levels)),
    Named("greedy-incremental", |n| {
        papers(n, |p, last| incremental::incremental(p, last, incremental::Keep::Last).selection.levels)
    }),
    Named("hierarchical", |n| {
        trees(n, |tree, last| mason::incremental(tree, last, incremental::Keep::Last).cut.levels)
    }),
    Named("hierarchical-flat", |n| trees(n, |tree, _| mason_flat::flat(tree).levels)),
    Named("marginal-stop", |n| papers(n, |p, _| marginal::marginal(p, marginal::Fit::Stop).levels)),
    Named("adaptive", ours),
];

/// A number of objects, and a policy.
#[derive(Debug, Clone, Serialize)]
pub struct Case {
    objects: usize,
    policy: Named<Time1>,
}

/// Wall time of a choice.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Found {
    median_ms: f64,
    least_ms: f64,
}

type Row = Measured<Case, Found>;

impl Experiment for Selection {
    type Row = Row;
    const NAME: &'static str = "selection";
    const TITLE: &'static str = "wall time of one selection, five levels per object, new weights in every frame";
    const ALONE: bool = true;
    const TABLE: fn(&[Row]) -> Table = table!(|r| objects: r.case.objects, policy: r.case.policy,
        median_ms(4): r.median_ms, least_ms(4): r.least_ms, share_of_60_hz(4): 0.06 * r.least_ms);

    fn cases(quick: bool) -> Vec<Case> {
        let counts = if quick { &QUICK_OBJECTS[..] } else { &OBJECTS[..] };
        each!(&objects in counts, policy in POLICIES => Case { objects, policy })
    }

    fn measure(case: &Case) -> Option<Found> {
        let times = case.policy.1(case.objects);
        let least_ms = times.iter().copied().fold(f64::INFINITY, f64::min);
        Some(Found { median_ms: median(times), least_ms })
    }

    fn figure(rows: &[Row]) -> Figure {
        let points = |name| {
            let here = rows.iter().filter(move |r| r.case.policy.0 == name);
            here.map(|r| (r.case.objects as f64, r.least_ms))
        };
        let layers = lines(POLICIES.map(|policy| policy.0), points);
        let layers = layers.chain([Layer::limit("1 % of 1/60 s", [100.0, 1e5], SHARE * FRAME_MS)]);
        let (x, y) = (Axis::log("objects", 100.0, 1e5), Axis::log("least selection time, ms", 1e-3, 1e3));
        Figure::single("Selection time", x, y, layers)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let goal = rows.iter().find(|r| r.case.objects == GOAL_OBJECTS && r.case.policy.0 == "adaptive");
        let claim = "adaptive, 10,000 objects: least time over 1/60 s";
        goal.map(|r| Finding::at_most(claim, r.least_ms / FRAME_MS, SHARE)).into_iter().collect()
    }
}

/// Cost in ticks and gain of an object's level.
fn level(id: usize, part: f64) -> (f64, f64) {
    let polygons = part * (100.0 + (id * 7919 % 900) as f64);
    (20.0 + 13.5 * polygons, 1.0 - 0.5 / polygons.max(2.0))
}

/// Half of the cost of all objects at their finest level, ticks.
fn target(objects: usize) -> f64 {
    objects as f64 * 0.5 * 13.5 * 550.0
}

fn weight(id: usize, frame: usize) -> f64 {
    1.0 + ((id * 31 + frame * 7) % 997) as f64
}

fn timed<T>(choose: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let chosen = choose();
    (chosen, start.elapsed().as_secs_f64() * 1e3)
}

fn ours(objects: usize) -> Vec<f64> {
    let mut adaptive = Adaptive::new(Settings::default());
    for id in 0..objects {
        let offers = LEVEL_PARTS.map(|part| level(id, part)).map(|(cost, gain)| Offer { cost, gain });
        adaptive.set(id as u64, 0, false, &offers);
    }
    let one = |frame: usize| {
        (0..objects).for_each(|id| _ = adaptive.weigh(id as u64, weight(id, frame)));
        let (plan, took) =
            timed(|| adaptive.choose(frame as u64, Time { target: target(objects), fixed: 0.0, reserved: 0.0 }));
        adaptive.observe(frame as u64, 0, plan.predicted);
        took
    };
    (0..FRAMES).map(one).collect()
}

/// An object's levels as the papers' algorithms have them.
fn entries(id: usize, frame: usize) -> [Entry; LEVEL_PARTS.len()] {
    let levels = LEVEL_PARTS.map(|part| level(id, part));
    levels.map(|(cost, gain)| Entry::new(cost as u64, (1e6 * gain * weight(id, frame)) as u64))
}

fn papers(objects: usize, choose: fn(&Problem, &[Level]) -> Vec<Level>) -> Vec<f64> {
    let mut last = Vec::new();
    let one = |frame: usize| {
        let mut problem = Problem::new(Mode::ExactlyOne, target(objects) as i64);
        for id in 0..objects {
            problem.push(id as u64, &entries(id, frame));
        }
        let (levels, took) = timed(|| choose(&problem, &last));
        last = levels;
        took
    };
    // the papers' algorithms take longer, and fewer frames suffice
    (0..FRAMES / 5).map(one).collect()
}

/// Objects of a group, which has one impostor: twice an object's coarsest level, worth half of what all are in theirs (MB97, §8).
const GROUP: usize = 25;

/// The same objects in groups, all of them in one without an impostor.
fn trees(objects: usize, choose: fn(&Tree, &[Level]) -> Vec<Level>) -> Vec<f64> {
    let mut last = Vec::new();
    let one = |frame: usize| {
        let groups = objects.div_ceil(GROUP);
        let group = |g: usize| {
            let members = (g * GROUP..objects.min((g + 1) * GROUP)).map(|id| entries(id, frame)[0]);
            let (cost, benefit) = members.fold((0, 0), |(cost, sum), e| (e.cost.max(cost), sum + e.benefit));
            Node { parent: Some(0), impostors: vec![Entry::new(2 * cost, benefit / 2)] }
        };
        let leaf = |id: usize| Node { parent: Some(1 + id / GROUP), impostors: entries(id, frame).to_vec() };
        let root = Node { parent: None, impostors: Vec::new() };
        let nodes: Vec<Node> =
            std::iter::once(root).chain((0..groups).map(group)).chain((0..objects).map(leaf)).collect();
        let Ok(tree) = Tree::new(target(objects) as i64, &nodes) else { return f64::NAN };
        let (levels, took) = timed(|| choose(&tree, &last));
        last = levels;
        took
    };
    (0..FRAMES / 5).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_policy_has_a_time_for_every_number_of_objects() {
        let rows: Vec<Row> = Selection::cases(true).iter().map(Selection::row).collect();
        assert_eq!(rows.len(), QUICK_OBJECTS.len() * POLICIES.len());
        let timed = |row: &Row| row.found.least_ms > 0.0 && row.found.least_ms <= row.found.median_ms;
        assert!(rows.iter().all(timed), "{rows:?}");
    }
}
