//! Joints of rigid bodies as rows of the cluster's problem.
//!
//! In: the joints of a scene, poses of participants. Out: rows whose targets bring both bodies to where the joint holds them at the
//! end of the step, by the poses that they will then have. Never here: springs (`springs.rs`), contacts.
//!
//! A row knows velocities: held at zero, they let whatever turns drift off by ω² h² of its arm in each step, and lose what taking
//! that back takes. So a target contains how far the joint would be off after the step, for velocities near the answer: those of the
//! step before, then those of the answer itself, until the joint holds. Positions are
//! kept as by RATTLE (AND83): to second order, and what turns keeps its energy.

//!
//! What is light and holds much turns to and fro faster than steps can follow, and would be thrown: a force f at an arm r turns a body
//! back with the stiffness f·r. Where h² of that is more than the body's inertia, so much inertia is added across the arm, by a row that
//! resists changes of the spin; it takes no energy, and a turn that steps can follow has none of it.

use super::member::{MaterialPoint, Pose};
use super::memory::Partner;
use super::scene::ClusterScene;
use super::springs::{End, Name, Pull, turn_between};
use super::ties::{RowOwner, Ties, place_of};
use super::{Participant, Progress};
use crate::cluster::{Hold, JointRow, Side};
use crate::contact::PUSH_OUT_MAX_M_S;
use crate::joint::{Joint, JointKind};
use glam::{DQuat, DVec3};
use metachron_core::Anchor;
use metachron_geometry::narrow_phase::TouchKey;
use std::f64::consts::{PI, TAU};

/// The joints of a fine step.
#[derive(Debug, Default)]
pub(super) struct Joints {
    held: Vec<Held>,
    parts: Vec<Part>,
    pulls: Vec<ArmPull>,
    /// Of each participant, how much inertia its pulls ask for, in shares of what it has.
    asked: Vec<f64>,
}

/// A force at an arm of a body.
#[derive(Debug, Clone, Copy)]
struct ArmPull {
    owner: RowOwner,
    /// The body, and its spin.
    member: usize,
    turns: Side,
    /// Along the arm, of length 1.
    axis: DVec3,
    /// The inertia that it asks for across the arm, kg m².
    inertia_kg_m2: f64,
}

/// Of h² times the stiffness of a pull, the share that its body's inertia has to reach: ¼ is where steps begin to throw it.
const INERTIA_SHARE: f64 = 0.5;
/// The key of the first row of added inertia of a joint.
const ADDED: u32 = 8;

/// A joint between participants; no second one is the world.
#[derive(Debug, Clone, Copy)]
struct Held {
    joint: Joint,
    members: (usize, Option<usize>),
    /// How far it is off when the step begins.
    now: Off,
}

/// What a row of a joint is about.
#[derive(Debug, Clone, Copy)]
struct Part {
    /// The joint, by its place here, and the row among those of the problem.
    held: usize,
    row: usize,
    way: Way,
}

/// The way in which a row holds.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// A point of a against one of b.
    Point,
    /// The attitude of a against that of b.
    Turn,
    /// Travel above a least one, and below a most.
    Above(f64),
    Below(f64),
}

/// By how much a joint is off, a against b.
#[derive(Debug, Clone, Copy, Default)]
struct Off {
    /// Of the points, metres, world axes.
    point: DVec3,
    /// Of the attitudes, radians, world axes.
    turn: DVec3,
    /// How far b has moved from a in the way that is free: an angle, a length.
    travel: f64,
}

