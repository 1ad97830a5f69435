//! Joints of rigid bodies as rows of the cluster's problem.
//!
//! In: the joints of a scene, poses of participants. Out: rows whose targets bring both bodies to where the joint holds them at the
//! end of the step, by the poses that they will then have. Never here: springs (`spring.rs`), contacts.
//!
//! A row knows velocities: held at zero, they let a turning body drift off by ω² h² of its arm in each step, and taking
//! that back costs energy. So a target contains how far the joint would be off after the step, for velocities near the
//! answer: those of the step before, then those of the answer itself, until the joint holds. Positions are kept as by
//! RATTLE (AND83): to second order, and a turning body keeps its energy. Theory: docs/theory/clusters.md, eq. 21.

mod mimic;
mod placed;

use crate::constraint::geometric_stiffness::Tie;
use crate::constraint::{ConstraintRows, FineStep, Pull, RowOwner, Slides};
use crate::detect::ClusterScene;
use crate::joint::{Joint, JointKind, Motor, MotorGoal};
use crate::lists::reset;
use crate::member::memory::Partner;
use crate::member::participant::{place_of, relative, velocity};
use crate::member::{Participant, Pose};
use crate::push_out::PUSH_OUT_MAX_M_S;
use crate::solve::{Hold, JointRow, Side, SideTerm, Spring};
use glam::{DQuat, DVec3};
use metachron_core::shortest_turn;
use metachron_geometry::narrow_phase::TouchKey;
use mimic::Mimicking;
use placed::{Jointed, Placed, Together};
use std::f64::consts::{PI, TAU};

/// A row that gave this share of the most that it may is not asked whether it holds.
const YIELDS_SHARE: f64 = 0.999;

/// The keys of the rows of a motor, of friction, of an armature and of a travel that follows another: above those of the rows that hold
/// their joint.
const MOTOR: u32 = 16;
const FRICTION: u32 = 17;
const ARMATURE: u32 = 18;
const MIMIC: u32 = 19;

/// The joints of a fine step.
#[derive(Debug, Default)]
pub(crate) struct Joints {
    /// Whether a motor keeps one of them moving.
    pub drives: bool,
    /// How many times as many fine steps are asked for by joints that do not hold, or in which bodies turn too far.
    pub ask: u32,
    /// Their miss when they last did not hold in this macro step, metres or radians.
    pub missed_m: f64,
    held: Vec<Held>,
    /// Their places by the numbers of the joints, where one of them follows another.
    by_number: Vec<usize>,
    parts: Vec<Part>,
    mimicking: Vec<Mimicking>,
    /// Where members that joints hold will be by the velocities that rows were aimed with last.
    poses: Vec<Option<Pose>>,
}

/// The impulse of a joint's motor and stops in a macro step, along the direction that the joint leaves free.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointTotal {
    /// The participant that is its first body.
    pub member: usize,
    /// Its number in the scene.
    pub joint: u32,
    /// Of the first body on the second, N·m·s of a hinge, N·s of a slide.
    pub impulse: f64,
}

/// A joint as it was laid out.
#[derive(Debug, Clone, Copy)]
struct Held {
    of: Jointed,
    /// The direction that it leaves free, world axes, of length 1.
    axis: DVec3,
    /// Its rows in the problem, from the first to past the last.
    rows: [usize; 2],
    /// How far it is off when the step begins, and the rotations of both.
    now: Off,
    rotations: [DQuat; 2],
}

/// How well joints hold with some velocities by the end of a fine step.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Aimed {
    /// The greatest miss of a joint, metres or radians.
    pub miss_m: f64,
    /// The greatest turn of a body in a joint.
    pub turn_rad: f64,
}

