//! Checks that joints can hold: each with its objects as they start, and all joints of one pair together.

use super::joint::End;
use super::joint_keys::Leaves;
use crate::check::{Checker, Place};
use glam::DVec3;
use metachron_core::AgentId;
use metachron_models::rigid::JOINT_GAP_MAX_M as GAP_MAX_M;
use std::collections::BTreeMap;

/// Directions that differ by less than this are one direction: sine of the angle.
const SAME_DIRECTION: f64 = 1e-3;

/// A joint while it is checked, in world coordinates at the start.
#[derive(Debug, Clone)]
pub(super) struct Held {
    pub(super) place: Place,
    /// The ends `a` and `b`.
    pub(super) ends: [End; 2],
    /// The anchors on `a` and `b`, in the world.
    pub(super) anchors: [DVec3; 2],
    pub(super) leaves: Leaves,
    pub(super) collide: bool,
}

impl Held {
    /// The axis of a turn or slide in the world; zero for other kinds.
    pub(super) fn axis(&self) -> DVec3 {
        match self.leaves {
            Leaves::Turn { axis, .. } | Leaves::Slide { axis, .. } => self.ends[0].rotation * axis,
            _ => DVec3::ZERO,
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

/// Reports anchors that start where the joint cannot hold them; returns whether it can.
pub(super) fn check_start(c: &mut Checker<'_, '_>, held: &Held) -> bool {
    let apart = held.anchors[1] - held.anchors[0];
    let along = apart.dot(held.axis());
    let (key, what, expected) = match held.leaves {
        Leaves::Spring { .. } => return true,
        Leaves::Rope { length_m } => match length_m {
            Some(length) if apart.length() > length + GAP_MAX_M => (
                "length_m",
                format!("is {length}, but its ends start {:.4} m apart", apart.length()),
                "expected a length of at least that".to_owned(),
            ),
            _ => return true,
        },
        Leaves::Slide { .. } if (apart - along * held.axis()).length() > GAP_MAX_M => (
            "at_b_m",
            format!("starts {:.4} m beside the axis through `at_a_m`", (apart - along * held.axis()).length()),
            format!("expected at most {GAP_MAX_M} m"),
        ),
        Leaves::Slide { range_m: Some([least, greatest]), .. }
            if !(least - GAP_MAX_M..=greatest + GAP_MAX_M).contains(&along) =>
        {
            let what = format!("is [{least}, {greatest}], but the objects start at {along:.4} m");
            ("range_m", what, "expected a range with that among it".to_owned())
        }
        Leaves::Slide { .. } => return true,
        Leaves::Nothing | Leaves::Turn { .. } | Leaves::Turns if apart.length() > GAP_MAX_M => (
            "at_b_m",
            format!("starts {:.4} m from where `at_a_m` is", apart.length()),
            format!("expected the same point of space, within {GAP_MAX_M} m; without `at_b_m` it is"),
        ),
        Leaves::Nothing | Leaves::Turn { .. } | Leaves::Turns => return true,
    };
    c.wrong(&held.place, key, what, expected);
    false
}

/// Reports joints of one pair that together leave less free than each of them should.
pub(super) fn contradictions(c: &mut Checker<'_, '_>, all: &[Held]) {
    let mut pairs: BTreeMap<_, Vec<&Held>> = BTreeMap::new();
    for held in all {
        let before = pairs.entry(held.pair()).or_default();
        if let Some(why) = before.iter().find_map(|other| contradiction(other, held)) {
            let expected = "expected joints of one pair that leave something free together, or one `fixed` joint";
            c.wrong(&held.place, "kind", why, expected);
        }
        before.push(held);
    }
}

/// Why two joints of the same pair contradict each other.
fn contradiction(first: &Held, second: &Held) -> Option<&'static str> {
    use Leaves::{Nothing, Rope, Slide, Spring, Turn, Turns};
    match (first.leaves, second.leaves) {
        (Nothing, Nothing) => Some("holds a pair that a fixed joint holds already"),
        (Nothing, _) | (_, Nothing) => Some("contradicts the fixed joint of the same pair, which leaves nothing free"),
        (Turn { .. }, Turn { .. }) => {
            let one_line = first.is_parallel(second) && first.line_passes(second.anchors[0]);
            (!one_line)
                .then_some("turns about another line than the revolute joint of the same pair: together they are fixed")
        }
        (Slide { .. }, Slide { .. }) => (!first.is_parallel(second))
            .then_some("slides along another axis than the prismatic joint of the same pair: together they are fixed"),
        (Turns, Turn { .. }) => (!second.line_passes(first.anchors[0])).then_some(OFF_THE_LINE),
        (Turn { .. }, Turns) => (!first.line_passes(second.anchors[0])).then_some(OFF_THE_LINE),
        (Turn { .. } | Turns, Slide { .. }) | (Slide { .. }, Turn { .. } | Turns) => Some(
            "contradicts the other joint of the same pair: one turns where the other slides, together they are fixed",
        ),
        (Turns, Turns) | (Spring { .. } | Rope { .. }, _) | (_, Spring { .. } | Rope { .. }) => None,
    }
}

const OFF_THE_LINE: &str = "holds a point beside the axis of the pair's revolute joint: together they are fixed";
