//! Few bodies: every contact and joint of a part solved at once, in double precision.
//!
//! In: members, the ground, joints, a part of a step. Out: their motions after it, and who touches whom.
//! Never here: how hands and tools pull (the bodies' own springs do, and tell how they resist), who is a member.
//!
//! A part is RATTLE (AND83) with contacts: half of gravity's kick; impulses that keep joints and gaps at the part's *end*,
//! turning of the bodies included; the flight there; the other half; impulses that keep velocities there, and bounce. So a
//! chain neither stretches nor loses energy, and a stack does not sink, whatever stands on it. Overlaps from before are
//! pushed out by displacements alone: they leave no velocity behind.

mod answer;
mod bodies;
mod joints;
mod matrix;
mod near;
mod newton;
mod order;
mod reach;
mod row;
mod sweep;

use super::Held;
use super::member::{Ground, Member};
use crate::rigid::motion::Motion;
use answer::Answers;
use bodies::{contact_rows, energy_j, gap_now, is_soft, middle, push, spring_rows, weigh};
use glam::DVec3;
use joints::JointRow;
use near::{Near, Warm};
use newton::Newton;
pub(super) use reach::{Reach, may_suit};
use row::{Law, Mass, NOBODY, Row, Twist};

/// The direct solve and its memory.
#[derive(Default)]
pub(super) struct Direct {
    near: Near,
    newton: Newton,
    joints: Vec<JointRow>,
    ahead: Vec<JointRow>,
    rows: Vec<Row>,
    masses: Vec<Mass>,
    start: Vec<Motion>,
    free: Vec<Twist>,
    velocities: Vec<Twist>,
    /// The velocities that stay where displacements take others for the way.
    real: Vec<Twist>,
    /// What the flight's turning adds to each joint row's error, metres or radians.
    bend: Vec<f64>,
    /// What each joint row gave in the last part, and at its end, newtons or newton metres.
    known: Vec<[f64; 2]>,
    /// What each contact gave in this part.
    given: Vec<Warm>,
    /// How fast each contact closed at the part's start, m/s.
    approach: Vec<f64>,
    /// What the impulses of the way took out of the motion, joules: bounces give back no more.
    taken_j: f64,
    answers: Answers,
}

/// A part's flight is corrected at most this often for the turning of the bodies: each time leaves a hundredth.
const BENDS_MAX: u32 = 6;
/// A joint's error that is not worth another correction, metres or radians.
const BEND_M: f64 = 1e-10;
/// A joint's older error is taken back by this share a part, where it is more than [`DRIFT_M`].
const DRIFT_SHARE: f64 = 0.5;
/// A joint's error from before that is worth a displacement, metres or radians.
const DRIFT_M: f64 = 1e-7;
/// Of an overlap's depth, this share is pushed out a part.
const PUSH_SHARE: f64 = 0.2;
/// No overlap is pushed out faster, m/s.
const PUSH_MAX_M_S: f64 = 1.0;
/// An overlap less deep than this share of a body's size is left alone: ten times what single precision resolves.
const SLOP_SHARE: f64 = 1e-5;
/// A contact that closes slower than this many parts' gravity does not bounce.
const BOUNCE_PARTS: f64 = 2.0;
/// Who bounces by no more than this stays on what presses it.
const STAYS: f64 = 0.5;
/// A part turns no jointed body farther, radians: past it the impulses' directions are stale.
const TURN_MAX: f64 = 0.1;
/// A part lasts at most this many radians of the fastest tremor of a tight chain: RATTLE is stable below 2.
const TREMOR_MAX: f64 = 1.0;
/// Nearer than this share of its size a body touches.
const MARGIN_SHARE: f64 = 2e-3;

impl Direct {
    /// Who is here has changed.
    pub(super) fn settle(&mut self, members: &[Member], ground: &[Ground], held: &[Held]) {
        self.near.list(members, ground, held);
        self.known.clear();
        self.answers = Answers::default();
    }

    /// Nobody asks how members answer impulses.
    pub(super) fn forget(&mut self, members: &mut [Member]) {
        self.answers.forget(members);
    }

    /// A step begins in which something is given: its first part finds how members answer impulses.
    pub(super) fn ask(&mut self) {
        self.answers.ask();
    }

    /// By how much an impulse on the member `index` moves each of them, as contact and joints held them in the last step; `None` where it
    /// was not asked, or where something fixed holds them.
    pub(super) fn moves(&self, index: usize, impulse: Twist) -> Option<impl Iterator<Item = Twist>> {
        self.answers.moves(index, impulse)
    }

