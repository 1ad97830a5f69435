//! Benefit of each policy over the bound of the linear relaxation.

use crate::chart::policies::numeric::{LEVEL_PARTS, RandomSource, mean};
use crate::chart::{
    Axis, Colour, Experiment, Figure, Finding, Layer, Measured, Named, Table, claims, each, number_of, table,
};
use metachron_lod::adaptive::{Adaptive, Offer, Settings, Time};
use metachron_lod::select::{Entry, Mode, Problem, funkhouser, incremental, linear, marginal};
use serde::{Deserialize, Serialize};

/// The experiment.
pub(crate) struct Bound;

const OBJECTS: [usize; 4] = [10, 100, 1000, 10_000];
const INSTANCES: usize = 40;
const QUICK_INSTANCES: usize = 8;
/// An instance that is bad for greedy, budget 1000: {(1, 500), (510, 511)} and twice {(499, 499)} (`docs/theory/budget.md`, section 3).
const COUNTER_EXAMPLE: &str = "counter-example";

type Choose = fn(&Problem) -> u64;

const POLICIES: [Named<Choose>; 7] = [
    Named("greedy", |p| funkhouser::greedy(p, funkhouser::Scan::Skip).value),
    Named("greedy-repaired", |p| funkhouser::repaired(p).value),
    Named("greedy-incremental", |p| incremental::incremental(p, &[], incremental::Keep::Last).selection.value),
    Named("marginal-stop", |p| marginal::marginal(p, marginal::Fit::Stop).value),
    Named("marginal-fill", |p| marginal::marginal(p, marginal::Fit::Fill).value),
    Named("marginal-repaired", |p| marginal::repaired(p).value),
    Named("adaptive", ours),
];

/// Some problems and a policy.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Case {
    set: &'static str,
    objects: usize,
    instances: usize,
    policy: Named<Choose>,
}

/// Benefits of a policy over some problems.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Found {
    /// Benefit over the bound, the mean and the least.
    mean: f64,
    least: f64,
}

type Row = Measured<Case, Found>;

impl Experiment for Bound {
    type Row = Row;
    const NAME: &'static str = "bound";
    const TITLE: &'static str = "benefit over the bound of the linear relaxation, which no selection can exceed";
    const TABLE: fn(&[Row]) -> Table = table!(|r| set: r.case.set, objects: r.case.objects, policy: r.case.policy,
        mean(5): r.mean, least(5): r.least);

    fn cases(quick: bool) -> Vec<Case> {
        let instances = if quick { QUICK_INSTANCES } else { INSTANCES };
        let counts = if quick { &OBJECTS[..3] } else { &OBJECTS[..] };
        let sets = counts.iter().map(|&objects| ("random", objects, instances)).chain([(COUNTER_EXAMPLE, 3, 1)]);
        each!((set, objects, instances) in sets, policy in POLICIES => Case { set, objects, instances, policy })
    }

    fn measure(case: &Case) -> Option<Found> {
        let part = |k: usize| {
            let problem = if case.set == COUNTER_EXAMPLE { counter_example() } else { random(case.objects, k) };
            linear(&problem).map_or(f64::NAN, |bound| case.policy.1(&problem) as f64 / bound.value)
        };
        let parts: Vec<f64> = (0..case.instances).map(part).collect();
        Some(Found { mean: mean(&parts), least: parts.iter().copied().fold(f64::INFINITY, f64::min) })
    }

    fn figure(rows: &[Row]) -> Figure {
        let line = |(Named(name, _), colour): (Named<Choose>, Colour)| {
            let here = rows.iter().filter(|r| r.case.set == "random" && r.case.policy.0 == name);
            Layer::line(name, colour, here.map(|r| (r.case.objects as f64, (1.0 - r.mean).max(1e-7))))
        };
        let layers = POLICIES.into_iter().zip(Colour::LINES.into_iter().chain([Colour::Grey])).map(line);
        let (x, y) = (Axis::log("objects", 8.0, 12_000.0), Axis::log("1 − benefit / bound, mean", 1e-7, 1.0));
        Figure::single("Greatest possible loss of a selection", x, y, layers)
    }

    fn findings(rows: &[Row]) -> Vec<Finding> {
        let of = |set: &str, objects: usize, policy: &str, what: fn(&Row) -> f64| {
            number_of(rows, |r| (r.case.set, r.case.objects, r.case.policy.0) == (set, objects, policy), what)
        };
        claims![
            "adaptive, 100 objects: least benefit over the bound" => of("random", 100, "adaptive", |r| r.least), at_least 0.99;
            "adaptive, 1000 objects: least benefit over the bound" => of("random", 1000, "adaptive", |r| r.least), at_least 0.99;
            "greedy on the counter-example: benefit falls below half of the optimum" =>
                of(COUNTER_EXAMPLE, 3, "greedy", |r| r.mean), at_most 0.5;
        ]
    }
}

/// Objects of five levels, polygons log-normal over two decades, accuracy as of flat shading; the budget is a third of the full cost.
fn random(objects: usize, seed: usize) -> Problem {
    let mut noise = RandomSource::new(1 + seed as u64);
    let of = |_| {
        let polygons = 300.0 * libm::exp(noise.normal());
        let pixels = 1000.0 * libm::exp(noise.normal());
        LEVEL_PARTS.map(|part| {
            let drawn = (part * polygons).max(2.0);
            Entry::new((2000.0 + 1350.0 * drawn) as u64, (1e4 * pixels * (1.0 - 0.5 / drawn)) as u64)
        })
    };
    let menus: Vec<[Entry; 5]> = (0..objects).map(of).collect();
    let all: u64 = menus.iter().map(|m| m[4].cost).sum();
    let mut problem = Problem::new(Mode::ExactlyOne, (all / 3) as i64);
    (0..).zip(&menus).for_each(|(id, menu)| problem.push(id, menu));
    problem
}

fn counter_example() -> Problem {
    let mut problem = Problem::new(Mode::AtMostOne, 1000);
    problem.push(0, &[Entry::new(1, 500), Entry::new(510, 511)]);
    problem.push(1, &[Entry::new(499, 499)]);
    problem.push(2, &[Entry::new(499, 499)]);
    problem
}

/// Benefit of the default policy on a problem, without a margin for prediction errors; zero where it exceeds the budget.
fn ours(problem: &Problem) -> u64 {
    let mut adaptive = Adaptive::new(Settings { margin: 0.0, late: 1.0, ..Settings::default() });
    let droppable = problem.mode() == Mode::AtMostOne;
    for object in 0..problem.len() {
        let offer = |e: &Entry| Offer { cost: e.cost as f64, gain: e.benefit as f64 };
        let offers: Vec<_> = problem.levels(object).iter().map(offer).collect();
        adaptive.set(object as u64, 0, droppable, &offers);
    }
    adaptive.choose(0, Time { target: problem.budget() as f64, fixed: 0.0, reserved: 0.0 });
    let levels: Vec<_> = (0..problem.len()).map(|i| adaptive.level(i as u64)).collect();
    if problem.cost(&levels) > problem.budget() { 0 } else { problem.value(&levels) }
}
