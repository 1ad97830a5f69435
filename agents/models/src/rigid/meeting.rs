//! Contacts of one body with everything around it, solved at once in double precision.
//!
//! In: the body, the agents it meets at its own time, the fixed solids. Out: the body's motion after a blow or after a stretch
//! of contact, and what the others got, booked with its time. Never here: when a touch happens ([`super::company`]).
//!
//! Two kinds of solve, both after docs/theory/contact.md (eq. 5–8), the others' own inverse masses in W:
//! a *blow* takes no time and asks each approaching contact for restitution × its approach speed; a *press* lasts a part of a
//! step, has gravity in the free velocities and foresees what may close within the part (eq. 3, 4).

use super::company::Company;
use super::conservative_advancement::MovingShape;
use super::leant::Leant;
use super::mass_properties::MassDistribution;
use super::motion::Motion;
use glam::{DMat3, DVec3};
use metachron_contact::{Contact, Problem, Settings, Solver, inverse_mass};
use metachron_core::Twist;
use metachron_geometry::{StaticSolid, Touch};

/// The body itself, as a solve needs it.
pub(super) struct Me<'a> {
    pub motion: &'a mut Motion,
    pub spread: &'a MassDistribution,
    pub mover: &'a MovingShape,
}

/// How much of what is around takes part in a press.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Scope {
    /// Whether solids and tools do; tubes always do.
    pub solids: bool,
    /// Whether fixed solids do, where anything else does.
    pub fixed: bool,
}

/// How a blow comes about.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strike {
    /// Whether others take part; fixed solids always do.
    pub met: bool,
    /// The velocity and the spin that the body was pressed by in the step, m/s and rad/s.
    pub pressed: Twist,
    /// It stood when it was: what it stands on carries that, and does not throw it back.
    pub stood: bool,
}

/// What a press did.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Pressed {
    /// The impulse of fixed solids, N·s.
    pub fixed: DVec3,
    /// The acceleration of what was pressed on, m/s²: their mean by impulse.
    pub carried: DVec3,
}

/// The solves of one body, with their warm starts.
#[derive(Default)]
pub(super) struct Meeting {
    pub(super) found: Vec<Found>,
    contacts: Vec<Contact>,
    /// Velocities in slots: the body's own two, then each guest's; without and with what gravity adds in the part.
    pub(super) before: Vec<DVec3>,
    pub(super) velocities: Vec<DVec3>,
    mobilities: Vec<f64>,
    /// Where each guest's slots begin.
    pub(super) bases: Vec<u32>,
    given: Vec<DVec3>,
    /// The velocities of all slots before a solve.
    free: Vec<DVec3>,
    room: Vec<DVec3>,
    pub(super) touches: Vec<Touch>,
    press: Solver,
    blow: Solver,
    /// 1/kg, and 1/(kg·m²) in world axes.
    inverse: (f64, DMat3),
}

/// A contact and what it is with: a guest, or a fixed solid.
pub(super) struct Found {
    pub contact: Contact,
    pub guest: Option<usize>,
    /// How fast the two approach, m/s.
    pub approach_m_s: f64,
}

/// The solve of a blow: to rounding, as bounces are measured against closed forms.
const BLOW: Settings = Settings { iterations: 400, tolerance_m_s: 1e-12 };
/// A rise of energy below this share of what is exchanged is rounding.
const ENERGY_SLACK: f64 = 1e-6;
/// The solve of a press.
const PRESS: Settings = Settings { iterations: 100, tolerance_m_s: 1e-8 };
/// A body at rest is immovable until it is approached faster than this, m/s.
pub(super) const WAKE_M_S: f64 = 5e-3;
/// Contact that changes the relative velocity by less than this a second does not press, m/s².
const PRESS_M_S2: f64 = 1e-3;

impl Meeting {
    /// The blow of a touch: no time passes. Whether anything approached.
    pub(super) fn blow(
        &mut self,
        me: &mut Me<'_>,
        company: &mut Company,
        fixed: &[StaticSolid],
        strike: Strike,
    ) -> bool {
        company.strike(true);
        self.lay_out(me, company, (0.0, DVec3::ZERO));
        self.find_blows(me, company, fixed, strike);
        let approached = self.found.iter().any(|found| found.approach_m_s > 0.0);
        if approached {
            self.exchange_blow(me, company);
        }
        company.strike(false);
        approached
    }

