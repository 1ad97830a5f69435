//! A joint where its bodies are when a step begins: the points and the spins between which its rows are laid out.
//!
//! In: a joint between participants. Out: sides of rows with their owners. Never here: rows.

use crate::constraint::{End, Frame, RowOwner};
use crate::joint::{Joint, JointKind};
use crate::member::memory::Partner;
use crate::member::{MaterialPoint, Participant, Pose};
use crate::solve::Side;
use glam::DVec3;
use metachron_core::Anchor;

/// A joint between participants.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jointed {
    /// Its number in the scene.
    pub(super) number: u32,
    /// As it holds now.
    pub(super) joint: Joint,
    pub(super) a: usize,
    /// `None` is the world.
    pub(super) b: Option<usize>,
}

/// Two points or two turns that a joint holds together, and the owner of their first row.
#[derive(Clone, Copy)]
pub(super) struct Together {
    pub(super) sides: [Side; 2],
    pub(super) owner: RowOwner,
}

/// A joint where its bodies are when the step begins.
#[derive(Clone, Copy)]
pub(super) struct Placed {
    pub(super) poses: [Pose; 2],
    pub(super) ends: [End; 2],
    /// The direction that it leaves free, world axes, of length 1.
    pub(super) axis: DVec3,
    pub(super) points: Together,
    /// Rows of these give no force.
    pub(super) turns: Together,
}

impl Jointed {
    /// Where it is when the step begins; `None` where a body has no place of its own.
    pub(super) fn placed(&self, all: &[Participant<'_>]) -> Option<Placed> {
        let Self { number, joint, a: first, b: second } = *self;
        let at = |member: usize| all[member].member.pose(&[], 0.0);
        let (a, b) = (at(first)?, second.map_or(Some(Pose::WORLD), at)?);
        let anchors = [a.place(joint.anchor_a_m), b.place(joint.anchor_b_m)];
        // on a slide b's anchor meets the matter of a beside it, wherever that is
        let on_a = if matches!(joint.kind, JointKind::Prismatic { .. }) { anchors[1] } else { anchors[0] };
        let (point_a, point_b) = (material(all, Some(first), &a, on_a)?, material(all, second, &b, anchors[1])?);
        let ends = [End { member: Some(first), point: point_a }, End { member: second, point: point_b }];
        let owner_of_turns = RowOwner::new(first, second, Partner::Joint(number));
        let Joint { tears_above_n, yields_above_n, .. } = joint;
        let owner = RowOwner { tears_above_n, yields_above_n, frame: Frame::of(&b), ..owner_of_turns };
        let turns = [a.turns.of_member(first), second.map_or(Side::FIXED, |at| b.turns.of_member(at))];
        Some(Placed {
            poses: [a, b],
            ends,
            axis: joint.axis(&a, anchors[1] - anchors[0]),
            points: Together { sides: ends.map(|end| end.side()), owner },
            turns: Together { sides: turns, owner: owner_of_turns },
        })
    }
}

impl Placed {
    /// The sides that the joint leaves free, spins of a hinge or a ball, points of a slide: a force between them does not hold it together.
    pub(super) fn free(&self, joint: &Joint) -> Together {
        let of = if matches!(joint.kind, JointKind::Revolute { .. } | JointKind::Spherical) {
            &self.turns
        } else {
            &self.points
        };
        Together { sides: of.sides, owner: self.turns.owner }
    }
}

/// The matter of a participant, or of the world, at `place`.
fn material(all: &[Participant<'_>], member: Option<usize>, pose: &Pose, place: DVec3) -> Option<MaterialPoint> {
    let Some(member) = member else { return Some(MaterialPoint::led(place, DVec3::ZERO)) };
    all[member].member.anchor(Anchor::Local(pose.rotation.conjugate() * (place - pose.centre_m)))
}
