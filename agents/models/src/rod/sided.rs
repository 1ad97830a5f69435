//! Laws by which a tube acts on itself alone: penalty contact and wave variables.
//!
//! In: the tube at the start of a step, others as they are known. Out: impulses on the tube, and what its ends of lines send.
//! Never here: the laws themselves ([`metachron_contact::laws`]), the other side: it does the same for itself.

use super::company::Company;
use super::discretization::Discretization;
use crate::rod::banded_ldl::Factor;
use glam::{DMat3, DVec3};
use metachron_contact::laws::{Approach, Line, LineEnd, LinkForces, push_off_n};
use metachron_contact::{Law, Link, Mate};
use metachron_contact::{Neighbour, StepContext};
use metachron_core::{AgentId, Anchor, SimTime};
use metachron_core::{ContactJacobian, PairKind};
use metachron_geometry::narrow_phase::touches;
use metachron_geometry::{ContactSide, PlacedShape, ShapePose, Touch};

/// Below this slip friction grows in proportion to it, m/s.
const STICK_M_S: f64 = 1e-3;

/// What a tube keeps of the laws by which it acts on itself.
#[derive(Clone, Default)]
pub struct Sided {
    lines: Vec<(AgentId, Line)>,
    mate: Mate,
    velocities: Vec<DVec3>,
    answer: Vec<DVec3>,
    /// Room for the radius at each node, metres.
    pub radii_m: Vec<f64>,
}

/// The tube at the start of the step in which it acts on itself.
pub struct Now<'a> {
    /// Its division.
    pub division: &'a Discretization,
    /// Node positions, metres.
    pub positions: &'a [DVec3],
    /// Velocities in slots.
    pub slots: &'a [DVec3],
    /// Radius at each node, metres.
    pub radii_m: &'a [f64],
    /// How it answers impulses.
    pub factor: &'a Factor,
    /// The step, seconds.
    pub dt: f64,
    /// Gravity, m/s².
    pub gravity: DVec3,
}

/// Whether `neighbour` and the one who looks each act on themselves alone.
pub fn is_sided(neighbour: &Neighbour, around: &StepContext<'_>) -> bool {
    let lined = |link: &metachron_contact::Link| link.other == neighbour.id && matches!(link.law, Law::Tlm { .. });
    matches!(neighbour.law, Law::Penalty { .. } | Law::Tlm { .. }) || around.links.iter().any(lined)
}

impl Company {
    /// Adds the impulses of a step by all such laws to what the tube is given.
    pub fn act_on_itself(&mut self, around: &StepContext<'_>, now: &Now<'_>) {
        let mut sided = std::mem::take(self.sided());
        for neighbour in around.neighbours.iter().filter(|n| is_sided(n, around) && n.snapshot.is_finite()) {
            if !sided.see(neighbour, around, self) {
                continue;
            }
            match neighbour.law {
                law @ Law::Penalty { .. } => sided.push_off(self, (neighbour, now), law),
                Law::Tlm { stiffness_n_m, damping_n_s_m } => {
                    sided.lean(self, (neighbour, now), (stiffness_n_m, damping_n_s_m), around);
                }
                Law::Cluster | Law::Ledger | Law::Off => {}
            }
            for link in around.links.iter().filter(|link| link.other == neighbour.id) {
                sided.draw(self, (neighbour, now), link, around);
            }
        }
        sided.radii_m = std::mem::take(&mut self.sided().radii_m);
        *self.sided() = sided;
    }
}

impl Sided {
    /// Takes in a neighbour: as it was published for a law that does not bring it forward.
    fn see(&mut self, neighbour: &Neighbour, around: &StepContext<'_>, company: &Company) -> bool {
        let stale = matches!(neighbour.law, Law::Penalty { extrapolate: false, .. });
        self.mate.look(neighbour, around, (company.exchange(), company.friction()), stale)
    }

