//! Policies that divide time among things: Robin Hood by value, the convex form by the benefit of more detail.
//!
//! In: things in view. Out: levels, or parts of the finest. Never here: learning.

use super::{Choice, Chooser, MARGIN, Pick, Time};
use crate::chart::policies::numeric::scene::{Scene, VisibleObject};
use metachron_lod::cost::overlap::Overlap;
use metachron_lod::cost::value::Value;
use metachron_lod::select::gobbetti::{Mesh, closed_form};
use metachron_lod::select::robin_hood::{Distribution, Instance, TooLittle, distribute};

/// (RH05) with one of its value functions, the printed share of logic, and the cheapest form drawn in part where time is short.
pub(super) struct RobinHood(pub(super) Value);

/// C of (RH05, eq. 7): a balanced frame takes 0.953 of both times.
const PRINTED_C: f64 = 1.0;

impl Chooser for RobinHood {
    fn choose(&mut self, _: u64, scene: &Scene, seen: &[VisibleObject], time: Time) -> Choice {
        let instances: Vec<_> = seen.iter().map(|s| instance(self.0, scene, s)).collect();
        let drawing = Overlap::Printed(PRINTED_C).drawing(time.target, time.logic);
        let shared = distribute(drawing, &instances);
        // `distribute` takes forms best first; levels are ordered best last
        let pick = |(i, s): (usize, &VisibleObject)| match shared.form[i] {
            Some(form) => part_of(&shared, i, s.levels.len() as u32 - 1 - form, scene, s),
            None => Pick::whole(None),
        };
        let picks = seen.iter().enumerate().map(pick).collect();
        Choice { picks, predicted: time.target, gap: f64::NAN }
    }
}

fn instance(value: Value, scene: &Scene, s: &VisibleObject) -> Instance {
    let object = &scene.objects[s.object];
    let area = std::f64::consts::PI * object.radius_m * object.radius_m * object.fill;
    Instance {
        id: s.object as u64,
        complexity: object.complexity,
        value: value.of(area, s.depth_m.max(object.radius_m), s.distance_m, object.importance),
        forms: s.levels.iter().rev().map(|(cost, _)| *cost).collect(),
        too_little: TooLittle::Part,
    }
}

/// Draws as many polygons as the form's share of time pays for, after its setup, which is paid whole.
fn part_of(shared: &Distribution, i: usize, level: u32, scene: &Scene, s: &VisibleObject) -> Pick {
    let form = &scene.objects[s.object].forms[level as usize];
    let (whole, setup) = (s.levels[level as usize].0, scene.cost(form, 0.0, 0.0));
    let paid = shared.part[i] * whole - setup;
    match (shared.part[i] < 1.0, paid > 0.0) {
        (false, _) => Pick::whole(Some(level)),
        (true, false) => Pick::whole(None),
        (true, true) => Pick { level: Some(level), part: paid / (whole - setup) },
    }
}

/// (GB99): every mesh at any part of its triangles, by the closed form.
pub(super) struct Convex;

/// The fewest triangles of a mesh, as a part of all.
const LEAST: f64 = 0.002;

impl Chooser for Convex {
    fn choose(&mut self, _: u64, scene: &Scene, seen: &[VisibleObject], time: Time) -> Choice {
        let mut fixed = 0.0;
        let meshes: Vec<_> = seen
            .iter()
            .map(|s| {
                let object = &scene.objects[s.object];
                let Some(form) = object.forms.last() else {
                    return Mesh { weight: 0.0, time: 0.0, least: 0.0, most: 0.0 };
                };
                let stages = scene.stages[form.algorithm];
                fixed += stages.setup;
                let triangles = scene.cost(form, 1.0, 0.0) - stages.setup;
                // below the number of triangles that take as long as the pixels, fewer triangles save no time (GB99, §3)
                let least = (stages.pixel * s.pixels / triangles).clamp(LEAST, 1.0);
                Mesh { weight: s.pixels * object.importance, time: triangles, least, most: 1.0 }
            })
            .collect();
        let budget = time.drawing_within(MARGIN);
        let found = closed_form(budget, fixed, &meshes);
        let pick = |(s, r): (&VisibleObject, &f64)| Pick { level: (s.levels.len() as u32).checked_sub(1), part: *r };
        let drawn: f64 = meshes.iter().zip(&found.r).map(|(m, r)| m.time * r).sum();
        let gap = if found.upper > 0.0 { (1.0 - found.value / found.upper).max(0.0) } else { 0.0 };
        Choice { picks: seen.iter().zip(&found.r).map(pick).collect(), predicted: time.frame(fixed + drawn), gap }
    }
}
