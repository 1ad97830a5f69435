//! How long a step may be beside others of whom nobody can foresee how they move within it.
//!
//! In: a step that is wanted, and who is near. Out: that step, or an equal part of it; who may be touched in it; whether somebody
//! has to be waited for. Never here: the step itself. Theory: docs/theory/coupling.md, eq. 7g.

use super::Law;
use crate::{Neighbour, StepContext};
use glam::DVec3;
use metachron_core::Impulse;
use metachron_core::{AgentId, Body, Bounds, GRASP_BELOW, SimSpan, ToolState};

/// Beside others a body that bends makes no longer substeps than this, seconds: in a longer one it falls so far from where it
/// began that its places of contact are no longer there (measured: 20 mm deep at 0.1 s, 0.01 mm at 1/60 s).
pub const PART_MAX_S: f64 = 1.0 / 60.0;
/// A step longer than [`PART_MAX_S`] by less than this is not divided.
pub(super) const SPLIT_SLACK: f64 = 1.01;
/// No step is made shorter than this because of somebody fast, seconds.
const HURRY_S: f64 = 1e-3;
/// Whom it pushes an owner may leave behind so far besides one of their steps, seconds: as long as a system lets a thread wait now and
/// then, and as short as a fall from rest makes 2 mm in.
const AHEAD_S: f64 = 0.02;
/// Who is pushed may leave who pushes it behind by so much of one of its steps: fingers that answer to forces older than that drop a tube.
const PUSHED_STEPS: f64 = 0.5;
/// And by this at least, seconds: clocks are looked at again no sooner. What pulls at a link, or bends, is waited for after one of its
/// steps and this: a gut of 240 Hz flew off its sheet that let it fall 28 ms behind.
const PUSHED_LEAST_S: f64 = 2e-3;
/// An owner who has not been heard of for so many steps, its own or a body's, gives nothing any more.
pub(super) const SILENT_STEPS: f64 = 3.0;
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
    around: &StepContext<'_>,
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
    around: &StepContext<'_>,
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

/// A part of a step of `dt` in which nobody that the body may touch comes farther towards it than `way_m` tells of that one; a millisecond
/// at least. `way_m` is `None` of whoever does not matter.
pub fn unhurried(
    dt: SimSpan,
    around: &StepContext<'_>,
    bounds: impl FnOnce() -> Bounds,
    way_m: impl Fn(&Neighbour) -> Option<f64>,
) -> SimSpan {
    if around.neighbours.iter().all(|n| way_m(n).is_none()) {
        return dt;
    }
    let (dt_s, bounds) = (dt.as_secs_f64(), bounds());
    let parts = |n: &Neighbour| {
        let speed_m_s = bounds.speed_m_s + n.snapshot.bounds?.speed_m_s;
        Some(speed_m_s * dt_s / way_m(n)?).filter(|parts| *parts > 1.0 && may_touch(n, around, &bounds, dt_s))
    };
    let parts = around.neighbours.iter().filter_map(parts).fold(1.0, f64::max);
    SimSpan::from_nanos(dt.as_nanos() / parts.ceil().min((dt_s / HURRY_S).floor()).max(1.0) as u64)
}

/// Whether a neighbour with steps of `step_s` seconds stands so far behind the body's time that the body has to wait for it, where they
/// are linked, hold each other or may touch in a step of `dt`: by half of such a step where it owns the pair, by one and 20 ms where the
/// body does, but by one and 2 ms on a link, where there is no moment at which nothing acts, and where the other bends. `bounds` are
/// those of the body, if anything of it can be touched.
pub fn leaves_behind(
    neighbour: &Neighbour,
    (dt, step_s): (SimSpan, f64),
    around: &StepContext<'_>,
    bounds: impl FnOnce() -> Option<Bounds>,
) -> bool {
    let behind_s = around.time.secs_after(neighbour.snapshot.time);
    let allowed_s = if !neighbour.owned {
        (PUSHED_STEPS * step_s).max(PUSHED_LEAST_S)
    } else if is_linked(neighbour, around) || bends(neighbour) {
        told_s(neighbour).map_or(PUSHED_LEAST_S + step_s, |told_s| told_s.min(step_s))
    } else {
        AHEAD_S + step_s
    };
    if behind_s <= allowed_s || neighbour.snapshot.at_rest {
        return false;
    }
    is_beside(neighbour, (dt, step_s), around, bounds)
}

/// How long the step is that a soft body foretells, seconds: past it nobody knows how it bends.
fn told_s(neighbour: &Neighbour) -> Option<f64> {
    let response = neighbour.snapshot.inertia.response().filter(|response| response.curve().is_none())?;
    Some(response.forecast_s()).filter(|told_s| *told_s > 0.0)
}

