//! Springs between two points, the springs of users and grasps, drives: rows that are implicit at both ends, whatever the ends are.
//!
//! In: what members see of springs on them, what drives them. Out: rows. Never here: contacts, links (`link.rs`), joints.
//! Theory: docs/theory/clusters.md, eq. 14.

use crate::AnchorSpring;
use crate::agent::tool_extrapolation_s;
use crate::constraint::{ConstraintRows, End, FineStep, Holders, Name, Pull, Slides};
use crate::member::memory::Partner;
use crate::member::participant::place_of;
use crate::member::{ClusterMember, MaterialPoint};
use crate::solve::{Hold, JointRow, Side, Spring};
use glam::{DQuat, DVec3};
use metachron_core::{AgentId, Anchor, Body, shortest_turn};

/// Keys of the rows of a tie: along the line between its ends, across it, and of turns.
const ALONG: u32 = 0;
const ACROSS: u32 = 1;
const TURN: u32 = 2;

impl ConstraintRows {
    /// Lays out the springs of users and grasps, and the drives.
    pub fn gather_springs(&mut self, step: &FineStep<'_, '_>) {
        for (member, one) in step.all.iter().enumerate() {
            let is_led = one.member.is_led();
            for (number, spring) in (0..).zip(one.context.anchor_springs()) {
                let led_by_user = spring.by.is_none() && is_led;
                if !led_by_user {
                    self.hold(step, member, &spring, number);
                }
            }
            self.drive(step, member);
        }
    }

    /// A spring of the user or of a grasp on `member`.
    fn hold(&mut self, step: &FineStep<'_, '_>, member: usize, spring: &AnchorSpring, number: u32) {
        let all = step.all;
        let Some(point) = all[member].member.anchor(spring.anchor) else { return };
        let by = spring.by.and_then(|by| place_of(all, by));
        let tip = by.and_then(|by| all[by].member.anchor(Anchor::Local(DVec3::ZERO)));
        let far = tip.unwrap_or_else(|| {
            let position = spring.target + spring.target_velocity * step.after_s;
            MaterialPoint::led(position, spring.target_velocity)
        });
        let hold = Holders { side_0: all[member].id, side_1: spring.by };
        let name = Name::lasting(member, Partner::Tie(number), Some(hold));
        let AnchorSpring { stiffness_n_m, damping_n_s_m, .. } = *spring;
        let pull = Pull { stiffness_n_m, damping_n_s_m, rest_m: 0.0 };
        let ends = [End { member: Some(member), point }, End { member: by.filter(|_| tip.is_some()), point: far }];
        self.spring(step, &ends, &pull, name);
        if let Some(by) = spring.by {
            self.hold_turn(step, by, &pull, name);
        }
    }

    /// The torsional spring by which jaws keep a body from turning between them.
    fn hold_turn(&mut self, step: &FineStep<'_, '_>, by: AgentId, pull: &Pull, name: Name) {
        let (all, member) = (step.all, name.member);
        let context = &all[member].context;
        let Some(mine) = all[member].member.pose(&[], 0.0) else { return };
        let Some(seen) = context.neighbours.iter().find(|other| other.id == by).map(|other| &other.snapshot) else {
            return;
        };
        let Body::Tool(tool) = &seen.body else { return };
        let Some(clasp) = tool.grasp.and_then(|grasp| grasp.orientation) else { return };
        let place = place_of(all, by);
        let (rotation, side, led_rad_s) = match place.and_then(|at| Some((at, all[at].member.pose(&[], 0.0)?))) {
            Some((at, pose)) => (pose.rotation, pose.turns.of_member(at), pose.led_rad_s),
            None => {
                let age_s = tool_extrapolation_s(context.time, seen.time) + step.after_s;
                (DQuat::from_scaled_axis(tool.spin * age_s) * tool.rotation, Side::FIXED, tool.spin)
            }
        };
        let square = clasp.arm_m * clasp.arm_m;
        let law = Spring {
            stiffness_n_m: pull.stiffness_n_m * square,
            damping_n_s_m: pull.damping_n_s_m * square,
            stretch_m: shortest_turn(rotation * clasp.rotation, mine.rotation),
        };
        let sides = [mine.turns.of_member(member), side];
        let row = JointRow::new(sides, Hold::ALL).with_spring(law, step.h_s);
        let row = JointRow { target_m_s: row.target_m_s + led_rad_s - mine.led_rad_s, ..row };
        let owner = Name { hold: None, ..name }.row(TURN, place);
        self.push(step, row, owner);
    }

    /// The drive of a member.
    fn drive(&mut self, step: &FineStep<'_, '_>, member: usize) {
        let Some(drive) = step.all[member].member.drive() else { return };
        let h_s = step.h_s;
        let law = Spring {
            stiffness_n_m: drive.stiffness_n_m,
            damping_n_s_m: drive.damping_n_s_m,
            stretch_m: drive.point.position - drive.target_m,
        };
        let sides = [drive.point.side.of_member(member), Side::FIXED];
        let row = JointRow::new(sides, Hold::All { limit_n_s: drive.limit_n * h_s }).with_spring(law, h_s);
        let target_m_s = row.target_m_s + drive.target_m_s - drive.point.led_m_s;
        let name = Name::lasting(member, Partner::Drive, None);
        self.push(step, JointRow { target_m_s, ..row }, name.row(ALONG, None));
    }

    /// A spring between two points: in all directions where it has no length of its own, else along the line between them. Where it is
    /// stretched, a turn of that line is taken back as well, with the stiffness that its tension gives: what is light would tremble.
    pub fn spring(&mut self, step: &FineStep<'_, '_>, ends: &[End; 2], pull: &Pull, name: Name) {
        let [a, b] = ends;
        let sides = [a.side(), b.side()];
        let apart = a.point.position - b.point.position;
        let led_m_s = b.point.led_m_s - a.point.led_m_s;
        let push = |constraints: &mut Self, key: u32, hold: Hold, law: Spring| {
            let row = JointRow::new(sides, hold.limited(name.yields.above_n * step.h_s)).with_spring(law, step.h_s);
            let row = JointRow { target_m_s: row.target_m_s + led_m_s, ..row };
            constraints.push(step, row, name.row(key, b.member))
        };
        let Pull { stiffness_n_m, damping_n_s_m, rest_m } = *pull;
        let axis = apart.try_normalize().unwrap_or(DVec3::Z);
        let stretch_m = apart - axis * rest_m;
        if rest_m == 0.0 {
            if push(self, ALONG, Hold::ALL, Spring { stiffness_n_m, damping_n_s_m, stretch_m: apart }) {
                self.spring_slides(step, pull, name, Slides::Point(name.yields.frame));
            }
            self.geometric_stiffness.note(step, ends, stretch_m * -stiffness_n_m, name);
            return;
        }
        if push(self, ALONG, Hold::along(axis), Spring { stiffness_n_m, damping_n_s_m, stretch_m }) {
            self.spring_slides(step, pull, name, Slides::Length { axis });
        }
        let stretched = 1.0 - rest_m / apart.length();
        if stretched > 0.0 {
            let law = Spring { stiffness_n_m: stiffness_n_m * stretched, damping_n_s_m: 0.0, stretch_m: DVec3::ZERO };
            push(self, ACROSS, Hold::across(axis), law);
        }
        self.geometric_stiffness.note(step, ends, stretch_m * -stiffness_n_m, name);
    }
}