    /// Solves a blow, and gives everybody what it is.
    fn exchange_blow(&mut self, me: &mut Me<'_>, company: &mut Company) {
        self.wake(company);
        self.blow.reset();
        self.solve(company, 1.0, true);
        self.strike_in_turn(company);
        self.give(me, company, 0.0);
    }

    /// Solves a blow again that made energy: with those contacts alone that approach, and if need be without rebound.
    ///
    /// Newton's law of restitution asks every contact at once for its own speed. A light body that bounces to and fro between
    /// two heavy ones may not leave the one and stay on the other: both would be driven apart. It leaves the one, and strikes
    /// the other in its turn.
    fn strike_in_turn(&mut self, company: &mut Company) {
        for round in 0..2 {
            if !self.makes_energy() {
                return;
            }
            if round == 0 {
                self.found.retain(|found| found.approach_m_s > 0.0);
            } else {
                self.found.iter_mut().for_each(|found| found.contact.rebound_m_s = 0.0);
            }
            self.velocities.clone_from(&self.before);
            self.blow.reset();
            self.solve(company, 1.0, true);
        }
    }

    /// Whether the blow just solved adds energy: the work of its impulses against the mean velocity, beyond rounding.
    fn makes_energy(&self) -> bool {
        let (mut work_j, mut effort_j) = (0.0, 0.0);
        for (contact, impulse) in self.contacts.iter().zip(self.blow.impulses()) {
            let [before, after] = [&self.before, &self.velocities].map(|all| contact.jacobian.velocity(all));
            work_j += 0.5 * impulse.dot(before + after);
            effort_j += impulse.length() * (before.length() + after.length());
        }
        work_j > ENERGY_SLACK * effort_j
    }

    /// Changes the velocities as `h` seconds of contact do, gravity included; `None`, and nothing changed, where nothing
    /// may touch. Nothing moves.
    pub(super) fn press(
        &mut self,
        me: &mut Me<'_>,
        company: &mut Company,
        (fixed, scope): (&[StaticSolid], Scope),
        (h, gravity): (f64, DVec3),
    ) -> Option<Pressed> {
        company.foresee_springs(h);
        self.lay_out(me, company, (h, gravity));
        self.find_presses(me, company, (h, gravity), scope.solids);
        if self.found.is_empty() {
            return None;
        }
        if scope.fixed {
            self.find_fixed(me, company, fixed, (h, gravity));
        }
        self.wake(company);
        self.solve(company, h, false);
        let pressed = self.sum_up(company, h);
        self.give(me, company, h);
        me.motion.velocity += gravity * h;
        Some(pressed)
    }

    /// Velocities, inverse masses and the places of all slots.
    fn lay_out(&mut self, me: &Me<'_>, company: &Company, (h, gravity): (f64, DVec3)) {
        self.inverse = me.motion.inverse_inertia(me.spread);
        let turning = (self.inverse.1.x_axis.x + self.inverse.1.y_axis.y + self.inverse.1.z_axis.z) / 3.0;
        self.found.clear();
        self.bases.clear();
        self.before.clear();
        self.mobilities.clear();
        self.before.extend([me.motion.velocity, me.motion.spin(me.spread)]);
        self.mobilities.extend([self.inverse.0, turning]);
        for guest in company.guests() {
            self.bases.push(self.before.len() as u32);
            if guest.touchable {
                self.before.extend_from_slice(guest.other.velocities());
                self.mobilities.extend(guest.other.velocities().iter().map(|_| 0.0));
                let base = self.mobilities.len() - guest.other.velocities().len();
                guest.scale(&mut self.mobilities[base..]);
            }
        }
        self.velocities.clone_from(&self.before);
        self.velocities[0] += gravity * h;
        for (guest, &base) in company.guests().iter().zip(&self.bases).filter(|(guest, _)| guest.touchable) {
            let gained = if guest.other.is_sprung() { guest.other.gain(h)[0] } else { guest.other.acceleration() * h };
            let count = guest.other.velocities().len();
            let slots = &mut self.velocities[base as usize..base as usize + count];
            if guest.is_chain() {
                slots.iter_mut().step_by(2).for_each(|v| *v += gained);
            } else {
                slots[0] += gained;
                slots[1] += guest.other.gain(h)[1] + guest.other.turning() * (0.5 * h);
            }
        }
    }

