//! Which blocks of a body a partner's impulses may move: those of the places where the two may touch soon, or are linked.
//!
//! In: a participant, a partner's published state. Out: blocks, and the sides of sites. Never here: what blocks answer.

use crate::cluster::Side;
use crate::member::{ClusterMember, Participant, Role};
use crate::remote::{Scratch, anchor_of};
use crate::{Law, Neighbour};
use glam::DVec3;
use metachron_core::{Impulse, Site};
use metachron_geometry::narrow_phase::touches;
use metachron_geometry::{CollisionShape, ContactSide, ShapeKind};

/// The most places of a pair whose blocks are published: W is dense.
const PLACES_MAX: usize = 12;
/// Places are looked for this far ahead, in steps of the body that publishes.
const STEPS_AHEAD: f64 = 2.0;
/// And at least so far, metres.
const NEAR_M: f64 = 2e-3;

/// Visits what an impulse at a site gives to sides of a member.
pub(crate) fn visit_sides(
    member: &dyn ClusterMember,
    site: Site,
    impulse: Impulse,
    mut visit: impl FnMut(Side, DVec3),
) {
    let anchor = anchor_of(site);
    if let Some(point) = member.anchor(anchor).filter(|_| impulse.linear != DVec3::ZERO) {
        visit(point.side, impulse.linear);
    }
    if let Some(side) = member.turn(anchor).filter(|_| impulse.angular != DVec3::ZERO) {
        visit(side, impulse.angular);
    }
}

/// Adds the blocks of `one` that `other` may move within the next steps of `step_s` seconds.
pub(crate) fn find(one: &Participant<'_>, other: &Neighbour, step_s: f64, scratch: &mut Scratch) {
    let Scratch { blocks, shape, narrow, touches: found, .. } = scratch;
    if one.member.role() != Role::Deformable {
        blocks.extend(0..one.member.free().len());
        return;
    }
    let mut add = |side: Side| blocks.extend(side.terms().iter().map(|term| term.block));
    for link in one.context.links.iter().filter(|link| link.other == other.id && link.law == Law::Ledger) {
        one.member.anchor(link.here).into_iter().for_each(|point| add(point.side));
    }
    let (Some(skin), Some(form), Law::Ledger) = (one.member.skin(), other.form.as_deref(), other.law) else { return };
    let since_s = one.context.time.secs_after(other.snapshot.time) + step_s;
    if !shape.bring(&other.snapshot.body, since_s) {
        return;
    }
    let Some(theirs) = shape.placed(form) else { return };
    let their_m_s = other.snapshot.bounds.map_or(0.0, |bounds| bounds.speed_m_s);
    let speed_m_s = one.member.speed_bound(one.member.velocities()) + their_m_s;
    let reach_m = NEAR_M + edge_m(skin.form) + STEPS_AHEAD * step_s * speed_m_s;
    if !skin.bounds().grown(reach_m).meets(theirs.bounds()) {
        return;
    }
    touches(&skin, &theirs, reach_m, narrow, found);
    found.sort_unstable_by(|a, b| a.gap_m.total_cmp(&b.gap_m).then(a.key.cmp(&b.key)));
    for touch in found.iter().take(PLACES_MAX) {
        add(one.member.side(&touch.on_a, ContactSide::first(touch.normal)));
    }
}

/// How far the places of a skin are from each other, metres.
fn edge_m(form: &CollisionShape) -> f64 {
    if let ShapeKind::Surface(surface) = &form.kind { surface.edge_m } else { 0.0 }
}