    /// The longest part that jointed bodies take, seconds: none turns far, and none trembles between the forces that its
    /// joints bear faster than a part can follow. Such a force F on an arm r is a stiffness F r against turning.
    pub(super) fn span_s(&self, members: &[Member]) -> f64 {
        if self.joints.is_empty() || self.known.len() != self.joints.len() {
            return f64::INFINITY;
        }
        let mut span = f64::INFINITY;
        for (index, member) in members.iter().enumerate() {
            let borne = self.joints.iter().zip(&self.known).filter(|(joint, _)| joint.row.joins(index as u32));
            let force: f64 = borne.map(|(joint, known)| joint.row.lin.length() * known[0].abs()).sum();
            let stiffness = force * member.radius_m;
            let tremor = (stiffness / middle(member.spread.moments)).sqrt();
            let spin = member.motion.spin(&member.spread).length();
            span = span.min((TURN_MAX / spin).min(TREMOR_MAX / tremor));
        }
        span
    }

    /// Advances all members by `h` seconds; `false`, and nothing has moved, where there are more contacts, or bodies more
    /// entangled, than this solve is for.
    pub(super) fn advance(
        &mut self,
        (members, ground): (&mut [Member], &[Ground]),
        held: &[Held],
        h: f64,
    ) -> Result<bool, &'static str> {
        self.near.find(members, ground, h);
        joints::rows(members, held, &mut self.joints);
        if !self.link(members.len()) {
            return Ok(false);
        }
        self.note_approach(members);
        self.kick(members, 0, h);
        self.travel(members, held, h);
        joints::rows(members, held, &mut self.ahead);
        self.kick(members, 1, h);
        self.arrive(members, h);
        self.note_touches(members);
        let sane = members.iter().all(|m| m.motion.is_sane(&m.spread));
        if sane { Ok(true) } else { Err("the direct solve lost a body") }
    }

    /// Learns who acts on whom in this part; whether that is not too much.
    fn link(&mut self, members: usize) -> bool {
        let touching = self.near.contacts.iter().map(|contact| (contact.a, contact.b));
        let jointed = self.joints.iter().map(|joint| (joint.row.a, joint.row.b));
        self.newton.link(members, touching.chain(jointed).filter(|pair| pair.1 != NOBODY));
        !reach::is_overrun(self.near.contacts.len(), self.newton.work())
    }

    /// Half a part of gravity and soft springs, at its start (0) or its end (1). Where a spring from outside bears the members,
    /// which acts on the way of the part, all of gravity acts at the start: what it bears then hangs still.
    fn kick(&mut self, members: &mut [Member], end: usize, h: f64) {
        let is_borne = members.iter().any(|m| m.springs.is_some());
        let share = if is_borne { 1.0 - end as f64 } else { 0.5 };
        members.iter_mut().for_each(|m| m.motion.velocity += m.gravity * (share * h));
        let rows = if end == 0 { &self.joints } else { &self.ahead };
        if rows.iter().all(|row| row.spring.is_none()) {
            return;
        }
        weigh(members, &mut self.masses, &mut self.velocities);
        for joint in rows {
            let Some((k, c)) = joint.spring.filter(|s| is_soft(&joint.row, *s, h, &self.masses)) else { continue };
            let speed = joint.row.velocity(&self.velocities);
            push(members, &joint.row, -0.5 * h * (k * joint.error + c * speed));
        }
    }

    /// The impulses of the part and the flight to its end.
    fn travel(&mut self, members: &mut [Member], held: &[Held], h: f64) {
        weigh(members, &mut self.masses, &mut self.free);
        self.start.clear();
        self.start.extend(members.iter().map(|m| m.motion));
        self.list_rows(members, h);
        self.bend.clear();
        self.bend.resize(self.joints.len(), 0.0);
        for _ in 0..BENDS_MAX {
            self.solve();
            self.fly(members, h);
            if self.joints.is_empty() || !self.measure_bend(members, held, h) {
                break;
            }
        }
        self.remember(0, h);
        self.taken_j = energy_j(&self.masses, &self.free) - energy_j(&self.masses, &self.velocities);
        self.answers.find(&mut self.newton, (&self.rows, &self.masses), members);
        for (member, (now, free)) in members.iter_mut().zip(self.velocities.iter().zip(&self.free)) {
            member.bent = [now[0] - free[0], now[1] - free[1]];
        }
        if self.displace(members, h) {
            std::mem::swap(&mut self.velocities, &mut self.real);
            self.solve();
            self.fly(members, h);
            for ((member, start), (real, free)) in
                members.iter_mut().zip(&self.start).zip(self.real.iter().zip(&self.free))
            {
                member.motion.velocity = real[0];
                member.motion.angular = start.angular + start.inertia_times(&member.spread, real[1] - free[1]);
            }
        }
    }

    /// Solves the rows from the free velocities.
    fn solve(&mut self) {
        self.velocities.clone_from(&self.free);
        self.newton.solve(&mut self.rows, &self.masses, &mut self.velocities);
    }

    /// Flies everybody from the part's start with the velocities found.
    fn fly(&self, members: &mut [Member], h: f64) {
        for (i, member) in members.iter_mut().enumerate() {
            let mut motion = self.start[i];
            motion.velocity = self.velocities[i][0];
            let turned = self.velocities[i][1] - self.free[i][1];
            motion.angular += motion.inertia_times(&member.spread, turned);
            motion.fly(&member.spread, DVec3::ZERO, h);
            member.motion = motion;
        }
    }

    /// Writes the rows of joints and contacts for the part.
    fn list_rows(&mut self, members: &[Member], h: f64) {
        self.rows.clear();
        let known = self.known.len() == self.joints.len();
        for (i, joint) in self.joints.iter().enumerate() {
            let mut row = joint.row;
            row.bias = if row.law == Law::AtLeast { joint.error.max(0.0) / h } else { 0.0 };
            row.lambda = if known { self.known[i][0] * h } else { 0.0 };
            if let Some((k, c)) = joint.spring {
                let stiff = h * (h * k + c);
                let idle = stiff <= 0.0 || is_soft(&row, (k, c), h, &self.masses);
                // a spring that acts as a force is no row: it gives way to anything
                row.law = Law::Spring(if idle { f64::MAX } else { 1.0 / stiff });
                row.bias = if idle { 0.0 } else { h * k * joint.error / stiff };
                row.lambda = 0.0;
            }
            self.rows.push(row);
        }
        for contact in &self.near.contacts {
            contact_rows(contact, members, contact.warm.during * h, &mut self.rows);
            let at = self.rows.len() - 3;
            self.rows[at].bias = contact.gap_m.max(0.0) / h;
        }
        spring_rows(members, &self.free, &mut self.rows);
    }

    /// Measures what turning adds to the joints' errors; whether that asks for another solve.
    fn measure_bend(&mut self, members: &[Member], held: &[Held], h: f64) -> bool {
        joints::rows(members, held, &mut self.ahead);
        let mut worst = 0.0_f64;
        for (i, (now, ahead)) in self.joints.iter().zip(&self.ahead).enumerate() {
            if matches!(self.rows[i].law, Law::Spring(_)) {
                continue;
            }
            let bend = ahead.error - now.error - h * self.rows[i].velocity(&self.velocities);
            let base = if self.rows[i].law == Law::AtLeast { now.error.max(0.0) } else { 0.0 };
            let left = base + bend + h * self.rows[i].velocity(&self.velocities);
            if self.rows[i].lambda != 0.0 || left < 0.0 {
                worst = worst.max((bend - self.bend[i]).abs());
            }
            self.bend[i] = bend;
            self.rows[i].bias = (base + bend) / h;
        }
        worst > BEND_M
    }

    /// Asks for the displacements that close old errors and overlaps; whether there are any.
    fn displace(&mut self, members: &[Member], h: f64) -> bool {
        let mut any = false;
        for (joint, row) in self.joints.iter().zip(&mut self.rows) {
            let error = if row.law == Law::AtLeast { joint.error.min(0.0) } else { joint.error };
            if error.abs() > DRIFT_M && !matches!(row.law, Law::Spring(_)) {
                row.bias += DRIFT_SHARE * error / h;
                any = true;
            }
        }
        for (contact, rows) in self.near.contacts.iter().zip(self.rows[self.joints.len()..].chunks_exact_mut(3)) {
            if contact.gap_m < -SLOP_SHARE * members[contact.a as usize].radius_m {
                rows[0].bias = (PUSH_SHARE * contact.gap_m / h).max(-PUSH_MAX_M_S);
                any = true;
            }
        }
        any
    }

    /// The impulses at the part's end: joints and closed contacts keep their velocities there, and bounces leave. A contact that
    /// closed fast because what lies on it pressed it would throw that up with it: where bounces give more than the way took, there
    /// are none.
    fn arrive(&mut self, members: &mut [Member], h: f64) {
        weigh(members, &mut self.masses, &mut self.free);
        self.list_ends(members, h, true);
        self.solve();
        if energy_j(&self.masses, &self.velocities) - energy_j(&self.masses, &self.free) > self.taken_j.max(0.0) {
            self.list_ends(members, h, false);
            self.solve();
        }
        for ((member, now), free) in members.iter_mut().zip(&self.velocities).zip(&self.free) {
            member.motion.velocity = now[0];
            member.motion.angular += member.motion.inertia_times(&member.spread, now[1] - free[1]);
        }
        self.remember(1, h);
        for (i, warm) in self.given.iter().enumerate() {
            self.near.remember(i, *warm);
        }
    }

    /// Writes the rows of joints and contacts for the part's end, with or without bounces.
    fn list_ends(&mut self, members: &[Member], h: f64, bounces: bool) {
        self.rows.clear();
        for (joint, known) in self.ahead.iter().zip(&self.known) {
            let mut row = joint.row;
            row.lambda = known[1] * h;
            match row.law {
                Law::Spring(_) => row.law = Law::Spring(f64::MAX),
                Law::AtLeast => row.bias = joint.error.max(0.0) / h,
                _ => {}
            }
            self.rows.push(row);
        }
        for (i, contact) in self.near.contacts.iter().enumerate() {
            contact_rows(contact, members, contact.warm.ending * h, &mut self.rows);
            let at = self.rows.len() - 3;
            let pressed = self.given[i].during.dot(contact.normal) > 0.0;
            let closing = -self.approach[i];
            let fall = BOUNCE_PARTS * h * members[contact.a as usize].gravity.length();
            self.rows[at].bias = match pressed {
                true if bounces && closing > fall => -contact.restitution * closing,
                true => 0.0,
                false => gap_now(contact, members).max(0.0) / h,
            };
        }
    }

    /// Keeps what every row gave: over the part (0), or at its end (1).
    fn remember(&mut self, end: usize, h: f64) {
        if end == 0 {
            self.known.clear();
            self.known.resize(self.joints.len(), [0.0; 2]);
            self.given.clear();
            self.given.extend(self.near.contacts.iter().map(|c| c.warm));
        }
        for (known, row) in self.known.iter_mut().zip(&self.rows) {
            known[end] = row.lambda / h;
        }
        for (given, rows) in self.given.iter_mut().zip(self.rows[self.joints.len()..].chunks_exact(3)) {
            let force = rows.iter().map(|row| row.lin * (row.lambda / h)).sum();
            *(if end == 0 { &mut given.during } else { &mut given.ending }) = force;
        }
    }

    /// Notes how fast contacts close. What pressed a member at the start of the step on one that it touches presses, and is no approach,
    /// where the two stay on what they fall on.
    fn note_approach(&mut self, members: &mut [Member]) {
        weigh(members, &mut self.masses, &mut self.velocities);
        self.rows.clear();
        for contact in &self.near.contacts {
            contact_rows(contact, members, DVec3::ZERO, &mut self.rows);
        }
        self.free.clear();
        let own = |(member, [v, w]): (&mut Member, &Twist)| {
            let [dv, dw] = std::mem::take(&mut member.received);
            [*v - dv, *w - dw]
        };
        self.free.extend(members.iter_mut().zip(&self.velocities).map(own));
        let mut approach = std::mem::take(&mut self.approach);
        approach.clear();
        let closing = |(index, row): (usize, &Row)| {
            let presses = self.near.contacts[index].restitution <= STAYS && self.is_touch(index, members);
            row.velocity(if presses { &self.free } else { &self.velocities })
        };
        approach.extend(self.rows.iter().step_by(3).enumerate().map(closing));
        self.approach = approach;
    }

    /// Notes for every member whether it touches anything and how deep.
    fn note_touches(&self, members: &mut [Member]) {
        members.iter_mut().for_each(|m| (m.touching, m.depth_m) = (false, 0.0));
        for (index, contact) in self.near.contacts.iter().enumerate() {
            if !self.is_touch(index, members) {
                continue;
            }
            for side in [contact.a, contact.b].into_iter().filter(|&side| side != NOBODY) {
                let member = &mut members[side as usize];
                member.touching = true;
                member.depth_m = member.depth_m.max(-contact.gap_m);
            }
        }
    }

    fn is_touch(&self, index: usize, members: &[Member]) -> bool {
        let contact = &self.near.contacts[index];
        contact.gap_m <= MARGIN_SHARE * members[contact.a as usize].radius_m
    }

    /// Shows every touching pair of members.
    pub(super) fn touches(&self, members: &[Member], mut pair: impl FnMut(u32, u32)) {
        for (index, contact) in self.near.contacts.iter().enumerate() {
            if contact.b != NOBODY && self.is_touch(index, members) {
                pair(contact.a, contact.b);
            }
        }
    }
}
