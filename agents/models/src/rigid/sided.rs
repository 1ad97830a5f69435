//! Laws by which a body acts on itself alone: penalty contact and wave variables.
//!
//! In: the body at the start of a step, others as they are known. Out: impulses on the body, and what its ends of lines send.
//! Never here: the laws themselves ([`metachron_contact::laws`]), the other side: it does the same for itself.

use super::company::{Company, Guest, placed};
use super::mass_properties::MassDistribution;
use super::motion::Motion;
use super::places::halfway;
use glam::{DMat3, DVec3};
use metachron_contact::StepContext;
use metachron_contact::laws::{Approach, Line, LineEnd, LinkForces, push_off_n};
use metachron_contact::{Law, Link};
use metachron_core::{AgentId, Anchor, SimTime, Stand};
use metachron_core::{ContactJacobian, Impulse, PairKind};
use metachron_geometry::narrow_phase::touches;
use metachron_geometry::{ContactSide, Place, Touch};

/// What a body keeps of the laws by which it acts on itself.
#[derive(Default)]
pub(super) struct Sided {
    lines: Vec<(AgentId, Line)>,
    touches: Vec<Touch>,
    velocities: Vec<DVec3>,
    given: Vec<DVec3>,
}

/// The step in which a body acts on itself.
#[derive(Clone, Copy)]
struct Span {
    at: SimTime,
    dt_s: f64,
    gravity: DVec3,
    /// How the body stands on something fixed.
    stand: Option<Stand>,
}

/// Where a guest presses on the body, all places as one.
struct Pressed {
    /// The velocity of the body in their middle.
    slots: ContactJacobian,
    /// Away from the guest, of length one.
    normal: DVec3,
    /// That of the body against the guest, m/s.
    velocity: DVec3,
    depth_m: f64,
    places: u32,
}

impl Sided {
    /// Changes the velocities by the impulses of a step of `dt_s` seconds, by all such laws.
    pub(super) fn act(
        &mut self,
        (motion, spread): (&mut Motion, &MassDistribution),
        company: &mut Company,
        around: &StepContext<'_>,
        (dt_s, gravity, stand): (f64, DVec3, Option<Stand>),
    ) {
        let span = Span { at: around.time, dt_s, gravity, stand };
        for i in 0..company.guests().len() {
            let Some(law) = company.guests()[i].other.neighbour().map(|n| n.law) else { continue };
            match law {
                Law::Penalty { .. } => self.push_off((motion, spread), (company, i), law, span),
                Law::Tlm { stiffness_n_m, damping_n_s_m } => {
                    self.lean((motion, spread), (company, i), (stiffness_n_m, damping_n_s_m), span);
                }
                Law::Cluster | Law::Ledger | Law::Off => {}
            }
        }
        for link in around.links {
            let guest = company.guests().iter().position(|guest| guest.id() == Some(link.other));
            if let (Law::Tlm { .. }, Some(i)) = (link.law, guest) {
                self.draw((motion, spread), (company, i), link, span);
            }
        }
    }

    /// Penalty contact with guest `i`.
    fn push_off(
        &mut self,
        (motion, spread): (&mut Motion, &MassDistribution),
        (company, i): (&mut Company, usize),
        law: Law,
        span: Span,
    ) {
        let Law::Penalty { stiffness_n_m, damping_n_s_m, extrapolate } = law else { return };
        self.find((motion, spread), (company, i));
        let (mut force, mut depth_m, mut places) = (DVec3::ZERO, 0.0_f64, 0);
        self.given.clear();
        self.given.resize(self.velocities.len(), DVec3::ZERO);
        for touch in self.touches.iter().filter(|touch| touch.gap_m < 0.0) {
            let guest = &company.guests()[i];
            let slots = slots_of(touch, motion, guest);
            let velocity = slots.velocity(&self.velocities);
            let approach = Approach { gap_m: touch.gap_m, normal: touch.normal, velocity_m_s: velocity };
            let push = push_off_n(approach, stiffness_n_m, damping_n_s_m, guest.friction);
            slots.scatter(push * span.dt_s, &mut self.given);
            force += push;
            depth_m = depth_m.max(-touch.gap_m);
            places += 1;
        }
        motion.velocity += self.given[0] / spread.mass_kg;
        motion.angular += self.given[1];
        if places > 0 {
            tell(company, i, PairKind::of_penalty(extrapolate), (force, depth_m, places, span.dt_s));
        }
    }

