//! Attachments along the tube, as springs at its nodes.
//!
//! In: specs. Out: forces and stiffnesses at nodes, implicit in the step. Never here: clamps and pins (they are
//! not springs: their slots are removed from the system). Theory: docs/theory/rod.md, eq. 21–24.

use super::discretization::Discretization;
use super::spec::Attachment;
use super::sym3::Sym3;
use glam::DVec3;
use metachron_contact::member::Slid;

/// The spring of an attachment at one node.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
pub struct NodeSpring {
    /// Number of the attachment.
    pub attachment: u32,
    /// Index of the node.
    pub node: usize,
    /// Rest arc length of the node, metres.
    arc_m: f64,
    /// Rest position of the node, metres.
    anchor: DVec3,
    /// N/m.
    pub stiffness: f64,
    /// N·s/m, while the spring is taut.
    pub damping: f64,
    /// Metres.
    slack: f64,
    /// The most that it gives in a cluster, N; infinite where it never yields.
    pub yields_above_n: f64,
    /// How far it has slipped.
    pub slid: Slid,
}

/// A spring linearised about a point: f(x) ≈ force − stiffness (x − point).
#[derive(Debug, Clone, Copy, Default)]
pub struct Linear {
    /// Force at the point, N.
    pub force: DVec3,
    /// Minus its derivative, N/m.
    pub stiffness: Sym3,
    /// N·s/m.
    pub damping: f64,
}

impl NodeSpring {
    /// Whether it yields, and so is a row of its cluster's problem.
    pub fn yields(&self) -> bool {
        self.yields_above_n < f64::INFINITY
    }

    /// Where it holds its node, metres.
    pub fn place(&self) -> DVec3 {
        self.anchor + self.slid.moved_m
    }

    /// The distance within which it gives nothing, metres.
    pub fn slack(&self) -> f64 {
        self.slack + self.slid.longer_m
    }

    /// The spring linearised about `point` (eq. 21, 22); zero while it is slack.
    pub fn linear(&self, point: DVec3) -> Linear {
        let (d, slack) = (point - self.place(), self.slack());
        let distance = d.length();
        if distance < slack || (distance == 0.0 && slack > 0.0) {
            return Linear::default();
        }
        if slack == 0.0 {
            let stiffness = Sym3::identity(self.stiffness);
            return Linear { force: d * -self.stiffness, stiffness, damping: self.damping };
        }
        let share = 1.0 - slack / distance;
        let across = Sym3::identity(self.stiffness * share);
        let along = Sym3::outer(d / distance, self.stiffness * (1.0 - share));
        Linear { force: d * (-self.stiffness * share), stiffness: across + along, damping: self.damping }
    }

    /// Force on the node at `x` with the velocity `v`, N.
    pub fn force(&self, x: DVec3, v: DVec3) -> DVec3 {
        let Linear { force, damping, .. } = self.linear(x);
        force - v * damping
    }

    /// Energy in the spring, J.
    pub fn energy_j(&self, x: DVec3) -> f64 {
        let beyond = ((x - self.place()).length() - self.slack()).max(0.0);
        0.5 * self.stiffness * beyond * beyond
    }
}

/// Lists the springs of `attachments`, by their numbers, at the nodes of `division`: each node takes the share of its dual length (eq. 23) of
/// stiffness, damping and the force that it yields at. Springs that yield come last.
pub fn springs<'a>(
    attachments: impl Iterator<Item = (u32, &'a Attachment)>,
    division: &Discretization,
    into: &mut Vec<NodeSpring>,
) {
    into.clear();
    let (total, count) = (division.total_m(), division.segments());
    for (number, attachment) in attachments {
        let held = attachment.to - attachment.from;
        for node in 0..=count {
            let from = if node == 0 { 0.0 } else { division.middle_m(node - 1) };
            let to = if node == count { total } else { division.middle_m(node) };
            let overlap = to.min(attachment.to * total) - from.max(attachment.from * total);
            if overlap > 0.0 {
                into.push(NodeSpring {
                    attachment: number,
                    node,
                    arc_m: division.arc_m[node],
                    anchor: division.place[node],
                    stiffness: attachment.stiffness_n_m2 * overlap,
                    damping: attachment.damping_n_s_m2 * overlap,
                    slack: attachment.slack_m,
                    yields_above_n: attachment.yields_above_n * overlap / (held * total),
                    slid: Slid::default(),
                });
            }
        }
    }
    into.sort_by_key(NodeSpring::yields);
}

/// Gives springs the slips of the springs that held the same stretches before, linear along each between its nodes.
pub fn carry_slips(before: &[NodeSpring], into: &mut [NodeSpring]) {
    for spring in into.iter_mut().filter(|spring| spring.yields()) {
        let same = || before.iter().filter(|other| other.attachment == spring.attachment);
        let left = same().rfind(|other| other.arc_m <= spring.arc_m);
        let right = same().find(|other| other.arc_m > spring.arc_m);
        spring.slid = match (left, right) {
            (Some(left), Some(right)) => {
                let share = (spring.arc_m - left.arc_m) / (right.arc_m - left.arc_m);
                let [a, b] = [left.slid, right.slid];
                let longer_m = a.longer_m * (1.0 - share) + b.longer_m * share;
                Slid { moved_m: a.moved_m.lerp(b.moved_m, share), longer_m }
            }
            (Some(one), None) | (None, Some(one)) => one.slid,
            (None, None) => Slid::default(),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rod::rest_curve::RestCurve;

    fn line() -> Discretization {
        Discretization::first(&RestCurve::new(&[DVec3::ZERO, DVec3::X]), 7)
    }

    #[test]
    fn the_springs_of_a_stretch_sum_to_its_stiffness() {
        let stretch = Attachment {
            from: 0.13,
            to: 0.71,
            stiffness_n_m2: 50.0,
            slack_m: 0.0,
            damping_n_s_m2: 0.0,
            tears_above_n: f64::INFINITY,
            yields_above_n: f64::INFINITY,
        };
        let mut list = vec![];
        springs(std::iter::once((0, &stretch)), &line(), &mut list);
        let sum: f64 = list.iter().map(|s| s.stiffness).sum();
        assert!((sum - 50.0 * 0.58).abs() < 1e-13); // seven rounding errors of 29
    }

    #[test]
    fn a_slack_spring_does_nothing_and_a_taut_one_pulls_beyond_its_slack() {
        let stretch = Attachment {
            from: 0.0,
            to: 1.0,
            stiffness_n_m2: 70.0,
            slack_m: 0.1,
            damping_n_s_m2: 0.0,
            tears_above_n: f64::INFINITY,
            yields_above_n: f64::INFINITY,
        };
        let mut list = vec![];
        springs(std::iter::once((0, &stretch)), &line(), &mut list);
        let spring = list[3];
        assert_eq!(spring.linear(spring.anchor + DVec3::Y * 0.09).force, DVec3::ZERO);
        let at = spring.anchor + DVec3::new(0.0, 0.3, 0.4);
        let linear = spring.linear(at);
        assert!((linear.force + DVec3::new(0.0, 0.6, 0.8) * (10.0 * 0.4)).length() < 1e-13);
        // minus the derivative, by central differences: second order in 1e-6
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let slope = (spring.linear(at + axis * 1e-6).force - spring.linear(at - axis * 1e-6).force) / 2e-6;
            assert!((slope + linear.stiffness * axis).length() < 1e-7);
        }
    }
}