    /// Where the two overlap, and the velocities of both behind each other.
    fn find(&mut self, company: &mut Company, now: &Now<'_>) -> Vec<Touch> {
        self.velocities.clear();
        self.velocities.extend_from_slice(now.slots);
        self.mate.extend(&mut self.velocities, 0.0);
        let Some((form, room, mut list)) = company.search() else { return vec![] };
        list.clear();
        if let Some(there) = self.mate.other.placed() {
            let view = ShapePose::Chain { positions: now.positions, radii_m: now.radii_m };
            touches(&PlacedShape { form: &form, view }, &there, 0.0, room, &mut list);
        }
        list
    }

    /// Penalty contact.
    fn push_off(&mut self, company: &mut Company, (neighbour, now): (&Neighbour, &Now<'_>), law: Law) {
        let Law::Penalty { stiffness_n_m, damping_n_s_m, extrapolate } = law else { return };
        let list = self.find(company, now);
        let (mut force, mut depth_m, mut places) = (DVec3::ZERO, 0.0_f64, 0);
        for touch in list.iter().filter(|touch| touch.gap_m < 0.0) {
            let velocity = self.mate.slots_of(touch).velocity(&self.velocities);
            let approach = Approach { gap_m: touch.gap_m, normal: touch.normal, velocity_m_s: velocity };
            let push = push_off_n(approach, stiffness_n_m, damping_n_s_m, self.mate.friction());
            company.received().add_slots(&mine(touch), push * now.dt);
            force += push;
            depth_m = depth_m.max(-touch.gap_m);
            places += 1;
        }
        company.give_back(list);
        if places > 0 && neighbour.owned {
            tell(company, neighbour.id, PairKind::of_penalty(extrapolate), (force, depth_m, places, now.dt));
        }
    }

    /// Contact by wave variables, at the deepest place: a line along the normal that only pushes.
    fn lean(
        &mut self,
        company: &mut Company,
        (neighbour, now): (&Neighbour, &Now<'_>),
        (stiffness, damping): (f64, f64),
        around: &StepContext<'_>,
    ) {
        let arriving = self.listen(neighbour, stiffness, (around, now.dt));
        let list = self.find(company, now);
        let deepest = list.iter().min_by(|a, b| a.gap_m.total_cmp(&b.gap_m)).filter(|touch| touch.gap_m < 0.0).copied();
        company.give_back(list);
        let Some(touch) = deepest else { return self.answer(company, neighbour.id, None, now.dt) };
        let (normal, slots) = (touch.normal, mine(&touch));
        let velocity = self.mate.slots_of(&touch).velocity(&self.velocities);
        let own = slots.velocity(now.slots).dot(normal) + now.gravity.dot(normal) * now.dt;
        let (z, c) = (self.line(neighbour.id, stiffness).impedance(), arriving.dot(normal));
        let yields = self.answer_of(now, &slots, normal).dot(normal);
        let push = (-(z * own + c) / (1.0 + z * yields)).max(0.0);
        let damped = (push - damping * velocity.dot(normal)).max(0.0);
        let slip = velocity - normal * velocity.dot(normal);
        let rub = slip * (self.mate.friction() * damped / slip.length().max(STICK_M_S));
        let force = normal * damped - rub;
        company.received().add_slots(&slots, force * now.dt);
        self.answer(company, neighbour.id, Some((normal * c, normal * -push)), now.dt);
        tell(company, neighbour.id, PairKind::Tlm, (force, -touch.gap_m, 1, now.dt));
    }

    /// A link by wave variables.
    fn draw(
        &mut self,
        company: &mut Company,
        (neighbour, now): (&Neighbour, &Now<'_>),
        link: &Link,
        around: &StepContext<'_>,
    ) {
        let (Law::Tlm { stiffness_n_m, damping_n_s_m }, Anchor::Arc(arc_m)) = (link.law, link.here) else { return };
        let Some((far_m, far)) = self.mate.other.point(link.there) else { return };
        let (segment, share) = now.division.locate(arc_m);
        let way = far_m - now.positions[segment].lerp(now.positions[segment + 1], share);
        if neighbour.owned {
            self.line(neighbour.id, stiffness_n_m).begin(way, around.time);
        }
        let arriving = self.listen(neighbour, stiffness_n_m, (around, now.dt));
        let mut slots = ContactJacobian::default();
        slots.add_linear(2 * segment as u32, 1.0 - share);
        slots.add_linear(2 * segment as u32 + 2, share);
        let own = slots.velocity(now.slots) + now.gravity * now.dt;
        let [x, y, z] = DVec3::AXES.map(|axis| self.answer_of(now, &slots, axis));
        let yields = DMat3::from_cols(x, y, z);
        let step = (around.time, now.dt);
        let end = LineEnd { step, own, far, way, arriving, yields, rest_m: link.rest_m, damping_n_s_m };
        let LinkForces { force, arriving, into_line } = self.line(neighbour.id, stiffness_n_m).forces(&end);
        company.received().add_slots(&slots, force * now.dt);
        self.answer(company, neighbour.id, Some((arriving, into_line)), now.dt);
        tell(company, neighbour.id, PairKind::Tlm, (force, 0.0, 1, now.dt));
    }

    /// What arrives during the step.
    fn listen(&mut self, neighbour: &Neighbour, stiffness: f64, (around, dt): (&StepContext<'_>, f64)) -> DVec3 {
        let pair = neighbour.snapshot.pairs.iter().find(|pair| pair.with == around.me);
        let (at, wave): (SimTime, _) = (neighbour.snapshot.time, pair.and_then(|pair| pair.wave));
        let line = self.line(neighbour.id, stiffness);
        line.receive(at, wave, neighbour.owned, dt);
        line.arriving(around.time, dt)
    }

    /// Sends what this end answers: (what arrived, the force into the line), or nothing where the line is slack.
    fn answer(&mut self, company: &mut Company, id: AgentId, answer: Option<(DVec3, DVec3)>, dt: f64) {
        let Some((_, line)) = self.lines.iter_mut().find(|(with, _)| *with == id) else { return };
        if let Some((arriving, force)) = answer {
            line.send(arriving, force, dt);
        }
        let state = company.pair_mut(id);
        (state.kind, state.parasitic_kg) = (PairKind::Tlm, line.parasitic_kg());
        (state.wave, state.force_n) = (Some(line.wave()), 0.0);
    }

    /// The line to `with`; a new one where there is none.
    fn line(&mut self, with: AgentId, stiffness: f64) -> &mut Line {
        let at = self.lines.iter().position(|(id, _)| *id == with).unwrap_or_else(|| {
            self.lines.push((with, Line::new(stiffness)));
            self.lines.len() - 1
        });
        &mut self.lines[at].1
    }

    /// The velocity of what gathers from `slots` after a force of 1 N along `axis` for the step, m/s.
    fn answer_of(&mut self, now: &Now<'_>, slots: &ContactJacobian, axis: DVec3) -> DVec3 {
        self.answer.clear();
        self.answer.resize(now.slots.len(), DVec3::ZERO);
        slots.scatter(axis * now.dt, &mut self.answer);
        now.factor.solve(&mut self.answer);
        slots.velocity(&self.answer)
    }
}

/// The tube's side of a place.
fn mine(touch: &Touch) -> ContactJacobian {
    let mut slots = ContactJacobian::default();
    touch.on_a.join(&mut slots, 0, DVec3::ZERO, ContactSide::first(touch.normal));
    slots
}

/// Writes what a law did into the state of the pair.
fn tell(company: &mut Company, id: AgentId, kind: PairKind, (force, depth_m, places, dt): (DVec3, f64, u32, f64)) {
    let state = company.pair_mut(id);
    (state.kind, state.contacts, state.force_n) = (kind, places, force.length());
    state.penetration_m = state.penetration_m.max(depth_m);
    state.impulse_n_s += force.length() * dt;
}