    /// Contact with guest `i` by wave variables: one line along the normal, in the middle of what presses, that only pushes.
    fn lean(
        &mut self,
        (motion, spread): (&mut Motion, &MassDistribution),
        (company, i): (&mut Company, usize),
        (stiffness, damping): (f64, f64),
        span: Span,
    ) {
        let arriving = self.listen((company, i), stiffness, span);
        self.find((motion, spread), (company, i));
        let guest = &company.guests()[i];
        let Some(pressed) = self.pressed(motion, guest) else { return self.answer((company, i), None, span) };
        let Pressed { slots, normal, velocity, depth_m, places } = pressed;
        let mut own = (slots.velocity(&self.velocities) + span.gravity * span.dt_s).dot(normal);
        let friction = guest.friction;
        let (z, c) = (self.line(company.guests()[i].id(), stiffness).impedance(), arriving.dot(normal));
        let mut yields = answer_of(motion, spread, &slots, normal).dot(normal);
        if span.bears(&slots, normal, motion) {
            // what it stands on takes its weight and the push
            (own, yields) = (own.min(0.0), 0.0);
        }
        let push = (-(z * own + c) / (1.0 + z * yields * span.dt_s)).max(0.0);
        let damped = (push - damping * velocity.dot(normal)).max(0.0);
        let slip = velocity - normal * velocity.dot(normal);
        let rub = slip * (friction * damped / slip.length().max(1e-3));
        let force = normal * damped - rub;
        let mut given = [DVec3::ZERO; 2];
        slots.scatter(force * span.dt_s, &mut given);
        motion.velocity += given[0] / spread.mass_kg;
        motion.angular += given[1];
        self.answer((company, i), Some((normal * c, normal * -push)), span);
        tell(company, i, PairKind::Tlm, (force, depth_m, places, span.dt_s));
    }

    /// Where a guest presses on the body, all places as one: each counts by its depth, so that a side that sinks in deeper bears
    /// more. At the deepest place alone a box rocks from corner to corner on its line and sinks.
    fn pressed(&self, motion: &Motion, guest: &Guest) -> Option<Pressed> {
        let overlapping = || self.touches.iter().filter(|touch| touch.gap_m < 0.0);
        let depth_m = overlapping().map(|touch| -touch.gap_m).fold(0.0, f64::max);
        let whole: f64 = overlapping().map(|touch| -touch.gap_m).sum();
        let (mut point, mut normal, mut velocity, mut places) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, 0);
        for touch in overlapping() {
            let (Place::Point(at), share) = (halfway(touch).0, -touch.gap_m / whole) else { continue };
            point += at * share;
            normal += touch.normal * share;
            velocity += slots_of(touch, motion, guest).velocity(&self.velocities) * share;
            places += 1;
        }
        let normal = normal.try_normalize()?;
        let mut slots = ContactJacobian::default();
        Place::Point(point).join(&mut slots, 0, motion.position, ContactSide::first(normal));
        Some(Pressed { slots, normal, velocity, depth_m, places })
    }

    /// A link to guest `i` by wave variables.
    fn draw(
        &mut self,
        (motion, spread): (&mut Motion, &MassDistribution),
        (company, i): (&mut Company, usize),
        link: &Link,
        span: Span,
    ) {
        let Law::Tlm { stiffness_n_m, damping_n_s_m } = link.law else { return };
        let guest = &company.guests()[i];
        let (Anchor::Local(local), Some((far_m, far))) = (link.here, guest.other.point(link.there)) else { return };
        let (id, decides) = (guest.id(), guest.other.neighbour().is_some_and(|n| n.owned));
        let arm = motion.rotation * local;
        let way = far_m - motion.position - arm;
        if decides {
            self.line(id, stiffness_n_m).begin(way, span.at);
        }
        let arriving = self.listen((company, i), stiffness_n_m, span);
        let mut slots = ContactJacobian::default();
        slots.add_linear(0, 1.0);
        slots.add_angular(1, arm);
        let own = slots.velocity(&[motion.velocity + span.gravity * span.dt_s, motion.spin(spread)]);
        let [x, y, z] = DVec3::AXES.map(|axis| answer_of(motion, spread, &slots, axis) * span.dt_s);
        let yields = DMat3::from_cols(x, y, z);
        let step = (span.at, span.dt_s);
        let end = LineEnd { step, own, far, way, arriving, yields, rest_m: link.rest_m, damping_n_s_m };
        let LinkForces { force, arriving, into_line } = self.line(id, stiffness_n_m).forces(&end);
        let mut given = [DVec3::ZERO; 2];
        slots.scatter(force * span.dt_s, &mut given);
        motion.velocity += given[0] / spread.mass_kg;
        motion.angular += given[1];
        self.answer((company, i), Some((arriving, into_line)), span);
        tell(company, i, PairKind::Tlm, (force, 0.0, 1, span.dt_s));
    }

    /// Where guest `i` overlaps the body, and the velocities of both.
    fn find(&mut self, (motion, spread): (&Motion, &MassDistribution), (company, i): (&mut Company, usize)) {
        let (guests, _, _, room, form) = company.split();
        self.touches.clear();
        self.velocities.clear();
        self.velocities.extend([motion.velocity, motion.spin(spread)]);
        self.velocities.extend_from_slice(guests[i].other.velocities());
        if let Some(it) = guests[i].other.placed() {
            touches(&placed(form, motion), &it, 0.0, room, &mut self.touches);
        }
    }

    /// What arrives from guest `i` during the step.
    fn listen(&mut self, (company, i): (&Company, usize), stiffness: f64, span: Span) -> DVec3 {
        let Some(neighbour) = company.guests()[i].other.neighbour() else { return DVec3::ZERO };
        let pair = neighbour.snapshot.pairs.iter().find(|pair| pair.with == company.me);
        let (at, wave) = (neighbour.snapshot.time, pair.and_then(|pair| pair.wave));
        let decides = neighbour.owned;
        let line = self.line(Some(neighbour.id), stiffness);
        line.receive(at, wave, decides, span.dt_s);
        line.arriving(span.at, span.dt_s)
    }

    /// Sends what this end answers: (what arrived, the force into the line), or nothing where the line is slack.
    fn answer(&mut self, (company, i): (&mut Company, usize), answer: Option<(DVec3, DVec3)>, span: Span) {
        let Some(id) = company.guests()[i].id() else { return };
        let Some((_, line)) = self.lines.iter_mut().find(|(with, _)| *with == id) else { return };
        if let Some((arriving, force)) = answer {
            line.send(arriving, force, span.dt_s);
        }
        let state = company.exchange.pair_mut(id);
        (state.kind, state.parasitic_kg) = (PairKind::Tlm, line.parasitic_kg());
        (state.wave, state.force_n) = (Some(line.wave()), 0.0);
    }

    /// The line to `with`; a new one where there is none.
    fn line(&mut self, with: Option<AgentId>, stiffness: f64) -> &mut Line {
        let with = with.unwrap_or(AgentId(u32::MAX));
        let at = self.lines.iter().position(|(id, _)| *id == with).unwrap_or_else(|| {
            self.lines.push((with, Line::new(stiffness)));
            self.lines.len() - 1
        });
        &mut self.lines[at].1
    }
}

