//! Checks that joints can hold: each with its objects as they start, and all joints of one pair together.

use super::force_limits::ForceLimits;
use super::joint::End;
use crate::check::{Checker, Place};
use glam::DVec3;
use metachron_core::{AgentId, DisjointSets};
use metachron_models::rigid::{JOINT_GAP_MAX_M as GAP_MAX_M, JointKind, Mimic};
use std::collections::BTreeMap;

/// Directions that differ by less than this are one direction: sine of the angle.
const SAME_DIRECTION: f64 = 1e-3;

/// A joint while it is checked, in world coordinates at the start.
#[derive(Debug, Clone)]
pub(super) struct PlacedJoint {
    pub(super) place: Place,
    /// The ends `a` and `b`.
    pub(super) ends: [End; 2],
    /// The anchors on `a` and `b`, in the world.
    pub(super) anchors: [DVec3; 2],
    pub(super) free_motion: JointKind,
    pub(super) collide: bool,
    pub(super) limits: ForceLimits,
    /// Of a hinge or slide.
    pub(super) friction: f64,
    pub(super) armature: f64,
    /// The joint that it follows; its offset is none until all joints are placed.
    pub(super) mimic: Option<Mimic>,
}

impl PlacedJoint {
    /// The axis of a turn or slide in the world; zero for other kinds.
    pub(super) fn axis(&self) -> DVec3 {
        match self.free_motion {
            JointKind::Revolute { axis, .. } | JointKind::Prismatic { axis, .. } => self.ends[0].rotation * axis,
            _ => DVec3::ZERO,
        }
    }

    /// How far a turn or slide has gone from its zero at the start, rad or m.
    fn travel(&self) -> f64 {
        match self.free_motion {
            JointKind::Prismatic { .. } => (self.anchors[1] - self.anchors[0]).dot(self.axis()),
            _ => 0.0,
        }
    }

    fn pair(&self) -> (Option<AgentId>, Option<AgentId>) {
        let [a, b] = self.ends.map(|end| end.agent);
        (a.min(b), a.max(b))
    }

    /// Whether `point` is on the line of this joint's axis.
    fn line_passes(&self, point: DVec3) -> bool {
        (point - self.anchors[0]).reject_from_normalized(self.axis()).length() <= GAP_MAX_M
    }

    fn is_parallel(&self, other: &Self) -> bool {
        self.axis().cross(other.axis()).length() <= SAME_DIRECTION
    }
}

/// Ties joints to those that they follow, where both are at the start, and reports the last joint of each ring of joints that follow each
/// other: `all` are all joints of the scene.
pub(super) fn tie_mimics(c: &mut Checker<'_, '_>, all: &mut [PlacedJoint]) {
    let mut tied = DisjointSets::of(all.len());
    for (own, joint) in all.iter().enumerate() {
        if joint.mimic.is_some_and(|mimic| !tied.join(own, mimic.joint as usize)) {
            let what = "is a joint that follows this one in turn";
            c.wrong(
                &joint.place.table("mimic"),
                "joint",
                what,
                "expected a joint that moves by itself, or follows another one",
            );
        }
    }
    let travels: Vec<f64> = all.iter().map(PlacedJoint::travel).collect();
    for (joint, travel) in all.iter_mut().zip(&travels) {
        if let Some(mimic) = &mut joint.mimic {
            mimic.offset = travel - mimic.ratio * travels[mimic.joint as usize];
            if !Mimic::OFFSET.contains(mimic.offset) {
                let what = format!("puts the two {:e} apart where they start", mimic.offset);
                let expected = format!("expected {:e} at most", Mimic::OFFSET.greatest);
                c.wrong(&joint.place.table("mimic"), "ratio", what, expected);
            }
        }
    }
}

