//! Springs between two points: of users and grasps, drives, links between agents, a member's own springs to the world that yield. All are rows that
//! are implicit at both ends, whatever the ends are.
//!
//! In: springs and links on members as they see them, drives, members' own springs. Out: rows. Never here: contacts, joints,
//! links by wave variables, springs that never yield (a part of their member's matrix).
//! Theory: docs/theory/clusters.md, eq. 14 and 29; docs/theory/rod.md, eq. 21.

use crate::AnchorSpring;
use crate::agent::{Law, Link, tool_extrapolation_s};
use crate::constraint::geometric_stiffness::Tie;
use crate::constraint::{ConstraintRows, End, FineStep, Frame, Holders, Pull, RowOwner, Slides};
use crate::member::memory::Partner;
use crate::member::participant::place_of;
use crate::member::{MaterialPoint, OwnSpring, Participant};
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
        let AnchorSpring { stiffness_n_m, damping_n_s_m, .. } = *spring;
        let pull = Pull { stiffness_n_m, damping_n_s_m, rest_m: 0.0 };
        let other = by.filter(|_| tip.is_some());
        let owner = RowOwner { hold: Some(hold), ..RowOwner::new(member, other, Partner::Tie(number)) };
        let ends = [End { member: Some(member), point }, End { member: other, point: far }];
        self.spring(step, &ends, &pull, owner);
        if let Some(by) = spring.by {
            self.hold_turn(step, by, &pull, owner);
        }
    }

    /// The torsional spring by which jaws keep a body from turning between them.
    fn hold_turn(&mut self, step: &FineStep<'_, '_>, by: AgentId, pull: &Pull, owner: RowOwner) {
        let (all, member) = (step.all, owner.member);
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
        self.push(step, row, RowOwner { key: TURN, other: place, hold: None, ..owner });
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
        self.push(step, JointRow { target_m_s, ..row }, RowOwner::new(member, None, Partner::Drive));
    }

    /// A spring between two points: in all directions where it has no length of its own, else along the line between them. Where it is
    /// stretched, a turn of that line is taken back as well, with the stiffness that its tension gives: a light body would jitter.
    pub fn spring(&mut self, step: &FineStep<'_, '_>, ends: &[End; 2], pull: &Pull, owner: RowOwner) {
        let [a, b] = ends;
        let sides = [a.side(), b.side()];
        let apart = a.point.position - b.point.position;
        let led_m_s = b.point.led_m_s - a.point.led_m_s;
        let first = self.rows.len();
        let push = |constraints: &mut Self, key: u32, hold: Hold, law: Spring| {
            let row = JointRow::new(sides, hold.limited(owner.yields_above_n * step.h_s)).with_spring(law, step.h_s);
            let row = JointRow { target_m_s: row.target_m_s + led_m_s, ..row };
            constraints.push(step, row, RowOwner { key, ..owner })
        };
        let Pull { stiffness_n_m, damping_n_s_m, rest_m } = *pull;
        let axis = apart.try_normalize().unwrap_or(DVec3::Z);
        let stretch_m = apart - axis * rest_m;
        if rest_m == 0.0 {
            if push(self, ALONG, Hold::ALL, Spring { stiffness_n_m, damping_n_s_m, stretch_m }) {
                self.spring_slides(step, pull, Slides::Point(owner.frame));
            }
        } else {
            if push(self, ALONG, Hold::along(axis), Spring { stiffness_n_m, damping_n_s_m, stretch_m }) {
                self.spring_slides(step, pull, Slides::Length { axis });
            }
            let stretched = 1.0 - rest_m / apart.length();
            if stretched > 0.0 {
                let stiffness_n_m = stiffness_n_m * stretched;
                let law = Spring { stiffness_n_m, damping_n_s_m: 0.0, stretch_m: DVec3::ZERO };
                push(self, ACROSS, Hold::across(axis), law);
            }
        }
        let rows = [first, self.rows.len()];
        self.geometric_stiffness
            .note(step, &Tie { ends, force_n: stretch_m * -stiffness_n_m, owner, rows, is_point: false });
    }

    /// Lays out all links. Both agents see a link: of two participants the lower number takes it.
    pub fn gather_links(&mut self, step: &FineStep<'_, '_>) {
        let all = step.all;
        for (member, one) in all.iter().enumerate() {
            for link in one.context.links {
                let other = place_of(all, link.other);
                let is_mine = other.is_none_or(|other| member < other);
                if is_mine && computes_link(all, one, link) && !one.memory.has_torn(Partner::Link(link.number)) {
                    self.link(step, [Some(member), other], link);
                }
            }
        }
    }

    fn link(&mut self, step: &FineStep<'_, '_>, ends: [Option<usize>; 2], link: &Link) {
        let [Some(member), other] = ends else { return };
        let all = step.all;
        let partner = Partner::Link(link.number);
        let slip = all[member].memory.slipped(partner);
        let (link, beside_m) = (&slip.link(link), slip.beside(link));
        let there = match other {
            Some(other) => all[other].member.anchor(link.there),
            None => seen_point(&all[member], link, step.after_s),
        };
        let (Some(here), Some(there)) = (all[member].member.anchor(link.here), there) else { return };
        let there = MaterialPoint { position: there.position + beside_m, ..there };
        let Link { stiffness_n_m, damping_n_s_m, rest_m, .. } = *link;
        let hold = Some(Holders { side_0: all[member].id, side_1: Some(link.other) });
        let mut owner = RowOwner { hold, ..RowOwner::new(member, other, partner) };
        // it tears and yields where both ends are in this problem: an end that did not see it fail would go on holding
        // it
        if let Some(other) = other.filter(|other| !all[*other].member.is_remote()) {
            owner.frame = Frame::of_link(all, [member, other], link);
            (owner.tears_above_n, owner.yields_above_n) = (link.tears_above_n, link.yields_above_n);
        }
        let ends = [End { member: Some(member), point: here }, End { member: other, point: there }];
        self.spring(step, &ends, &Pull { stiffness_n_m, damping_n_s_m, rest_m }, owner);
    }

    /// Lays out the springs to the world that are members' own and yield.
    pub fn gather_own_springs(&mut self, step: &FineStep<'_, '_>) {
        for (member, one) in step.all.iter().enumerate() {
            let springs = (0..).map_while(|place| Some((place, one.member.own_spring(place)?)));
            springs.for_each(|(place, spring)| self.own_spring(step, member, place, &spring));
        }
    }

    /// The spring at a place of a member: in all directions where it has no slack; else along the line to where it is held, and where it is
    /// taut also across that line, with the stiffness that its tension gives (rod.md, eq. 21).
    fn own_spring(&mut self, step: &FineStep<'_, '_>, member: usize, place: usize, spring: &OwnSpring) {
        let OwnSpring { stiffness_n_m, damping_n_s_m, slack_m, yields_above_n, tears_above_n, .. } = *spring;
        let owner = RowOwner::new(member, None, Partner::Attachment(spring.attachment));
        let owner = RowOwner { tears_above_n, yields_above_n, own: Some(place), ..owner };
        let sides = [spring.point.side.of_member(member), Side::FIXED];
        // of the two rows that it may have the first slips
        let push = |constraints: &mut Self, at: u32, hold: Hold, law: Spring| {
            let row = JointRow::new(sides, hold.limited(yields_above_n * step.h_s)).with_spring(law, step.h_s);
            constraints.push(step, row, RowOwner { key: 2 * place as u32 + at, ..owner })
        };
        let pull = Pull { stiffness_n_m, damping_n_s_m, rest_m: 0.0 };
        let apart = spring.point.position - spring.place_m;
        if slack_m == 0.0 {
            if push(self, 0, Hold::ALL, Spring { stiffness_n_m, damping_n_s_m, stretch_m: apart }) {
                self.spring_slides(step, &pull, Slides::Point(owner.frame));
            }
            return;
        }
        let Some(axis) = apart.try_normalize() else { return };
        let beyond_m = apart.length() - slack_m;
        let law = Spring { stiffness_n_m, damping_n_s_m, stretch_m: axis * beyond_m };
        if push(self, 0, Hold::pushing(-axis), law) {
            self.spring_slides(step, &pull, Slides::Length { axis });
        }
        if beyond_m > 0.0 {
            let tension_n = (stiffness_n_m * beyond_m).min(yields_above_n);
            let law = Spring { stiffness_n_m: tension_n / apart.length(), damping_n_s_m: 0.0, stretch_m: DVec3::ZERO };
            push(self, 1, Hold::across(axis), law);
        }
    }
}

/// Whether a link is the cluster's: one that is asynchronous only where its far end is a participant, or a remote member that is met here.
fn computes_link(all: &[Participant<'_>], one: &Participant<'_>, link: &Link) -> bool {
    let far = place_of(all, link.other).map(|other| &all[other].member);
    match link.law {
        Law::Cluster => far.is_none_or(|far| !far.is_remote()),
        Law::Ledger => far.is_some_and(|far| !far.passes_through(one.id)),
        Law::Tlm { .. } => far.is_some_and(|far| !far.is_remote()),
        Law::Off => false,
    }
}

/// The far end of a link to a body that is no participant: it moves on as it was last published.
fn seen_point(one: &Participant<'_>, link: &Link, after_s: f64) -> Option<MaterialPoint> {
    let seen = &one.context.neighbours.iter().find(|other| other.id == link.other)?.snapshot;
    let (position, led_m_s) = seen.body.point(link.there)?;
    let age_s = tool_extrapolation_s(one.context.time, seen.time) + after_s;
    let point = MaterialPoint::led(position + led_m_s * age_s, led_m_s);
    (point.position.is_finite() && led_m_s.is_finite()).then_some(point)
}