impl Span {
    /// Whether a push along `axis` on what gathers from `slots` only presses the body on what it stands on.
    fn bears(&self, slots: &ContactJacobian, axis: DVec3, motion: &Motion) -> bool {
        let mut push = [DVec3::ZERO; 2];
        slots.scatter(axis, &mut push);
        let push = Impulse { linear: push[0], angular: push[1] };
        self.stand.is_some_and(|stand| stand.bears(motion.position, push))
    }
}

/// The velocities that a place joins: the body's slots, then the guest's.
fn slots_of(touch: &Touch, motion: &Motion, guest: &Guest) -> ContactJacobian {
    let mut slots = only_mine(touch, motion);
    guest.other.join(&mut slots, 2, &halfway(touch).1, ContactSide::second(touch.normal));
    slots
}

fn only_mine(touch: &Touch, motion: &Motion) -> ContactJacobian {
    let mut slots = ContactJacobian::default();
    halfway(touch).0.join(&mut slots, 0, motion.position, ContactSide::first(touch.normal));
    slots
}

/// How a point of the body answers a unit impulse along `axis`, 1/kg.
fn answer_of(motion: &Motion, spread: &MassDistribution, slots: &ContactJacobian, axis: DVec3) -> DVec3 {
    let (inverse_mass, inverse_inertia) = motion.inverse_inertia(spread);
    let mut answer = [DVec3::ZERO; 2];
    slots.scatter(axis, &mut answer);
    answer = [answer[0] * inverse_mass, inverse_inertia * answer[1]];
    slots.velocity(&answer)
}

/// Writes what a law did to guest `i` into the state of the pair, if this body owns it.
fn tell(company: &mut Company, i: usize, kind: PairKind, (force, depth_m, places, dt_s): (DVec3, f64, u32, f64)) {
    let owner = company.guests()[i].other.neighbour().filter(|n| n.owned || kind == PairKind::Tlm).map(|n| n.id);
    let Some(id) = owner else { return };
    let state = company.exchange.pair_mut(id);
    (state.kind, state.contacts, state.force_n) = (kind, places, force.length());
    state.penetration_m = state.penetration_m.max(depth_m);
    state.impulse_n_s += force.length() * dt_s;
}