/// Reports anchors that start where the joint cannot hold them; returns whether it can.
pub(super) fn check_start(c: &mut Checker<'_, '_>, joint: &PlacedJoint) -> bool {
    let apart = joint.anchors[1] - joint.anchors[0];
    let along = apart.dot(joint.axis());
    let (key, what, expected) = match joint.free_motion {
        JointKind::Spring { .. } => return true,
        JointKind::Rope { length_m } if apart.length() > length_m + GAP_MAX_M => (
            "length_m",
            format!("is {length_m}, but its ends start {:.4} m apart", apart.length()),
            "expected a length of at least that".to_owned(),
        ),
        JointKind::Rope { .. } => return true,
        JointKind::Prismatic { .. } if (apart - along * joint.axis()).length() > GAP_MAX_M => (
            "at_b_m",
            format!("is {:.4} m off the axis through `at_a_m` at the start", (apart - along * joint.axis()).length()),
            format!("expected at most {GAP_MAX_M} m"),
        ),
        JointKind::Prismatic { range_m: Some([least, greatest]), .. }
            if !(least - GAP_MAX_M..=greatest + GAP_MAX_M).contains(&along) =>
        {
            let what = format!("is [{least}, {greatest}], but the objects start at {along:.4} m");
            ("range_m", what, "expected a range that contains that position".to_owned())
        }
        JointKind::Prismatic { .. } => return true,
        JointKind::Fixed | JointKind::Revolute { .. } | JointKind::Spherical if apart.length() > GAP_MAX_M => (
            "at_b_m",
            format!("is {:.4} m away from `at_a_m` at the start", apart.length()),
            format!("expected the same point of space, within {GAP_MAX_M} m, which is the default"),
        ),
        JointKind::Fixed | JointKind::Revolute { .. } | JointKind::Spherical => return true,
    };
    c.wrong(&joint.place, key, what, expected);
    false
}

/// Reports joints of one pair that together leave less free than each of them should.
pub(super) fn contradictions(c: &mut Checker<'_, '_>, all: &[PlacedJoint]) {
    let mut pairs: BTreeMap<_, Vec<&PlacedJoint>> = BTreeMap::new();
    for joint in all {
        let before = pairs.entry(joint.pair()).or_default();
        if let Some(why) = before.iter().find_map(|other| contradiction(other, joint)) {
            let expected = "expected joints of one pair that together leave a degree of freedom, or one `fixed` joint";
            c.wrong(&joint.place, "kind", why, expected);
        }
        before.push(joint);
    }
}

/// Why two joints of the same pair contradict each other.
fn contradiction(first: &PlacedJoint, second: &PlacedJoint) -> Option<&'static str> {
    use JointKind::{Fixed, Prismatic, Revolute, Rope, Spherical, Spring};
    match (first.free_motion, second.free_motion) {
        (Fixed, Fixed) => Some("connects a pair that a fixed joint connects already"),
        (Fixed, _) | (_, Fixed) => {
            Some("contradicts the fixed joint of the same pair, which leaves no degree of freedom")
        }
        (Revolute { .. }, Revolute { .. }) => {
            let one_line = first.is_parallel(second) && first.line_passes(second.anchors[0]);
            (!one_line).then_some(
                "rotates about another axis than the revolute joint of the same pair: together they allow no motion",
            )
        }
        (Prismatic { .. }, Prismatic { .. }) => (!first.is_parallel(second)).then_some(
            "slides along another axis than the prismatic joint of the same pair: together they allow no motion",
        ),
        (Spherical, Revolute { .. }) => (!second.line_passes(first.anchors[0])).then_some(OFF_THE_LINE),
        (Revolute { .. }, Spherical) => (!first.line_passes(second.anchors[0])).then_some(OFF_THE_LINE),
        (Revolute { .. } | Spherical, Prismatic { .. }) | (Prismatic { .. }, Revolute { .. } | Spherical) => Some(
            "contradicts the other joint of the same pair: one rotates, the other slides, and together they allow no motion",
        ),
        (Spherical, Spherical) | (Spring { .. } | Rope { .. }, _) | (_, Spring { .. } | Rope { .. }) => None,
    }
}

const OFF_THE_LINE: &str = "fixes a point off the axis of the pair's revolute joint: together they allow no motion";
