//! Joints whose travel follows that of another joint: gears, racks, fingers of one gripper (`mimic` of URDF).
//!
//! In: joints as they are laid out. Out: one row for each that follows, between the motions that both joints leave free. Never here: how
//! the two joints themselves hold. Theory: docs/theory/clusters.md, eq. 21a.

use super::{Held, Joints, MIMIC};
use crate::constraint::{ConstraintRows, FineStep, RowOwner, place_key};
use crate::joint::{JOINT_GAP_MAX_M, Joint, JointKind, Mimic};
use crate::lists::refill;
use crate::member::Pose;
use crate::member::memory::Partner;
use crate::push_out::PUSH_OUT_MAX_M_S;
use crate::solve::{Hold, JointRow, Side};
use glam::{DMat3, DVec3};
use std::f64::consts::TAU;

/// The most whole turns of a leader that are looked for, either way, where both joints go round.
const TURNS_MAX: i32 = 64;

/// A joint that follows another.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mimicking {
    /// Both, by their places among the joints held: first the one that follows.
    held: [usize; 2],
    pub(super) row: usize,
    mimic: Mimic,
    /// The travels of both with the whole turns of hinges.
    travels: [f64; 2],
}

impl Joints {
    /// Lays out the rows of joints that follow others, where both are held: the velocity of such a row is that of the gap between them.
    pub(super) fn lay_mimics(&mut self, step: &FineStep<'_, '_>, constraints: &mut ConstraintRows) {
        let Self { held, by_number, .. } = self;
        if held.iter().all(|held| held.of.joint.mimic.is_none()) {
            return;
        }
        refill(by_number, 0..held.len());
        by_number.sort_unstable_by_key(|at| held[*at].of.number);
        for (at, follower) in self.held.iter().enumerate() {
            let Some(mimic) = follower.of.joint.mimic else { continue };
            let leading = self.by_number.binary_search_by_key(&mimic.joint, |at| self.held[*at].of.number);
            let Ok(leading) = leading.map(|leading| self.by_number[leading]) else { continue };
            let both = [at, leading].map(|at| &self.held[at]);
            let sides = [both[0].travel_side(step, 1.0), both[1].travel_side(step, mimic.ratio)];
            let [Some(follows), Some(leads)] = sides else { continue };
            let row = JointRow::new([follows, leads], Hold::along(DVec3::X));
            let owner = RowOwner::new(follower.of.a, follower.of.b, Partner::Joint(follower.of.number));
            let owner = RowOwner { key: MIMIC, travels: travels(step, both, mimic, &owner), ..owner };
            let mimicking =
                Mimicking { held: [at, leading], row: constraints.rows.len(), mimic, travels: owner.travels };
            if constraints.push(step, row, owner) {
                self.mimicking.push(mimicking);
            }
        }
    }
}

/// The travels of two joints, each as near as whole turns let it be to where it was before the last step. Where a command has put one of
/// their bodies somewhere else since, nothing is known of turns but that the two are together.
fn travels(step: &FineStep<'_, '_>, both: [&Held; 2], mimic: Mimic, owner: &RowOwner) -> [f64; 2] {
    let now = both.map(|held| held.now.travel);
    let mut bodies = both.into_iter().flat_map(|held| [Some(held.of.a), held.of.b]).flatten();
    if bodies.any(|body| !step.all[body].memory.goes_on()) {
        return mimic.together(both.map(|held| &held.of.joint), now);
    }
    let before = step.all[owner.member].memory.recall(owner.partner, place_key(MIMIC)).travels;
    std::array::from_fn(|at| match turns_round(&both[at].of.joint) {
        true => now[at] + ((before[at] - now[at]) / TAU).round() * TAU,
        false => now[at],
    })
}

impl Held {
    /// The velocity of its travel times `ratio`, along x.
    fn travel_side(&self, step: &FineStep<'_, '_>, ratio: f64) -> Option<Side> {
        let placed = self.of.placed(step.all)?;
        let [a, b] = placed.free(&self.of.joint).sides;
        let along = DMat3::from_cols(DVec3::X * placed.axis.x, DVec3::X * placed.axis.y, DVec3::X * placed.axis.z);
        Side::against(&b, &a, along * ratio).ok()
    }
}

impl Mimicking {
    /// How far the two are off at the end of the step: a gap that the step begins with is taken back as fast as an overlap of contacts.
    pub(super) fn miss(&self, held: &[Held], poses: &[Option<Pose>], h_s: f64) -> f64 {
        let both = self.held.map(|at| &held[at]);
        let moved = both.map(|held| held.after(poses).0.travel - held.now.travel);
        let now = self.mimic.gap(self.travels);
        let most = PUSH_OUT_MAX_M_S * h_s;
        now.clamp(-most, most) + moved[0] - self.mimic.ratio * moved[1]
    }
}

impl Mimic {
    /// The travels of a joint that follows and of its leader with whole turns, where these are known of neither: the fewest of the leader with
    /// which the two are together within [`JOINT_GAP_MAX_M`]. Where there are none the leader's travel is the given one.
    #[must_use]
    pub fn together(&self, joints: [&Joint; 2], travels: [f64; 2]) -> [f64; 2] {
        let [follower_turns, leader_turns] = joints.map(turns_round);
        let turned = |turns: f64| {
            let [follows, leads] = [travels[0], travels[1] + TAU * turns];
            let round = if follower_turns { (self.gap([follows, leads]) / TAU).round() } else { 0.0 };
            [follows - TAU * round, leads]
        };
        // a nut says how often its screw has turned
        let of_nut = (!follower_turns).then(|| (self.gap(travels) / (TAU * self.ratio)).round());
        let some = (1..=TURNS_MAX).flat_map(|turns| [turns, -turns]).map(f64::from);
        let turns = std::iter::once(0.0).chain(of_nut).chain(some).take(if leader_turns { usize::MAX } else { 1 });
        let mut together = turns.map(turned).filter(|travels| self.gap(*travels).abs() <= JOINT_GAP_MAX_M);
        together.next().unwrap_or_else(|| turned(0.0))
    }

    /// How far the travel of the one that follows is ahead of where its leader leads it, rad or m.
    #[must_use]
    pub fn gap(&self, [follows, leads]: [f64; 2]) -> f64 {
        follows - self.ratio * leads - self.offset
    }
}

/// Whether a joint can go round and round: a hinge without a range.
fn turns_round(joint: &Joint) -> bool {
    matches!(joint.kind, JointKind::Revolute { range_rad: None, .. })
}
