//! How long a step may be beside others of whom nobody can foresee how they move within it.
//!
//! In: a step that is wanted, and who is near. Out: that step, or an equal part of it; who may be touched in it; whether somebody
//! has to be waited for. Never here: the step itself. Theory: docs/theory/coupling.md, eq. 7g.

use super::Law;
use crate::instrument::GRASP_BELOW;
use crate::{AgentId, Body, Bounds, Neighbour, SimSpan, Surroundings};

/// Beside others a body that bends makes no longer substeps than this, seconds: in a longer one it falls so far from where it
/// began that its places of contact are no longer there (measured: 20 mm deep at 0.1 s, 0.01 mm at 1/60 s).
pub const PART_MAX_S: f64 = 1.0 / 60.0;
/// A step longer than [`PART_MAX_S`] by less than this is not divided.
const SPLIT_SLACK: f64 = 1.01;
/// No step is made shorter than this because of somebody fast, seconds.
const HURRY_S: f64 = 1e-3;
/// Who owns contact may be this far behind, seconds: as long as a system lets a thread wait now and then, and as short as a fall
/// from rest makes 2 mm in.
const AHEAD_S: f64 = 0.02;
/// A body may come faster by this than it was seen, m/s²: three times gravity.
const SURPRISE_M_S2: f64 = 30.0;

/// Into how many parts a step of `dt_s` seconds falls.
#[must_use]
pub fn parts(dt_s: f64) -> u32 {
    (dt_s / (PART_MAX_S * SPLIT_SLACK)).ceil().max(1.0) as u32
}

/// One of these parts where any neighbour that may be touched in a step of `dt` is `wild`, else all of it. `bounds` are those of the
/// body that looks; what decides is the step that is wanted and not the one that is made, so that the rule stays on.
pub fn longest_step(
    dt: SimSpan,
    around: &Surroundings<'_>,
    bounds: impl FnOnce() -> Bounds,
    wild: impl Fn(&Neighbour) -> bool,
) -> SimSpan {
    let dt_s = dt.as_secs_f64();
    let parts = parts(dt_s);
    if parts == 1 || around.neighbours.is_empty() {
        return dt;
    }
    let bounds = bounds();
    let near = |n: &Neighbour| wild(n) && (is_linked(n, around) || may_touch(n, around, &bounds, dt_s));
    if around.neighbours.iter().any(near) { SimSpan::from_nanos(dt.as_nanos() / u64::from(parts)) } else { dt }
}

/// A part of a step of `dt` that is no longer than `most_s` tells of any neighbour that may be touched in it; a millisecond at least.
/// Who is held up, or makes up for it, does not count: the two are not at one time.
pub fn no_longer(
    dt: SimSpan,
    around: &Surroundings<'_>,
    bounds: impl FnOnce() -> Bounds,
    most_s: impl Fn(&Neighbour) -> Option<f64>,
) -> SimSpan {
    let dt_s = dt.as_secs_f64();
    let apart = |n: &Neighbour| around.time.secs_after(n.snapshot.time).abs() > AHEAD_S + n.step_s;
    let shorter = |n: &Neighbour| most_s(n).map(|s| s.max(HURRY_S)).filter(|s| *s < dt_s && !apart(n));
    if around.neighbours.iter().all(|n| shorter(n).is_none()) {
        return dt;
    }
    let bounds = bounds();
    let near = around.neighbours.iter().filter(|n| may_touch(n, around, &bounds, dt_s));
    let least_s = near.filter_map(shorter).fold(dt_s, f64::min);
    SimSpan::from_nanos(dt.as_nanos() / (dt_s / (least_s * SPLIT_SLACK)).ceil() as u64)
}