impl Joints {
    /// Lays out all joints between participants.
    pub fn gather(
        &mut self,
        scene: &ClusterScene,
        all: &[Participant<'_>],
        progress: &[Progress],
        ties: &mut Ties,
        h_s: f64,
    ) {
        self.held.clear();
        self.parts.clear();
        self.pulls.clear();
        for (a, one) in all.iter().enumerate() {
            for (number, joint) in scene.joints_of(one.id) {
                let b = joint.b.map(|id| place_of(all, id));
                // a body that is not here cannot be held: clusters contain both
                let Some(b) = b.map_or(Some(None), |b| b.map(Some)) else { continue };
                self.hold(all, joint, (a, b), number, ties, h_s);
            }
        }
        self.aim(all, ties, |member| &progress[member].before[..], h_s);
        self.add_inertia(all, progress, ties, h_s);
    }

    /// Notes the force that a joint gave at the arms of its bodies in the last step.
    fn note_pull(&mut self, all: &[Participant<'_>], ends: &[End; 2], poses: [&Pose; 2], name: Name, h_s: f64) {
        let force_n = all[name.member].memory.recall(name.partner, TouchKey::default()).force_n;
        for (at, end) in ends.iter().enumerate() {
            let Some(member) = end.member else { continue };
            let arm = end.point.position - poses[at].centre_m;
            let force_n = if at == 0 { force_n } else { -force_n };
            let (Some(axis), turns) = (arm.try_normalize(), poses[at].turns) else { continue };
            // the larger of both stiffnesses against turns: a force that is not along its arm has three
            let stiffness = 0.5 * (force_n.dot(arm) + force_n.length() * arm.length());
            let owner = name.row(ADDED + at as u32, None);
            let inertia_kg_m2 = INERTIA_SHARE * h_s * h_s * stiffness;
            self.pulls.push(ArmPull { owner, member, turns: turns.of_member(member), axis, inertia_kg_m2 });
        }
    }

    /// Adds the inertia that bodies lack.
    fn add_inertia(&mut self, all: &[Participant<'_>], progress: &[Progress], ties: &mut Ties, h_s: f64) {
        self.asked.clear();
        self.asked.resize(all.len(), 0.0);
        for pull in &self.pulls {
            self.asked[pull.member] += pull.share(all);
        }
        for pull in &self.pulls {
            let lacking = 1.0 - self.asked[pull.member].recip();
            if lacking > 0.0 && pull.inertia_kg_m2 > 0.0 {
                let row = JointRow {
                    target_m_s: pull.turns.velocity(&progress[pull.member].before),
                    compliance_per_kg: Some((pull.inertia_kg_m2 * lacking).recip()),
                    ..JointRow::new(u64::from(pull.owner.key), [pull.turns, Side::FIXED], Hold::across(pull.axis))
                };
                ties.push(all, row, pull.owner, h_s);
            }
        }
    }

    /// Lays out one joint.
    fn hold(
        &mut self,
        all: &[Participant<'_>],
        joint: &Joint,
        members: (usize, Option<usize>),
        number: u32,
        ties: &mut Ties,
        h_s: f64,
    ) {
        let at = |member: usize| all[member].member.pose(&[], 0.0);
        let (Some(a), Some(b)) = (at(members.0), members.1.map_or(Some(Pose::WORLD), at)) else { return };
        let anchors = [a.place(joint.anchor_a_m), b.place(joint.anchor_b_m)];
        // on a slide b's anchor meets the matter of a beside it, wherever that is
        let on_a = if matches!(joint.kind, JointKind::Prismatic { .. }) { anchors[1] } else { anchors[0] };
        let (Some(point_a), Some(point_b)) =
            (material(all, Some(members.0), &a, on_a), material(all, members.1, &b, anchors[1]))
        else {
            return;
        };
        let ends = [End { member: Some(members.0), point: point_a }, End { member: members.1, point: point_b }];
        let name = Name { member: members.0, partner: Partner::Joint(number), hold: None };
        if let JointKind::Spring { stiffness_n_m, damping_n_s_m, rest_m } = joint.kind {
            ties.spring(all, &ends, &Pull { stiffness_n_m, damping_n_s_m, rest_m }, name, h_s);
            return;
        }
        let points = [ends[0].side(), ends[1].side()];
        let turns = [a.turns.of_member(members.0), members.1.map_or(Side::FIXED, |at| b.turns.of_member(at))];
        self.note_pull(all, &ends, [&a, &b], name, h_s);
        let now = joint.off(&a, &b);
        self.held.push(Held { joint: *joint, members, now });
        let held = self.held.len() - 1;
        let axis = joint.axis(&a, anchors[1] - anchors[0]);
        let mut key = 0;
        let mut push = |way: Way, sides: [Side; 2], hold: Hold| {
            let row = ties.rows.len();
            ties.push(all, JointRow::new(u64::from(key), sides, hold), name.row(key, members.1), h_s);
            if ties.rows.len() > row {
                self.parts.push(Part { held, row, way });
            }
            key += 1;
        };
        match joint.kind {
            JointKind::Fixed => {
                push(Way::Point, points, Hold::ALL);
                push(Way::Turn, turns, Hold::ALL);
            }
            JointKind::Revolute { range_rad, .. } => {
                push(Way::Point, points, Hold::ALL);
                push(Way::Turn, turns, Hold::across(axis));
                if let Some([low, high]) = range_rad {
                    push(Way::Above(low), turns, Hold::pushing(-axis));
                    push(Way::Below(high), turns, Hold::pushing(axis));
                }
            }
            JointKind::Spherical => push(Way::Point, points, Hold::ALL),
            JointKind::Prismatic { range_m, .. } => {
                push(Way::Point, points, Hold::across(axis));
                push(Way::Turn, turns, Hold::ALL);
                if let Some([low, high]) = range_m {
                    push(Way::Above(low), points, Hold::pushing(-axis));
                    push(Way::Below(high), points, Hold::pushing(axis));
                }
            }
            JointKind::Rope { length_m } => push(Way::Below(length_m), points, Hold::pushing(axis)),
            JointKind::Spring { .. } => {}
        }
    }

    /// Sets the targets of all rows so that joints hold at the end of the step, to the first order about `velocities` of members.
    /// Returns by how much they would miss that with these velocities themselves, metres or radians.
    pub fn aim<'v>(
        &self,
        all: &[Participant<'_>],
        ties: &mut Ties,
        velocities: impl Fn(usize) -> &'v [DVec3],
        h_s: f64,
    ) -> f64 {
        let mut worst = 0.0_f64;
        let mut then = None;
        for part in &self.parts {
            let held = &self.held[part.held];
            let off = match then {
                Some((at, off)) if at == part.held => off,
                _ => held.off_after(all, &velocities, h_s),
            };
            then = Some((part.held, off));
            let row = &mut ties.rows[part.row];
            let wanted = part.way.wanted(part.way.off(&held.now, row), row, h_s);
            let miss = part.way.off(&off, row) - wanted;
            let [a, b] = row
                .sides
                .map(|side| if side.terms().is_empty() { DVec3::ZERO } else { side.velocity(velocities(side.member)) });
            row.target_m_s = a - b - miss / h_s;
            worst = worst.max(part.way.missed(miss, row));
        }
        worst
    }
}

impl ArmPull {
    /// The trace of the inertia asked for over that of the body: no direction lacks more.
    fn share(&self, all: &[Participant<'_>]) -> f64 {
        let Some(spin) = self.turns.terms().first().map(|term| term.block) else { return 0.0 };
        let own = all[self.member].member.blocks().iter().find(|block| block.row == spin && block.column == spin);
        let Some(own) = own else { return 0.0 };
        let inverse = own.value.inverse();
        let trace = inverse.x_axis.x + inverse.y_axis.y + inverse.z_axis.z;
        self.inertia_kg_m2 * (trace - self.axis.dot(inverse * self.axis))
    }
}

impl Held {
    /// How far it is off once its bodies have moved on for `h_s` seconds.
    fn off_after<'v>(&self, all: &[Participant<'_>], velocities: &impl Fn(usize) -> &'v [DVec3], h_s: f64) -> Off {
        let at = |member: usize| all[member].member.pose(velocities(member), h_s);
        let (a, b) = self.members;
        let (Some(a), Some(b)) = (at(a), b.map_or(Some(Pose::WORLD), at)) else { return self.now };
        let mut off = self.joint.off(&a, &b);
        if matches!(self.joint.kind, JointKind::Revolute { .. }) {
            // angles are known but for whole turns
            off.travel += ((self.now.travel - off.travel) / TAU).round() * TAU;
        }
        off
    }
}

impl Way {
    /// How far a row is off, along directions in which it holds or not.
    fn off(self, off: &Off, row: &JointRow) -> DVec3 {
        let along = |gap: f64| match row.hold {
            Hold::Along { axis, .. } => axis * gap,
            _ => DVec3::ZERO,
        };
        match self {
            Self::Point => off.point,
            Self::Turn => off.turn,
            Self::Above(low) => along(off.travel - low),
            Self::Below(high) => along(high - off.travel),
        }
    }

    /// How far it may be off at the end of the step where it is `off` at its start: nothing, unless that is more than can be taken back
    /// as fast as contacts take an overlap back.
    fn wanted(self, off: DVec3, row: &JointRow, h_s: f64) -> DVec3 {
        let open = match row.hold {
            Hold::Along { axis, .. } => off.dot(axis) > 0.0,
            _ => false,
        };
        if open { DVec3::ZERO } else { off - off.clamp_length_max(PUSH_OUT_MAX_M_S * h_s) }
    }

    /// The part of a miss that counts: in directions in which the row holds, and of a stop what lies beyond it.
    fn missed(self, miss: DVec3, row: &JointRow) -> f64 {
        match row.hold {
            Hold::All { .. } => miss.length(),
            Hold::Across { axis, .. } => (miss - axis * miss.dot(axis)).length(),
            Hold::Along { axis, .. } => (-miss.dot(axis)).max(0.0),
        }
    }
}

impl Joint {
    /// How far the joint is off where its bodies are in these poses.
    fn off(&self, a: &Pose, b: &Pose) -> Off {
        let apart = a.place(self.anchor_a_m) - b.place(self.anchor_b_m);
        let at_zero = (a.rotation * self.rest.normalize()).normalize();
        match self.kind {
            JointKind::Fixed => Off { point: apart, turn: turn_between(at_zero, b.rotation), travel: 0.0 },
            JointKind::Revolute { axis, .. } => {
                let axis = axis.normalize_or_zero();
                let back = self.rest.normalize().conjugate();
                let turned = a.rotation.conjugate() * b.rotation * back;
                let about = axis * turned.xyz().dot(axis);
                let about = DQuat::from_xyzw(about.x, about.y, about.z, turned.w).normalize();
                let angle = about.to_scaled_axis().dot(axis);
                let travel = if angle > PI {
                    angle - TAU
                } else if angle < -PI {
                    angle + TAU
                } else {
                    angle
                };
                Off { point: apart, turn: tilt(b.rotation * back * axis, a.rotation * axis), travel }
            }
            JointKind::Spherical => Off { point: apart, ..Off::default() },
            JointKind::Prismatic { .. } => {
                let axis = self.axis(a, DVec3::ZERO);
                let travel = -apart.dot(axis);
                Off { point: apart + axis * travel, turn: turn_between(at_zero, b.rotation), travel }
            }
            JointKind::Spring { .. } | JointKind::Rope { .. } => Off { travel: apart.length(), ..Off::default() },
        }
    }

    /// The direction that it leaves free, or along which it pulls where b's anchor lies `away` from a's: world axes, of length 1.
    fn axis(&self, a: &Pose, away: DVec3) -> DVec3 {
        match self.kind {
            JointKind::Revolute { axis, .. } | JointKind::Prismatic { axis, .. } => {
                (a.rotation * axis).try_normalize().unwrap_or(DVec3::X)
            }
            _ => away.try_normalize().unwrap_or(DVec3::X),
        }
    }
}

impl Pose {
    /// The place of a point of the shape's axes.
    fn place(&self, local_m: DVec3) -> DVec3 {
        self.origin_m + self.rotation * local_m
    }
}

/// The matter of a participant, or of the world, at `place`.
fn material(all: &[Participant<'_>], member: Option<usize>, pose: &Pose, place: DVec3) -> Option<MaterialPoint> {
    let Some(member) = member else { return Some(MaterialPoint::led(place, DVec3::ZERO)) };
    all[member].member.anchor(Anchor::Local(pose.rotation.conjugate() * (place - pose.centre_m)))
}

/// The turn that leads from one direction to another, as a rotation vector.
fn tilt(from: DVec3, to: DVec3) -> DVec3 {
    DQuat::from_rotation_arc(from.normalize_or(DVec3::X), to.normalize_or(DVec3::X)).to_scaled_axis()
}
