//! Joints as rows of constraints, with their errors.
//!
//! In: joints and the motions they hold. Out: for each row its direction, its law and how far it is from being kept.
//! Never here: the solve. The number and order of the rows depend on the joint alone.

use super::super::Held;
use super::super::member::Member;
use super::row::{Law, NOBODY, Row};
use crate::rigid::{Joint, JointKind};
use glam::{DQuat, DVec3};

/// A row and its error.
#[derive(Debug, Clone, Copy)]
pub(super) struct JointRow {
    /// The row; its bias is zero.
    pub row: Row,
    /// What u changes, metres or radians: zero, or for [`Law::AtLeast`] at least zero, where the joint is kept.
    pub error: f64,
    /// A spring's stiffness and damping, N/m and N·s/m.
    pub spring: Option<(f64, f64)>,
}

/// The two ends of a joint in world axes.
struct Ends {
    a: u32,
    b: u32,
    /// From each centre of mass to its anchor.
    arm_a: DVec3,
    arm_b: DVec3,
    /// From b's anchor to a's.
    apart: DVec3,
    turn_a: DQuat,
    turn_b: DQuat,
}

/// Below this distance a rope or spring has no direction, metres.
const LENGTH_MIN_M: f64 = 1e-9;

/// Appends the rows of every joint.
pub(super) fn rows(members: &[Member], held: &[Held], into: &mut Vec<JointRow>) {
    into.clear();
    for (a, b, joint) in held {
        let ends = Ends::of(members, *a, *b, joint);
        match joint.kind {
            JointKind::Fixed => {
                ends.meet(into);
                ends.keep_turned(joint.rest, into);
            }
            JointKind::Spherical => ends.meet(into),
            JointKind::Revolute { axis, range_rad } => {
                ends.meet(into);
                ends.hinge(joint.rest, (axis.normalize(), range_rad), into);
            }
            JointKind::Prismatic { axis, range_m } => {
                ends.slide((axis.normalize(), range_m), into);
                ends.keep_turned(joint.rest, into);
            }
            JointKind::Spring { stiffness_n_m, damping_n_s_m, rest_m } => {
                let (row, length) = ends.along();
                let spring = Some((stiffness_n_m, damping_n_s_m));
                into.push(JointRow { row: Row { law: Law::Spring(0.0), ..row }, error: length - rest_m, spring });
            }
            JointKind::Rope { length_m } => {
                let (row, length) = ends.along();
                let row = Row { lin: -row.lin, turn_a: -row.turn_a, turn_b: -row.turn_b, law: Law::AtLeast, ..row };
                into.push(JointRow { row, error: length_m - length, spring: None });
            }
        }
    }
}

impl Ends {
    fn of(members: &[Member], a: usize, b: Option<usize>, joint: &Joint) -> Self {
        let (of_a, of_b) = (&members[a], b.map(|b| &members[b]));
        let arm_a = of_a.motion.rotation * (joint.anchor_a_m - of_a.spread.com);
        let arm_b = of_b.map_or(DVec3::ZERO, |m| m.motion.rotation * (joint.anchor_b_m - m.spread.com));
        let at_b = of_b.map_or(joint.anchor_b_m, |m| m.motion.position + arm_b);
        Self {
            a: a as u32,
            b: b.map_or(NOBODY, |b| b as u32),
            arm_a,
            arm_b,
            apart: of_a.motion.position + arm_a - at_b,
            turn_a: of_a.motion.rotation,
            turn_b: of_b.map_or(DQuat::IDENTITY, |m| m.motion.rotation),
        }
    }

    fn row(&self, lin: DVec3, turn_a: DVec3, turn_b: DVec3, law: Law) -> Row {
        Row { a: self.a, b: self.b, lin, turn_a, turn_b, law, bias: 0.0, lambda: 0.0 }
    }

    /// The anchors are one point.
    fn meet(&self, into: &mut Vec<JointRow>) {
        for axis in DVec3::AXES {
            let row = self.row(axis, self.arm_a.cross(axis), self.arm_b.cross(axis), Law::Equal);
            into.push(JointRow { row, error: self.apart.dot(axis), spring: None });
        }
    }

    /// The anchors' distance: along the line between them.
    fn along(&self) -> (Row, f64) {
        let length = self.apart.length();
        let line = if length > LENGTH_MIN_M { self.apart / length } else { DVec3::ZERO };
        (self.row(line, self.arm_a.cross(line), self.arm_b.cross(line), Law::Equal), length)
    }

    /// No turning of b against a, whose axes then are `rest` apart.
    fn keep_turned(&self, rest: DQuat, into: &mut Vec<JointRow>) {
        let off = self.turn_b * (self.turn_a * rest.normalize()).conjugate();
        let off = if off.w < 0.0 { -off } else { off };
        let turned = DVec3::new(off.x, off.y, off.z) * 2.0;
        for axis in DVec3::AXES {
            let row = self.row(DVec3::ZERO, axis, axis, Law::Equal);
            into.push(JointRow { row, error: -turned.dot(axis), spring: None });
        }
    }

    /// Turning about `axis` (of a) alone, within the range.
    fn hinge(&self, rest: DQuat, (axis, range): (DVec3, Option<[f64; 2]>), into: &mut Vec<JointRow>) {
        let rest = rest.normalize();
        let axis_b = rest.conjugate() * axis;
        let (on_a, on_b) = (self.turn_a * axis, self.turn_b * axis_b);
        let bent = on_a.cross(on_b);
        let (first, second) = axis.any_orthonormal_pair();
        for across in [self.turn_a * first, self.turn_a * second] {
            let row = self.row(DVec3::ZERO, across, across, Law::Equal);
            into.push(JointRow { row, error: -bent.dot(across), spring: None });
        }
        let Some([low, high]) = range else { return };
        let relative = rest.conjugate() * self.turn_a.conjugate() * self.turn_b;
        let relative = if relative.w < 0.0 { -relative } else { relative };
        let about = DVec3::new(relative.x, relative.y, relative.z).dot(axis_b);
        let angle = 2.0 * libm::atan2(about, relative.w);
        let row = self.row(DVec3::ZERO, -on_a, -on_a, Law::AtLeast);
        into.push(JointRow { row, error: angle - low, spring: None });
        let row = self.row(DVec3::ZERO, on_a, on_a, Law::AtLeast);
        into.push(JointRow { row, error: high - angle, spring: None });
    }

    /// b's anchor stays on a's axis, within the range.
    fn slide(&self, (axis, range): (DVec3, Option<[f64; 2]>), into: &mut Vec<JointRow>) {
        // the line turns with a: its lever reaches to b's anchor
        let reach = self.arm_a - self.apart;
        let (first, second) = axis.any_orthonormal_pair();
        for across in [self.turn_a * first, self.turn_a * second] {
            let row = self.row(across, reach.cross(across), self.arm_b.cross(across), Law::Equal);
            into.push(JointRow { row, error: self.apart.dot(across), spring: None });
        }
        let Some([low, high]) = range else { return };
        let line = self.turn_a * axis;
        let along = -self.apart.dot(line);
        let row = self.row(-line, -reach.cross(line), -self.arm_b.cross(line), Law::AtLeast);
        into.push(JointRow { row, error: along - low, spring: None });
        let row = self.row(line, reach.cross(line), self.arm_b.cross(line), Law::AtLeast);
        into.push(JointRow { row, error: high - along, spring: None });
    }
}
