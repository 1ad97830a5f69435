//! Policies that draw every thing at one whole level: by size, or by benefit and cost.
//!
//! In: things in view. Out: levels. Never here: parts of a level, any state but a threshold.

use super::{Choice, Chooser, MARGIN, Pick, Time};
use crate::chart::policies::numeric::scene::{Scene, VisibleObject};
use metachron_lod::select::threshold;
use metachron_lod::select::threshold::Feedback;
use metachron_lod::select::{Entry, Mode, Problem, Selection, funkhouser, marginal};

/// Units of benefit per pixel: benefits are whole numbers.
const BENEFIT: f64 = 1000.0;

/// The knapsack of a frame: `budget` in microseconds, costs in nanoseconds.
pub(crate) fn problem(scene: &Scene, seen: &[VisibleObject], budget: f64) -> Problem {
    let mut problem = Problem::new(Mode::ExactlyOne, (1e3 * budget) as i64);
    for s in seen {
        let weight = BENEFIT * s.pixels * scene.objects[s.object].importance;
        let entries: Vec<_> = s.levels.iter().map(|(c, g)| Entry::measured(1e3 * c, weight * g, 0.0).0).collect();
        problem.push(s.object as u64, &entries);
    }
    problem
}

/// The benefit of a choice, in the unit of [`problem`].
pub(crate) fn benefit(scene: &Scene, seen: &[VisibleObject], picks: &[Pick]) -> f64 {
    let of = |(s, p): (&VisibleObject, &Pick)| {
        let object = &scene.objects[s.object];
        let gain = p.level.map_or(0.0, |l| object.forms[l as usize].gain(p.part, s.pixels));
        BENEFIT * s.pixels * object.importance * gain
    };
    seen.iter().zip(picks).map(of).sum()
}

/// The finest level of everything.
pub(super) struct Full;

impl Chooser for Full {
    fn choose(&mut self, _: u64, _: &Scene, seen: &[VisibleObject], time: Time) -> Choice {
        let finest = |s: &VisibleObject| Pick::whole((s.levels.len() as u32).checked_sub(1));
        let predicted = time.frame(Scene::full(seen));
        Choice { picks: seen.iter().map(finest).collect(), predicted, gap: f64::NAN }
    }
}

/// The finest level whose polygons cover so many pixels each.
pub(super) struct Static(pub(super) f64);

impl Chooser for Static {
    fn choose(&mut self, _: u64, scene: &Scene, seen: &[VisibleObject], _: Time) -> Choice {
        by_size(scene, seen, self.0)
    }
}

/// The same with a threshold that follows the time of the previous frame.
#[derive(Default)]
pub(super) struct Threshold(Feedback);

impl Chooser for Threshold {
    fn choose(&mut self, _: u64, scene: &Scene, seen: &[VisibleObject], _: Time) -> Choice {
        by_size(scene, seen, self.0.threshold_px())
    }

    fn learn(&mut self, _: u64, took: f64, time: Time) {
        self.0.observe(took, time.target);
    }
}

fn by_size(scene: &Scene, seen: &[VisibleObject], threshold_px: f64) -> Choice {
    let mut polygons = Vec::new();
    let mut level = |s: &VisibleObject| {
        polygons.clear();
        polygons.extend(scene.objects[s.object].forms.iter().map(|f| f.polygons as u32));
        Pick::whole(threshold::level(s.pixels, &polygons, threshold_px))
    };
    Choice { picks: seen.iter().map(&mut level).collect(), predicted: f64::NAN, gap: f64::NAN }
}

/// (FS93): whole levels in falling benefit per cost.
pub(super) struct Greedy;

impl Chooser for Greedy {
    fn choose(&mut self, _: u64, scene: &Scene, seen: &[VisibleObject], time: Time) -> Choice {
        let budget = time.drawing_within(MARGIN);
        choice_of(funkhouser::greedy(&problem(scene, seen, budget), funkhouser::Scan::Skip), time)
    }
}

/// Hull steps in falling gain per cost, then whatever still fits.
pub(super) struct Marginal;

impl Chooser for Marginal {
    fn choose(&mut self, _: u64, scene: &Scene, seen: &[VisibleObject], time: Time) -> Choice {
        let budget = time.drawing_within(MARGIN);
        choice_of(marginal::marginal(&problem(scene, seen, budget), marginal::Fit::Fill), time)
    }
}

fn choice_of(selection: Selection, time: Time) -> Choice {
    let gap = selection.gap();
    let predicted = time.frame(1e-3 * selection.cost as f64);
    Choice { picks: selection.levels.into_iter().map(Pick::whole).collect(), predicted, gap }
}