/// The part of a joint that a row holds.
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
    pub fn gather(&mut self, scene: &ClusterScene, step: &FineStep<'_, '_>, constraints: &mut ConstraintRows) {
        let FineStep { all, progress, .. } = *step;
        self.held.clear();
        self.parts.clear();
        self.mimicking.clear();
        self.drives = false;
        for (a, one) in all.iter().enumerate() {
            for (number, joint) in scene.joints_of(one.id) {
                if one.memory.has_torn(Partner::Joint(number)) {
                    continue;
                }
                let b = joint.b.map(|id| place_of(all, id));
                // a body that is not here cannot be held: clusters contain both
                let Some(b) = b.map_or(Some(None), |b| b.map(Some)) else { continue };
                let joint = one.memory.slipped(Partner::Joint(number)).joint(joint);
                let set = one.context.motors.iter().find(|set| set.joint == number);
                let joint = set.map_or(joint, |set| joint.with_motor(set.motor));
                self.hold(step, Jointed { number, joint, a, b }, constraints);
            }
        }
        self.lay_mimics(step, constraints);
        self.aim(all, constraints, |member| &progress[member].v_before[..], step.h_s);
    }

    /// Lays out one joint.
    fn hold(&mut self, step: &FineStep<'_, '_>, of: Jointed, constraints: &mut ConstraintRows) {
        let joint = of.joint;
        let Some(placed) = of.placed(step.all) else { return };
        let Placed { poses: [a, b], ends, axis, points, .. } = placed;
        if let JointKind::Spring { stiffness_n_m, damping_n_s_m, rest_m } = joint.kind {
            constraints.spring(step, &ends, &Pull { stiffness_n_m, damping_n_s_m, rest_m }, points.owner);
            return;
        }
        let as_before_n = step.all[of.a].memory.recall(points.owner.partner, TouchKey::default()).force_n;
        let (rows, rotations) = ([constraints.rows.len(); 2], [a.rotation, b.rotation]);
        self.held.push(Held { of, axis, rows, now: joint.off(&a, &b), rotations });
        self.lay(step, constraints, &placed);
        let rows = [rows[0], constraints.rows.len()];
        self.held.last_mut().into_iter().for_each(|held| held.rows = rows);
        let is_point = !matches!(joint.kind, JointKind::Rope { .. });
        let tie = Tie { ends: &ends, force_n: as_before_n, owner: points.owner, rows, is_point };
        constraints.geometric_stiffness.note(step, &tie);
        resist(step, constraints, &joint, &placed);
    }

    /// Lays out the rows of the joint that was noted last.
    fn lay(&mut self, step: &FineStep<'_, '_>, constraints: &mut ConstraintRows, placed: &Placed) {
        let at = self.held.len() - 1;
        let joint = self.held[at].of.joint;
        let Placed { axis, points, turns, .. } = *placed;
        let (mut key, mut driven) = (0, None);
        let mut push = |way: Way, of: Together, hold: Hold| {
            let (row, owner) = (constraints.rows.len(), RowOwner { key, ..of.owner });
            key += 1;
            let hold = hold.limited(owner.yields_above_n * step.h_s);
            if constraints.push(step, JointRow::new(of.sides, hold), owner) {
                self.parts.push(Part { held: at, row, way });
                let slides = match (joint.kind, hold) {
                    (JointKind::Rope { .. }, Hold::Along { axis, .. }) => Slides::Length { axis: -axis },
                    _ => Slides::Point(owner.frame),
                };
                constraints.slides(slides, step.h_s, step.joint_miss_m);
            }
        };
        match joint.kind {
            JointKind::Fixed => {
                push(Way::Point, points, Hold::ALL);
                push(Way::Turn, turns, Hold::ALL);
            }
            JointKind::Revolute { range_rad, motor, .. } => {
                driven = motor;
                push(Way::Point, points, Hold::ALL);
                push(Way::Turn, turns, Hold::across(axis));
                if let Some([low, high]) = range_rad {
                    push(Way::Above(low), turns, Hold::pushing(-axis));
                    push(Way::Below(high), turns, Hold::pushing(axis));
                }
            }
            JointKind::Spherical => push(Way::Point, points, Hold::ALL),
            JointKind::Prismatic { range_m, motor, .. } => {
                driven = motor;
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
        if let Some(motor) = driven {
            self.drive(step, constraints, &motor, placed.free(&joint));
        }
    }

    /// Lays out the row of a motor of the joint noted last. A push that moves b forward pushes a back.
    fn drive(&mut self, step: &FineStep<'_, '_>, constraints: &mut ConstraintRows, motor: &Motor, of: Together) {
        let Some(Held { of: Jointed { joint, .. }, axis, now, .. }) = self.held.last().copied() else { return };
        self.drives |= motor.moves();
        let h_s = step.h_s;
        let row = JointRow::new(of.sides, Hold::motor(axis, motor.max_effort * h_s));
        let row = match motor.goal {
            MotorGoal::Velocity(velocity) => JointRow { target_m_s: axis * -velocity, ..row },
            MotorGoal::Spring { position, velocity: wanted, stiffness, damping } => {
                let off = now.travel - position;
                // angles are known but for whole turns
                let is_hinge = matches!(joint.kind, JointKind::Revolute { .. });
                let off = if is_hinge { off - (off / TAU).round() * TAU } else { off };
                let law = Spring { stiffness_n_m: stiffness, damping_n_s_m: damping, stretch_m: axis * -off };
                let row = row.with_spring(law, h_s);
                let compliance = row.compliance_per_kg.unwrap_or(0.0);
                // a motion that steps resolve need not be damped (eq. 22b)
                let stiff = h_s * h_s * stiffness;
                let before = |member: usize| &step.progress[member].v_before[..];
                let [of_a, of_b] = of.sides.map(|side| velocity(&side, before).dot(axis));
                let of_bodies: f64 = of.sides.iter().map(|side| own_inverse_mass(step.all, side, axis)).sum();
                let inverse_mass = of_bodies / (1.0 + joint.armature * of_bodies);
                let kept = (of_b - of_a) * stiff / (1.0 + stiff * inverse_mass);
                let target_m_s = row.target_m_s - axis * ((wanted * h_s * damping + kept) * compliance);
                JointRow { target_m_s, ..row }
            }
        };
        constraints.push(step, row, RowOwner { key: MOTOR, owes: row.compliance_per_kg.is_none(), ..of.owner });
    }

    /// Adds to `totals` the impulses of motors and stops on b against a, along the directions that their joints leave
    /// free.
    pub fn note_efforts(&self, constraints: &ConstraintRows, rows_n_s: &[DVec3], totals: &mut Vec<JointTotal>) {
        for held in self.held.iter().filter(|held| held.of.joint.takes_motor()) {
            let rows = held.rows[0]..held.rows[1];
            let along = rows.filter(|row| matches!(constraints.rows[*row].hold, Hold::Along { .. }));
            let given = along.map(|row| -rows_n_s[row].dot(held.axis)).fold(0.0, |sum, given| sum + given);
            let Jointed { a: member, number: joint, .. } = held.of;
            match totals.iter_mut().find(|total| total.joint == joint) {
                Some(total) => total.impulse += given,
                None => totals.push(JointTotal { member, joint, impulse: given }),
            }
        }
    }

    /// Sets the targets of all rows so that joints hold at the end of the step, to the first order about `velocities` of members.
    /// Returns how well they would hold with these velocities themselves.
    pub fn aim<'v>(
        &mut self,
        all: &[Participant<'_>],
        constraints: &mut ConstraintRows,
        velocities: impl Fn(usize) -> &'v [DVec3],
        h_s: f64,
    ) -> Aimed {
        let Self { held, parts, mimicking, poses, .. } = self;
        reset(poses, all.len(), None);
        for member in held.iter().flat_map(|held| [Some(held.of.a), held.of.b]).flatten() {
            poses[member] = poses[member].or_else(|| all[member].member.pose(velocities(member), h_s));
        }
        let mut aimed = Aimed::default();
        let mut then = None;
        for part in &*parts {
            let held = &held[part.held];
            let off = match then {
                Some((at, off)) if at == part.held => off,
                _ => {
                    let (off, turn_rad) = held.after(poses);
                    aimed.turn_rad = aimed.turn_rad.max(turn_rad);
                    off
                }
            };
            then = Some((part.held, off));
            let row = &mut constraints.rows[part.row];
            let wanted = part.way.wanted(part.way.off(&held.now, row), row, h_s);
            let miss = part.way.off(&off, row) - wanted;
            row.target_m_s = relative(&row.sides, &velocities) - miss / h_s;
            // one that gives all that it may holds nowhere
            if !row.gives_all(row.warm_n_s, YIELDS_SHARE) {
                aimed.miss_m = aimed.miss_m.max(part.way.missed(miss, row));
            }
        }
        for mimic in &*mimicking {
            let row = &mut constraints.rows[mimic.row];
            let miss = mimic.miss(held, poses, h_s);
            row.target_m_s = relative(&row.sides, &velocities) - DVec3::X * (miss / h_s);
            aimed.miss_m = aimed.miss_m.max(miss.abs());
        }
        aimed
    }
}

/// Lays out the friction of a joint and its armature between the sides that its motor would drive.
fn resist(step: &FineStep<'_, '_>, constraints: &mut ConstraintRows, joint: &Joint, placed: &Placed) {
    let Together { sides, owner } = placed.free(joint);
    let hold = if joint.kind == JointKind::Spherical { Hold::ALL } else { Hold::along(placed.axis) };
    if joint.friction > 0.0 {
        let row = JointRow::new(sides, hold.limited(joint.friction * step.h_s));
        constraints.push(step, row, RowOwner { key: FRICTION, owes: true, ..owner });
    }
    if joint.armature > 0.0 {
        let target_m_s = relative(&sides, |member| &step.progress[member].v_before);
        let compliance_per_kg = Some(joint.armature.recip());
        let row = JointRow { target_m_s, compliance_per_kg, ..JointRow::new(sides, hold) };
        constraints.push(step, row, RowOwner { key: ARMATURE, ..owner });
    }
}

impl Motor {
    /// Whether it keeps its joint moving.
    fn moves(&self) -> bool {
        matches!(self.goal, MotorGoal::Velocity(velocity) | MotorGoal::Spring { velocity, .. } if velocity != 0.0)
    }
}

impl Held {
    /// How far it is off once its bodies have moved on to `poses` of members, and by how much one of them has turned then.
    fn after(&self, poses: &[Option<Pose>]) -> (Off, f64) {
        let at = |member: usize| poses[member];
        let Jointed { joint, a, b, .. } = self.of;
        let (Some(a), Some(b)) = (at(a), b.map_or(Some(Pose::WORLD), at)) else { return (self.now, 0.0) };
        let turned = [&a, &b].into_iter().zip(self.rotations).map(|(then, now)| then.rotation.angle_between(now));
        let turn_rad = turned.fold(0.0, f64::max);
        let mut off = joint.off(&a, &b);
        if matches!(joint.kind, JointKind::Revolute { .. }) {
            // angles are known but for whole turns
            off.travel += ((self.now.travel - off.travel) / TAU).round() * TAU;
        }
        (off, turn_rad)
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

    /// The part of a miss that counts: in directions in which the row holds, and of a stop the way beyond it.
    fn missed(self, miss: DVec3, row: &JointRow) -> f64 {
        match row.hold {
            Hold::All { .. } => miss.length(),
            Hold::Across { axis, .. } => (miss - axis * miss.dot(axis)).length(),
            Hold::Along { axis, .. } => (-miss.dot(axis)).max(0.0),
        }
    }
}

impl Joint {
    /// How far b has moved from a in the way that the joint leaves free, from its zero: rad within −π … π, metres; of springs and ropes the
    /// distance of the anchors.
    #[must_use]
    pub fn travel(&self, a: &Pose, b: &Pose) -> f64 {
        self.off(a, b).travel
    }

    /// How far the joint is off where its bodies are in these poses.
    fn off(&self, a: &Pose, b: &Pose) -> Off {
        let apart = a.place(self.anchor_a_m) - b.place(self.anchor_b_m);
        let at_zero = (a.rotation * self.rest.normalize()).normalize();
        match self.kind {
            JointKind::Fixed => Off { point: apart, turn: shortest_turn(b.rotation, at_zero), travel: 0.0 },
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
                Off { point: apart + axis * travel, turn: shortest_turn(b.rotation, at_zero), travel }
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
    #[must_use]
    pub fn place(&self, local_m: DVec3) -> DVec3 {
        self.origin_m + self.rotation * local_m
    }
}

/// The inverse mass of a side along an axis where nothing but its member's own blocks resists, 1/kg, or 1/(kg m²) of a turn.
fn own_inverse_mass(all: &[Participant<'_>], side: &Side, axis: DVec3) -> f64 {
    let of = |term: &SideTerm| {
        let mut blocks = all[side.member].member.system().blocks.iter();
        let block = blocks.find(|block| block.row == term.block && block.column == term.block)?;
        let given = term.map.transpose() * axis;
        Some(given.dot(block.value.inverse() * given))
    };
    side.terms().iter().filter_map(of).sum()
}

/// The turn that leads from one direction to another, as a rotation vector.
fn tilt(from: DVec3, to: DVec3) -> DVec3 {
    DQuat::from_rotation_arc(from.normalize_or(DVec3::X), to.normalize_or(DVec3::X)).to_scaled_axis()
}
