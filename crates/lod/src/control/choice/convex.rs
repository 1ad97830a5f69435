//! Any number of triangles for every object (GB99), kept from frame to frame where it changes little.
//!
//! In: the objects in view, a time. Out: a number of triangles for each, and a promise. Never here: the optimum itself
//! ([`crate::select::gobbetti`], [`crate::select::barrier`]). Theory: `docs/theory/budget.md`, section 5.

use crate::control::demand::level::{Cut, LastCut};
use crate::control::demand::plan::{LevelDemand, SizedView};
use crate::control::demand::query::{FrameQuery, Promise};
use crate::select::barrier::{Limits, interior_point};
use crate::select::gobbetti::{Mesh, Resolutions, closed_form};
use metachron_core::AgentId;
use std::collections::BTreeMap;

/// Time of a Newton step of the interior point per mesh, seconds.
const NEWTON_S: f64 = 60e-9;

/// State from frame to frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct Convex {
    /// Resolutions of the frame before.
    last_r: BTreeMap<AgentId, f64>,
}

impl Convex {
    /// Chooses for every object in view, by the interior point or in closed form; objects with few levels are rounded down to one of them.
    pub fn choose(&mut self, by_barrier: bool, query: &FrameQuery<'_>, levels: &mut [LevelDemand]) -> Promise {
        let objects: Vec<_> = query.drawable().collect();
        let meshes: Vec<_> = objects.iter().map(|&at| mesh(query, at)).collect();
        let fixed_s: f64 = objects.iter().map(|&at| fixed_s(query, at)).sum();
        let budget_s = query.budget_s();
        let last: Vec<_> = objects.iter().map(|&at| self.last_r.get(&query.views[at].view.id).copied()).collect();
        let found = if by_barrier {
            // a warm start needs all objects: a single new one has no resolution to start from
            let start: Option<Vec<_>> = last.iter().copied().collect();
            interior_point(budget_s, fixed_s, &meshes, &start.unwrap_or_default(), limits(query, objects.len()))
        } else {
            closed_form(budget_s, fixed_s, &meshes)
        };
        let kept = kept(&last, &found.r, &meshes, budget_s - fixed_s, query.sliders.hysteresis);
        self.last_r.clear();
        let mut spent_s = 0.0;
        for (&at, r) in objects.iter().zip(kept) {
            let SizedView { view, span } = &query.views[at];
            self.last_r.insert(view.id, r);
            let Cut { resolution, polygons } = LastCut::default().choose(view, *span, r * span.full);
            levels[at] = LevelDemand { id: view.id, resolution, polygons, shading: view.shading.1 };
            spent_s += query.ladders.of(at).line.at(polygons);
        }
        promise(query, &found, spent_s)
    }
}

/// The resolutions to draw with: a mesh keeps that of the frame before where the new one differs by no more than this part, as long as all
/// fit the time, for the optimum moves with everything in view; where they do not fit, the kept ones that take most more time than the new ones give way.
fn kept(last: &[Option<f64>], found: &[f64], meshes: &[Mesh], time_s: f64, hysteresis: f64) -> Vec<f64> {
    let near = |(last, r): (&Option<f64>, &f64)| last.filter(|last| (r / last - 1.0).abs() <= hysteresis);
    let mut kept: Vec<Option<f64>> = last.iter().zip(found).map(near).collect();
    let more_s = |at: usize, kept: &[Option<f64>]| kept[at].map_or(0.0, |r| meshes[at].time * (r - found[at]));
    let mut order: Vec<usize> = (0..kept.len()).filter(|&at| more_s(at, &kept) > 0.0).collect();
    order.sort_by(|&a, &b| more_s(b, &kept).total_cmp(&more_s(a, &kept)));
    let mut all_s: f64 = (0..kept.len()).map(|at| meshes[at].time * kept[at].unwrap_or(found[at])).sum();
    for at in order {
        if all_s <= time_s {
            break;
        }
        all_s -= more_s(at, &kept);
        kept[at] = None;
    }
    kept.into_iter().zip(found).map(|(kept, r)| kept.unwrap_or(*r)).collect()
}

/// The optimiser's time limit as a number of steps, each linear in the number of meshes.
fn limits(query: &FrameQuery<'_>, meshes: usize) -> Limits {
    let usual = Limits::default();
    let step_s = NEWTON_S * meshes.max(1) as f64;
    // a cast of floats saturates
    let steps = query.choose_s.map_or(usual.steps, |choose_s| ((choose_s / step_s) as u32).clamp(1, usual.steps));
    Limits { steps, ..usual }
}

/// A mesh of continuous resolution: from its least, or the number of triangles below which fewer save no time, to one triangle per pixel.
fn mesh(query: &FrameQuery<'_>, at: usize) -> Mesh {
    let SizedView { span, .. } = &query.views[at];
    let line = query.ladders.of(at).line;
    let part = |polygons: f64| if span.full > 0.0 { polygons / span.full } else { 1.0 };
    let time = line.polygon_s * span.full;
    let most = span.most.max(line.from.min(span.full));
    Mesh { weight: query.weight(at), time, least: part(line.from), most: part(most) }.sound(time)
}

/// The part of an object's time that is independent of its triangles above the least.
fn fixed_s(query: &FrameQuery<'_>, at: usize) -> f64 {
    let line = query.ladders.of(at).line;
    line.from_s - line.polygon_s * line.from
}

fn promise(query: &FrameQuery<'_>, found: &Resolutions, spent_s: f64) -> Promise {
    Promise {
        budget_s: query.budget_s(),
        predicted_s: query.fixed_s + spent_s,
        value: found.value,
        upper: found.upper,
        feasible: found.feasible,
        ..Promise::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn meshes(count: usize) -> Vec<Mesh> {
        let mesh = |i: usize| Mesh { weight: 1.0, time: 1e-3 * (1 + i) as f64, least: 0.01, most: 1.0 };
        (0..count).map(mesh).collect()
    }

    #[test]
    fn resolutions_that_tremble_stay_and_those_that_move_follow() {
        let (meshes, found) = (meshes(3), [0.5, 0.5, 0.3]);
        let last = [Some(0.51), Some(0.4), None];
        assert_eq!(kept(&last, &found, &meshes, 1.0, 0.05), [0.51, 0.5, 0.3]);
    }

    #[test]
    fn what_is_kept_never_takes_more_than_the_time() {
        let (meshes, found) = (meshes(4), [0.5; 4]);
        let new_s: f64 = meshes.iter().map(|mesh| 0.5 * mesh.time).sum();
        // all were finer: without room everything gives way, with room for the smaller ones the largest alone does
        let last = [Some(0.52); 4];
        assert_eq!(kept(&last, &found, &meshes, new_s, 0.05), [0.5; 4]);
        assert_eq!(kept(&last, &found, &meshes, new_s + 0.02 * 6.1e-3, 0.05), [0.52, 0.52, 0.52, 0.5]);
        // meshes that were coarser leave room for meshes that were finer
        let mixed = [Some(0.52), Some(0.48), Some(0.52), Some(0.48)];
        assert_eq!(kept(&mixed, &found, &meshes, new_s, 0.05), [0.52, 0.48, 0.52, 0.48]);
    }
}
