//! Robin Hood (RH05) applied to one frame: every object gets its share of the time by value.
//!
//! In: the objects in view, a time. Out: a rung, or a part of the cheapest, for each, and a promise. Never here: the distribution itself
//! ([`crate::select::robin_hood`]). Theory: `docs/theory/budget.md`, section 6.
//!
//! The time for which an object is set up is spent before anything is shared, as the paper counts it with the logic (RH05, §4.2): a share
//! pays for triangles alone. An object that can be drawn in any number of triangles gets as many as its share pays for, one at least, where
//! it does not pay for the cheapest form (RH05, §7.1); any other is left out (RH05, §1).

use crate::control::demand::plan::LevelDemand;
use crate::control::demand::query::{FrameQuery, Promise, demand, left_out};
use crate::control::demand::view::Kind;
use crate::control::prices::ladder::{Ladder, Rung};
use crate::select::robin_hood::{Instance, TooLittle, distribute};

/// The level of an object that is drawn.
#[derive(Debug, Clone, Copy)]
struct Share {
    /// Number of its rung.
    rung: usize,
    /// Triangles: as many as the rung has, or fewer.
    polygons: f64,
    /// Seconds that they take after the setup.
    taken_s: f64,
}

/// Chooses for every object in view.
pub(crate) fn choose(query: &FrameQuery<'_>, levels: &mut [LevelDemand]) -> Promise {
    let objects: Vec<_> = query.drawable().collect();
    let setups_s: f64 = objects.iter().map(|&at| setup_s(query, at)).sum();
    let of = |&at: &usize| {
        let ladder = query.ladders.of(at);
        let too_little = match query.views[at].view.kind {
            Kind::Counted { .. } => TooLittle::Part,
            _ => TooLittle::Nothing,
        };
        let forms = ladder.rungs[..ladder.asked].iter().rev().map(|rung| paid_s(query, at, rung));
        Instance { too_little, ..instance(query, at, forms.collect()) }
    };
    let found = distribute(query.budget_s() - setups_s, &objects.iter().map(of).collect::<Vec<_>>());
    let taken = |(k, &at): (usize, &usize)| {
        let ladder = query.ladders.of(at);
        let rung = ladder.asked - 1 - found.form[k]? as usize;
        let all = ladder.rungs[rung].polygons;
        let polygons = if found.part[k] < 1.0 { libm::floor(found.part[k] * all).max(1.0) } else { all };
        Some(Share { rung, polygons, taken_s: paid_s(query, at, &ladder.rungs[rung]) * polygons / all })
    };
    let mut shares: Vec<Option<Share>> = objects.iter().enumerate().map(taken).collect();
    if query.spend_rest {
        // levels that are asked for come before better ones
        let left_s = spend_rest(query, &objects, found.leftover, &mut shares, |ladder| ladder.asked);
        spend_rest(query, &objects, left_s, &mut shares, |ladder| ladder.rungs.len());
    }
    let mut promise = Promise { budget_s: query.budget_s(), predicted_s: query.fixed_s, ..Promise::default() };
    for (&at, share) in objects.iter().zip(&shares) {
        let ladder = query.ladders.of(at);
        let Some(Share { rung, polygons, taken_s }) = *share else {
            promise.holes += 1;
            levels[at] = left_out(at, query.views, ladder);
            continue;
        };
        let rung = &ladder.rungs[rung];
        levels[at] = LevelDemand { polygons, ..demand(at, query.views, rung) };
        promise.predicted_s += setup_s(query, at) + taken_s;
        promise.value += query.weight(at) * rung.accuracy * polygons / rung.polygons;
    }
    let least_s: f64 = objects.iter().map(|&at| query.ladders.of(at).rungs[0].cost_s).sum();
    promise.feasible = least_s <= promise.budget_s.max(0.0);
    promise
}

/// Shares the time left by the same rule once more, among objects that have better forms than those taken, in their
/// first `rungs`: time that the last objects visited do not need comes too late for the others (RH05, §7.2). Returns
/// the time left then.
fn spend_rest(
    query: &FrameQuery<'_>,
    objects: &[usize],
    left_s: f64,
    shares: &mut [Option<Share>],
    rungs: fn(&Ladder) -> usize,
) -> f64 {
    let of = |(&at, share): (&usize, &Option<Share>)| {
        let taken_s = share.map_or(0.0, |share| share.taken_s);
        let ladder = query.ladders.of(at);
        // a form that is no better is none: its time is not a number
        let more_s = |rung: &Rung| Some(paid_s(query, at, rung) - taken_s).filter(|s| *s > 0.0).unwrap_or(f64::NAN);
        let all = instance(query, at, ladder.rungs[..rungs(ladder)].iter().rev().map(more_s).collect());
        let value = if all.forms.iter().any(|s| s.is_finite()) { all.value } else { 0.0 };
        Instance { value, ..all }
    };
    let found = distribute(left_s, &objects.iter().zip(&*shares).map(of).collect::<Vec<_>>());
    for ((&at, share), form) in objects.iter().zip(shares).zip(found.form) {
        let ladder = query.ladders.of(at);
        if let Some(form) = form {
            let rung = rungs(ladder) - 1 - form as usize;
            let Rung { polygons, .. } = ladder.rungs[rung];
            *share = Some(Share { rung, polygons, taken_s: paid_s(query, at, &ladder.rungs[rung]) });
        }
    }
    found.leftover
}

/// An object as an instance: its surface is the area, its distance the depth.
fn instance(query: &FrameQuery<'_>, at: usize, forms: Vec<f64>) -> Instance {
    let view = &query.views[at].view;
    Instance {
        id: query.id(at),
        complexity: query.ladders.of(at).complexity_s,
        value: query.value.of(view.surface_m2(), view.depth_m, view.distance_m, view.importance),
        forms,
        too_little: TooLittle::Nothing,
    }
}

/// Seconds of an object before its first triangle.
fn setup_s(query: &FrameQuery<'_>, at: usize) -> f64 {
    let ladder = query.ladders.of(at);
    ladder.line.setup_s.min(ladder.rungs[0].cost_s)
}

/// Seconds of a rung that a share has to pay.
fn paid_s(query: &FrameQuery<'_>, at: usize, rung: &Rung) -> f64 {
    (rung.cost_s - setup_s(query, at)).max(0.0)
}