    /// Wakes bodies at rest that are approached fast enough.
    fn wake(&self, company: &mut Company) {
        let (guests, ..) = company.split();
        for found in self.found.iter().filter(|found| found.approach_m_s > WAKE_M_S) {
            if let Some(guest) = found.guest.map(|i| &mut guests[i])
                && guest.other.is_held()
            {
                guest.other.wake();
            }
        }
    }

    /// Solves what was found; the velocities of all slots are then those after it. Who stands is taken to be pressed, and where
    /// that was wrong to be free (coupling.md, eq. 7a).
    fn solve(&mut self, company: &mut Company, h: f64, is_blow: bool) {
        self.found.sort_unstable_by_key(|found| found.contact.key);
        self.contacts.clear();
        self.contacts.extend(self.found.iter().map(|found| found.contact));
        self.probe(company);
        let stands = company.press();
        if stands {
            self.free.clone_from(&self.velocities);
        }
        loop {
            self.find_impulses(company, h, is_blow);
            // each time round one more who stands gives way
            if !stands || !company.gives_way(&self.bases, &self.given) {
                break;
            }
            self.velocities.clone_from(&self.free);
            if is_blow { self.blow.undo() } else { self.press.undo() }
        }
        company.release();
    }

    /// Solves the contacts; writes what each slot is given.
    fn find_impulses(&mut self, company: &Company, h: f64, is_blow: bool) {
        let Self { inverse, bases, contacts, mobilities, velocities, press, blow, .. } = self;
        let mut answer = |impulses: &mut [DVec3]| {
            impulses[0] *= inverse.0;
            impulses[1] = inverse.1 * impulses[1];
            for (guest, base) in company.guests().iter().zip(bases.iter()).filter(|(guest, _)| guest.touchable) {
                let from = *base as usize;
                guest.other.respond(&mut impulses[from..from + guest.other.velocities().len()]);
            }
        };
        let (solver, settings) = if is_blow { (blow, BLOW) } else { (press, PRESS) };
        let problem = Problem { contacts, related_keys: &[], h_s: h, mobilities, settings };
        solver.solve(&problem, velocities, &mut answer);
        let solver = if is_blow { &self.blow } else { &self.press };
        self.given.clear();
        self.given.resize(self.velocities.len(), DVec3::ZERO);
        self.contacts.iter().zip(solver.impulses()).for_each(|(c, j)| c.jacobian.scatter(*j, &mut self.given));
    }

    /// Scales the slots of tubes by their inverse mass at their first contact: one answer tells it.
    fn probe(&mut self, company: &Company) {
        let tubes =
            company.guests().iter().zip(&self.bases).enumerate().filter(|(_, (g, _))| g.touchable && g.is_chain());
        for (i, (guest, &base)) in tubes {
            let Some(found) = self.found.iter().find(|found| found.guest == Some(i)) else { continue };
            let Contact { jacobian: slots, normal, .. } = &found.contact;
            self.given.clear();
            self.given.resize(self.velocities.len(), DVec3::ZERO);
            slots.scatter(*normal, &mut self.given);
            let its = base as usize..base as usize + guest.other.velocities().len();
            guest.other.respond(&mut self.given[its.clone()]);
            (self.given[0], self.given[1]) = (DVec3::ZERO, DVec3::ZERO);
            // a contact inside a segment shares itself between two nodes: half of their sum at least
            let scale = 2.0 * slots.velocity(&self.given).dot(*normal);
            self.mobilities[its].iter_mut().step_by(2).for_each(|m| *m = scale);
        }
    }

    /// What fixed solids gave, and how what was pressed on accelerates.
    fn sum_up(&self, company: &Company, h: f64) -> Pressed {
        let mut pressed = Pressed::default();
        let mut weight = 0.0;
        let accelerates = |i: usize| {
            let (other, base) = (&company.guests()[i].other, self.bases[i] as usize);
            // what lasts bends the way of a body on springs too, a blow at the start of the part does not
            if other.is_sprung() { (self.velocities[base] - self.before[base]) / h } else { other.acceleration() }
        };
        for (found, impulse) in self.found.iter().zip(self.press.impulses()) {
            weight += impulse.length();
            match found.guest {
                Some(i) => pressed.carried += accelerates(i) * impulse.length(),
                None => pressed.fixed += *impulse,
            }
        }
        if weight > 0.0 {
            pressed.carried /= weight;
        }
        pressed
    }