/// Whether a neighbour with steps of `step_s` seconds has to live at one pace with a body that makes steps of `dt`: they are linked, hold
/// each other, or may touch before one of them knows of the other. `bounds` are those of the body, if anything of it can be touched.
pub fn is_beside(
    neighbour: &Neighbour,
    (dt, step_s): (SimSpan, f64),
    around: &StepContext<'_>,
    bounds: impl FnOnce() -> Option<Bounds>,
) -> bool {
    // who is farther behind is not waited for until it is as near as this
    let ahead_s = dt.as_secs_f64() + AHEAD_S + step_s;
    around.links.iter().any(|link| link.other == neighbour.id)
        || holds(neighbour, around.me)
        || bounds().is_some_and(|bounds| is_near(neighbour, &bounds, (dt.as_secs_f64(), ahead_s)))
}

/// Whether one of the two is a tool that holds the other.
fn holds(neighbour: &Neighbour, me: AgentId) -> bool {
    let held = |tool: &ToolState| tool.grasp.is_some_and(|grasp| grasp.target == me);
    matches!(&neighbour.snapshot.body, Body::Tool(tool) if held(tool))
        || neighbour.snapshot.grips.iter().any(|grip| grip.by == Some(me))
}

/// How far what an owner gave has carried a body with steps of `step_s` seconds: as if it came as late as it may between two that live at
/// one pace, where it is older. Who met at times of their own, one waiting for the other, was not moved by it while it waited.
#[must_use]
pub fn carried(owner: &Neighbour, step_s: f64, sum: Impulse, carried: Impulse) -> Impulse {
    let late_s = AHEAD_S + SILENT_STEPS * owner.step_s.max(step_s);
    let bounded = |sum: DVec3, way: DVec3| {
        let most = late_s * sum.length();
        if way.length_squared() > most * most { way.clamp_length_max(most) } else { way }
    };
    Impulse { linear: bounded(sum.linear, carried.linear), angular: bounded(sum.angular, carried.angular) }
}

/// Whether a link by the ledger joins a neighbour to this body.
#[must_use]
pub fn is_linked(neighbour: &Neighbour, around: &StepContext<'_>) -> bool {
    around.links.iter().any(|link| link.other == neighbour.id && link.law == Law::Cluster)
}

/// Whether a neighbour bends: how it moves within a step is known to itself alone.
#[must_use]
pub fn bends(neighbour: &Neighbour) -> bool {
    matches!(neighbour.snapshot.body, Body::Curve(_) | Body::Soft(_))
}

/// Whether a neighbour bends and gives by the ledger what contact with it gives: who looks does not own that.
#[must_use]
pub fn may_press(neighbour: &Neighbour) -> bool {
    !neighbour.owned && bends(neighbour) && neighbour.form.is_some() && neighbour.law == Law::Cluster
}

/// Whether a neighbour is a tool whose drive has a say in how it moves: to whom is linked to it it is led.
#[must_use]
pub fn is_driven(neighbour: &Neighbour, around: &StepContext<'_>) -> bool {
    matches!(neighbour.snapshot.body, Body::Tool(_)) && !is_linked(neighbour, around)
}

/// Whether a neighbour is a tool that a script or a hand leads on, though it may stand still: who sleeps under it gives it nothing.
#[must_use]
pub fn is_led_on(neighbour: &Neighbour) -> bool {
    matches!(&neighbour.snapshot.body, Body::Tool(tool) if !tool.is_idle)
}

/// Whether a neighbour bends, is driven, or moves as somebody else near here pushes it.
#[must_use]
pub fn has_a_say(neighbour: &Neighbour, around: &StepContext<'_>) -> bool {
    let gives = |n: &Neighbour| n.id != neighbour.id && n.snapshot.given.iter().any(|l| l.with == neighbour.id);
    bends(neighbour) || is_driven(neighbour, around) || around.neighbours.iter().any(gives)
}

/// Whether a neighbour may come near enough to a body within `bounds` to touch it in the next `dt` seconds.
#[must_use]
pub fn may_touch(neighbour: &Neighbour, around: &StepContext<'_>, bounds: &Bounds, dt: f64) -> bool {
    let ahead = around.time.secs_after(neighbour.snapshot.time).abs() + dt;
    neighbour.law == Law::Cluster && !is_let_in(neighbour, around.me) && is_near(neighbour, bounds, (dt, ahead))
}

/// The same where its state is as old as to be `ahead` at the end, seconds; whatever the law, and between open jaws.
fn is_near(neighbour: &Neighbour, bounds: &Bounds, (dt, ahead): (f64, f64)) -> bool {
    let (Some(_), Some(there)) = (&neighbour.form, &neighbour.snapshot.bounds) else { return false };
    if !neighbour.snapshot.is_finite() {
        return false;
    }
    let way = bounds.speed_m_s * dt + (there.speed_m_s + SURPRISE_M_S2 * ahead) * ahead;
    let apart = (there.low - bounds.high).max(bounds.low - there.high).max_element();
    apart <= way
}

/// Whether a tool's jaws leave `me` alone: they hold it, or stand open so that it may come between them.
fn is_let_in(neighbour: &Neighbour, me: AgentId) -> bool {
    let Body::Tool(tool) = &neighbour.snapshot.body else { return false };
    tool.grasp.map_or(tool.jaw > GRASP_BELOW, |grasp| grasp.target == me)
}