/// A part of a step of `dt` in which nobody whose pair the body owns and whom it may touch comes farther than `way_m`; a millisecond
/// at least.
pub fn unhurried(dt: SimSpan, around: &Surroundings<'_>, bounds: impl FnOnce() -> Bounds, way_m: f64) -> SimSpan {
    let dt_s = dt.as_secs_f64();
    let fast = |n: &&Neighbour| n.owned && n.snapshot.bounds.is_some_and(|b| b.speed_m_s * dt_s > way_m);
    if !around.neighbours.iter().any(|n| fast(&n)) {
        return dt;
    }
    let bounds = bounds();
    let near = around.neighbours.iter().filter(fast).filter(|n| may_touch(n, around, &bounds, dt_s));
    let speed_m_s = near.filter_map(|n| n.snapshot.bounds).map(|b| b.speed_m_s).fold(0.0, f64::max);
    let parts = (dt_s * speed_m_s / way_m).ceil().min((dt_s / HURRY_S).floor()).max(1.0);
    SimSpan::from_nanos(dt.as_nanos() / parts as u64)
}

/// Whether somebody who owns contact with the body, and whom it may touch in a step of `dt`, stands so far behind its time that it
/// would go through them before they know: by 20 ms and one of their steps. `bounds` are those of the body, if anything can push it.
pub fn leaves_behind(dt: SimSpan, around: &Surroundings<'_>, bounds: impl FnOnce() -> Option<Bounds>) -> bool {
    let behind = |n: &Neighbour| around.time.secs_after(n.snapshot.time) > AHEAD_S + n.step_s;
    let mut owners = around.neighbours.iter().filter(|n| !n.owned && !n.snapshot.at_rest && behind(n)).peekable();
    if owners.peek().is_none() {
        return false;
    }
    bounds().is_some_and(|bounds| owners.any(|n| may_touch(n, around, &bounds, dt.as_secs_f64())))
}

/// Whether a link by the ledger joins a neighbour to this body.
#[must_use]
pub fn is_linked(neighbour: &Neighbour, around: &Surroundings<'_>) -> bool {
    around.links.iter().any(|link| link.other == neighbour.id && link.law == Law::Ledger)
}

/// Whether a neighbour bends: how it moves within a step is known to itself alone.
#[must_use]
pub fn bends(neighbour: &Neighbour) -> bool {
    matches!(neighbour.snapshot.body, Body::Curve(_) | Body::Soft(_))
}

/// Whether a neighbour is a tool whose drive has a say in how it moves: to whom is linked to it it is led.
#[must_use]
pub fn is_driven(neighbour: &Neighbour, around: &Surroundings<'_>) -> bool {
    matches!(neighbour.snapshot.body, Body::Tool(_)) && !is_linked(neighbour, around)
}

/// Whether a neighbour bends, is driven, or moves as somebody else near here pushes it.
#[must_use]
pub fn has_a_say(neighbour: &Neighbour, around: &Surroundings<'_>) -> bool {
    let gives = |n: &Neighbour| n.id != neighbour.id && n.snapshot.given.iter().any(|l| l.with == neighbour.id);
    bends(neighbour) || is_driven(neighbour, around) || around.neighbours.iter().any(gives)
}

/// Whether a neighbour may come near enough to a body within `bounds` to touch it in the next `dt` seconds.
#[must_use]
pub fn may_touch(neighbour: &Neighbour, around: &Surroundings<'_>, bounds: &Bounds, dt: f64) -> bool {
    let (Some(_), Some(there)) = (&neighbour.form, &neighbour.snapshot.bounds) else { return false };
    if neighbour.law != Law::Ledger || !neighbour.snapshot.is_finite() || is_let_in(neighbour, around.me) {
        return false;
    }
    let ahead = around.time.secs_after(neighbour.snapshot.time).abs() + dt;
    let way = bounds.speed_m_s * dt + (there.speed_m_s + SURPRISE_M_S2 * ahead) * ahead;
    let apart = (there.low - bounds.high).max(bounds.low - there.high).max_element();
    apart <= way
}

/// Whether a tool's jaws leave `me` alone: they hold it, or stand open so that it may come between them.
fn is_let_in(neighbour: &Neighbour, me: AgentId) -> bool {
    let Body::Tool(tool) = &neighbour.snapshot.body else { return false };
    tool.grasp.map_or(tool.jaw > GRASP_BELOW, |grasp| grasp.target == me)
}