    /// Gives everybody what the solve found: the body at once, the others in their ledgers. A press lasts `h` seconds.
    fn give(&mut self, me: &mut Me<'_>, company: &mut Company, h: f64) {
        me.motion.velocity += self.given[0] * self.inverse.0;
        me.motion.angular += self.given[1];
        let after_s = company.after_s;
        for i in 0..company.guests().len() {
            self.account(me, company, i, h);
            self.weigh(company, i, h);
            let (guests, exchange, ..) = company.split();
            let guest = &mut guests[i];
            if guest.touchable {
                let from = self.bases[i] as usize;
                let given = &self.given[from..from + guest.other.velocities().len()];
                if given.iter().any(|impulse| *impulse != DVec3::ZERO) {
                    guest.other.book(exchange, (after_s, h), given);
                    guest.other.push(given, h);
                }
            }
        }
    }

    /// What each tool gave the body in the press just solved.
    pub(super) fn lean_on(&self, company: &Company, leant: &mut Vec<Leant>) {
        for i in (0..company.guests().len()).filter(|&i| company.guests()[i].is_tool()) {
            let mut given = vec![DVec3::ZERO; self.velocities.len()];
            for (found, impulse) in self.found.iter().zip(self.press.impulses()).filter(|(f, _)| f.guest == Some(i)) {
                found.contact.jacobian.scatter(*impulse, &mut given);
            }
            leant.extend(Leant::new(company, i, [given[0], given[1]]));
        }
    }

    /// Finds how the body and guest `i` give way along the normal of the contact that bears most between them.
    fn weigh(&mut self, company: &mut Company, i: usize, h: f64) {
        let solver = if h > 0.0 { &self.press } else { &self.blow };
        let pressed = self.found.iter().zip(solver.impulses()).filter(|(found, _)| found.guest == Some(i));
        let along = pressed.map(|(found, impulse)| (found.contact, impulse.dot(found.contact.normal)));
        let strongest = along.filter(|(_, along)| *along > 0.0).max_by(|a, b| a.1.total_cmp(&b.1));
        let (guests, exchange, ..) = company.split();
        let other = &guests[i].other;
        let (Some((contact, _)), Some(id)) = (strongest, other.id().filter(|_| !other.is_asleep())) else { return };
        let Self { inverse, bases, room, .. } = self;
        let its = bases[i] as usize..bases[i] as usize + other.velocities().len();
        let mut answer = |impulses: &mut [DVec3]| {
            impulses[0] *= inverse.0;
            impulses[1] = inverse.1 * impulses[1];
            other.respond(&mut impulses[its.clone()]);
        };
        let weighed = inverse_mass(&contact, 2, its.end, &mut answer, room);
        exchange.pair_mut(id).inverse_mass_per_kg = Some(weighed);
    }

    /// Writes down what the solve means for the pair with guest `i`.
    fn account(&self, me: &Me<'_>, company: &mut Company, i: usize, h: f64) {
        let impulses = if h > 0.0 { self.press.impulses() } else { self.blow.impulses() };
        let (mut places, mut depth_m, mut work_j, mut along) = (0, 0.0_f64, 0.0, 0.0);
        for (found, impulse) in self.found.iter().zip(impulses).filter(|(found, _)| found.guest == Some(i)) {
            let slots = &found.contact.jacobian;
            let mean = 0.5 * (slots.velocity(&self.before) + slots.velocity(&self.velocities));
            work_j += impulse.dot(mean);
            along += impulse.dot(found.contact.normal);
            places += u32::from(*impulse != DVec3::ZERO);
            depth_m = depth_m.max(-found.contact.gap_m);
        }
        let (guests, exchange, pairs, ..) = company.split();
        let Some(id) = guests[i].other.id().filter(|_| places > 0 || depth_m > 0.0) else { return };
        let mass_kg = guests[i].reduced_kg(me.spread.mass_kg);
        let pair = pairs.of(id, mass_kg);
        pair.touched = true;
        pair.pressed |= along > mass_kg * PRESS_M_S2 * h && h > 0.0;
        pair.rigid = guests[i].is_rigid();
        pair.tank.spend(work_j);
        let state = exchange.pair_mut(id);
        state.contacts = state.contacts.max(places);
        state.penetration_m = state.penetration_m.max(depth_m);
        state.tank_j = Some(pair.tank.left_j());
    }
}
