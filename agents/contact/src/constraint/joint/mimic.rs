//! Joints whose travel follows that of another joint: gears, racks, fingers of one gripper (`mimic` of URDF).
//!
//! In: joints as they are laid out. Out: one row for each that follows, between the motions that both joints leave free. Never here: how
//! the two joints themselves hold. Theory: docs/theory/clusters.md, eq. 21a.

use super::{Held, Joints, MIMIC};
use crate::constraint::{ConstraintRows, FineStep, RowOwner, place_key};
use crate::joint::{Joint, JointKind, Mimic};
use crate::member::Pose;
use crate::member::memory::Partner;
use crate::push_out::PUSH_OUT_MAX_M_S;
use crate::solve::{Hold, JointRow, Side};
use glam::{DMat3, DVec3};
use std::f64::consts::TAU;

/// A joint that follows another.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mimicking {
    /// Both, by their places among the joints held: first the one that follows.
    held: [usize; 2],
    pub(super) row: usize,
    mimic: Mimic,
    /// Whole turns of both counted so far, in the unit of the one that follows.
    turned: f64,
}

impl Joints {
    /// Lays out the rows of joints that follow others, where both are held: the velocity of such a row is that of the gap between them.
    pub(super) fn lay_mimics(&mut self, step: &FineStep<'_, '_>, constraints: &mut ConstraintRows) {
        for (at, follower) in self.held.iter().enumerate() {
            let Some(mimic) = follower.of.joint.mimic else { continue };
            let Some(leading) = self.held.iter().position(|held| held.of.number == mimic.joint) else { continue };
            let sides = [follower.travel_side(step, 1.0), self.held[leading].travel_side(step, mimic.ratio)];
            let [Some(follows), Some(leads)] = sides else { continue };
            let row = JointRow::new([follows, leads], Hold::along(DVec3::X));
            let owner = RowOwner::new(follower.of.a, follower.of.b, Partner::Joint(follower.of.number));
            let before = step.all[follower.of.a].memory.recall(owner.partner, place_key(MIMIC)).turned;
            let mut mimicking = Mimicking { held: [at, leading], row: constraints.rows.len(), mimic, turned: before };
            mimicking.turn(&self.held);
            if constraints.push(step, row, RowOwner { key: MIMIC, turned: mimicking.turned, ..owner }) {
                self.mimicking.push(mimicking);
            }
        }
    }
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
    /// Finds the turns with which the two are nearest to each other: angles are known but for whole turns. The one that leads has gone on by
    /// one at most since the last step.
    fn turn(&mut self, held: &[Held]) {
        let before = *self;
        let travels = self.held.map(|at| held[at].now.travel);
        let [follower_turns, leader_turns] = self.held.map(|at| turns_round(&held[at].of.joint));
        let leading: &[f64] = if leader_turns { &[0.0, 1.0, -1.0] } else { &[0.0] };
        for turns in leading {
            let mut next = Self { turned: before.turned - TAU * turns * before.mimic.ratio, ..before };
            if follower_turns {
                next.turned -= (next.gap(travels) / TAU).round() * TAU;
            }
            if next.gap(travels).abs() < self.gap(travels).abs() {
                *self = next;
            }
        }
    }

    /// How far the one that follows is ahead of where the other leads it.
    fn gap(&self, [follows, leads]: [f64; 2]) -> f64 {
        follows + self.turned - self.mimic.ratio * leads - self.mimic.offset
    }

    /// How far that is off at the end of the step: a gap that the step begins with is taken back as fast as an overlap of contacts.
    pub(super) fn miss(&self, held: &[Held], poses: &[Option<Pose>], h_s: f64) -> f64 {
        let now = self.gap(self.held.map(|at| held[at].now.travel));
        let then = self.gap(self.held.map(|at| held[at].after(poses).0.travel));
        let most = PUSH_OUT_MAX_M_S * h_s;
        then - (now - now.clamp(-most, most))
    }
}

/// Whether a joint can go round and round: a hinge without a range.
fn turns_round(joint: &Joint) -> bool {
    matches!(joint.kind, JointKind::Revolute { range_rad: None, .. })
}
