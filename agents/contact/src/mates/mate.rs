//! One agent that a body that bends touches or is linked to during a step.
//!
//! In: a neighbour, places that touch, impulses. Out: contacts in the slots of the owner's solve, entries in the ledger.
//! Never here: the solve itself, the owner's own state. Theory: docs/theory/coupling.md.

mod carrying;
mod feet;
mod memory;

use super::far::Far;
use super::tanks::{Account, Tanks};
use crate::{Contact, Exchange, Other, WAKE_M_S, inverse_mass};
use crate::{Neighbour, StepContext};
pub use feet::Feet;
use glam::DVec3;
use metachron_core::{Anchor, Inertia};
use metachron_core::{ContactJacobian, PairKind, Twist};
use metachron_geometry::{ContactSide, Place, PlacedShape, ShapeKind, Touch};

/// The bit that tells the keys of contacts with others from those with walls and with the tube itself.
const OTHERS_KEY: u64 = 1 << 63;
/// Where the number of the other begins in a key.
const ID_SHIFT: u32 = 48;
/// Where the part of the other stands in a key, and where in the key of a place that touches.
const PART_SHIFT: u32 = 44;
/// See [`PART_SHIFT`].
const TOUCH_PARTS_SHIFT: u32 = 58;

/// One agent near a body that bends.
#[derive(Clone, Default)]
pub struct Mate {
    /// Where it is.
    pub other: Other,
    /// Its first slot, and how many it has.
    slots: (usize, usize),
    touched: bool,
    friction: f64,
    /// Places that touched in the step, at most; the deepest overlap, metres.
    contacts: u32,
    depth_m: f64,
    /// The contact that bears most in the step, and its impulse, N·s.
    strongest: Option<(Contact, f64)>,
    /// What it weighs: the inverse mass of both sides, 1/kg.
    weighed: Option<[f64; 2]>,
    /// Whether impulses passed in the step, and whether its owner woke it.
    acted: bool,
    /// Linear impulse given in the step, N·s.
    given: DVec3,
    /// Contacts of the substep tried, and their work, J.
    now: u32,
    work_j: f64,
    /// How much of push-out the pair's tank allows.
    fade: f64,
    /// Whether the tank cannot bear any in this substep.
    spent: bool,
    /// The substep tried, seconds.
    span_s: f64,
    woken: bool,
    linked: bool,
    /// The velocities of its slots by which friction takes back how far it is astray, and which share of that the step takes.
    back: Vec<DVec3>,
    back_share: f64,
    /// Whether it is to be known in the next step how far it then is from where it is expected.
    minds: bool,
    /// Whether what lasts is given to it evenly.
    evenly: bool,
    /// What bends was given a second in the substep before, N and N·m in slots; empty for nothing.
    lasts: Vec<DVec3>,
    /// Into how many parts a rigid body is divided among those who press on it, ≥ 1, and what the owner's goes on being given, N and N·m.
    split: f64,
    part: Twist,
    /// By how much its mean velocities in the substep tried are above those at its start, in slots.
    gains: Vec<DVec3>,
    /// What links give it in the substep, in its slots: that lasts, and is no blow.
    lasting: Vec<DVec3>,
    room: Vec<DVec3>,
    /// How a rigid body stands on the owner.
    feet: Feet,
    /// Whether it bends, and somebody else holds it up from below.
    lifted: bool,
}

impl Mate {
    /// Takes in a neighbour with whom it acts by the ledger; whether it is one that can be touched or held.
    pub fn meet(
        &mut self,
        neighbour: &Neighbour,
        around: &StepContext<'_>,
        exchange: &Exchange,
        (friction, touched): (f64, bool),
    ) -> bool {
        let known = self.look(neighbour, around, (exchange, friction), false);
        self.touched = touched;
        self.lifted = self.other.lies() && carrying::is_lifted(neighbour, around);
        self.other.stir(around, exchange);
        known
    }

    /// Takes in a neighbour, as it was published if `stale`; whether it is one that can be touched or held. `friction` is the
    /// owner's.
    pub fn look(
        &mut self,
        neighbour: &Neighbour,
        around: &StepContext<'_>,
        (exchange, friction): (&Exchange, f64),
        stale: bool,
    ) -> bool {
        let there = neighbour.form.as_ref().map_or(0.0, |form| form.friction);
        let (other, room) = (std::mem::take(&mut self.other), std::mem::take(&mut self.room));
        let [mut lasting, mut back, mut lasts] =
            [&mut self.lasting, &mut self.back, &mut self.lasts].map(std::mem::take);
        [&mut lasting, &mut back, &mut lasts].into_iter().for_each(Vec::clear);
        let gains = std::mem::take(&mut self.gains);
        let kept = Self { other, room, lasting, back, lasts, gains, ..Self::default() };
        *self = Self { friction: (friction * there).sqrt(), fade: 1.0, split: 1.0, ..kept };
        if stale { self.other.see(neighbour) } else { self.other.meet(neighbour, around, exchange, None) }
    }

    /// Friction coefficient of the pair.
    pub fn friction(&self) -> f64 {
        self.friction
    }

    /// How its centre, or the mean of its nodes, moves, m/s.
    pub fn velocity(&self) -> DVec3 {
        let list = self.other.velocities();
        if self.other.is_many() {
            let points = list.iter().step_by(self.other.stride());
            let count = points.len();
            return points.sum::<DVec3>() / count as f64;
        }
        list.first().copied().unwrap_or(DVec3::ZERO)
    }

    /// The reduced mass of the pair with an owner of `mass_kg`.
    fn reduced_kg(&self, mass_kg: f64) -> f64 {
        match self.other.neighbour().map(|n| &n.snapshot.inertia) {
            Some(Inertia::Rigid { inverse_mass, .. }) => mass_kg / (1.0 + mass_kg * inverse_mass),
            _ => mass_kg,
        }
    }

    /// Lets the tank of the pair say how far push-out has to fade.
    pub fn ask(&mut self, tanks: &mut Tanks) {
        let velocity = self.velocity();
        if let Some(account) = self.other.id().and_then(|id| tanks.get(id)) {
            account.correct(velocity);
            self.fade = account.fade();
        }
    }

    /// Appends its velocities on the mean of a substep `h`.
    pub fn extend(&mut self, velocities: &mut Vec<DVec3>, h: f64) {
        self.other.foresee(h);
        let [fall, turn] = self.other.gain(h);
        let list = self.other.velocities();
        self.slots = (velocities.len(), list.len());
        velocities.extend_from_slice(list);
        if self.other.is_many() {
            if self.lasts.len() != self.slots.1 {
                self.lasts.clear();
            }
            self.other.gains(h, self.evenly.then_some(&self.lasts), [&mut self.gains, &mut self.room]);
            velocities[self.slots.0..].iter_mut().zip(&self.gains).for_each(|(v, gain)| *v += *gain);
        } else {
            velocities[self.slots.0] += fall;
            velocities[self.slots.0 + 1..][..1].iter_mut().for_each(|spin| *spin += turn);
        }
        self.divide_by(velocities, h);
    }

    /// Takes out of its velocities in the mean of a substep `h` what the other parts of a body that is divided would make of what the owner
    /// goes on giving (eq. 6c).
    fn divide_by(&self, velocities: &mut [DVec3], h: f64) {
        if self.split == 1.0 {
            return;
        }
        let mut moved = self.part.map(|part| part * (h * (self.split - 1.0)));
        self.other.respond(&mut moved);
        self.slots_mut(velocities).iter_mut().zip(moved).for_each(|(v, dv)| *v -= dv);
    }

    /// Turns impulses, in slots of all, into the velocities that they cause in the owner's solve.
    pub fn respond(&self, all: &mut [DVec3]) {
        let list = self.slots_mut(all);
        self.other.respond(list);
        if self.split > 1.0 {
            list.iter_mut().for_each(|v| *v *= self.split);
        }
    }

    /// One past its last slot.
    pub fn end(&self) -> usize {
        self.slots.0 + self.slots.1
    }

    /// Its part of an array of slots.
    pub fn slots_mut<'a>(&self, all: &'a mut [DVec3]) -> &'a mut [DVec3] {
        &mut all[self.slots.0..self.end()]
    }

    /// Whether impulses, in slots of all, tip or lift it off what it stands on.
    pub fn gives_way(&mut self, all: &[DVec3]) -> bool {
        let (first, end) = (self.slots.0, self.end());
        self.other.gives_way(&all[first..end])
    }

    /// Whether the impulses of a solve, with the velocities after it, would add more energy than its tank can bear. It is then pushed out
    /// no more in this substep.
    pub fn overspends<'a>(
        &mut self,
        contacts: impl Iterator<Item = (&'a Contact, &'a DVec3)>,
        velocities: &[DVec3],
        tanks: &mut Tanks,
    ) -> bool {
        let Some(account) = self.other.id().and_then(|id| tanks.get(id)).filter(|_| !self.spent) else { return false };
        let own = contacts.filter(|(contact, _)| self.is_of(contact));
        let work_j: f64 = own.map(|(contact, impulse)| contact.jacobian.velocity(velocities).dot(*impulse)).sum();
        self.spent = work_j > account.most_j();
        self.spent
    }

    /// Whether it is pushed out no more in this substep.
    pub fn is_spent(&self) -> bool {
        self.spent
    }

    /// The fastest of its points through a substep for which all slots have these velocities, m/s.
    pub fn speed(&self, all: &[DVec3]) -> f64 {
        let list = &all[self.slots.0..self.end()];
        let spin = match self.other.form().map(|form| &form.kind) {
            Some(ShapeKind::Solid(solid)) => list[1].length() * solid.radius_m,
            _ => 0.0,
        };
        list.iter().step_by(self.other.stride()).map(|v| v.length_squared()).fold(0.0, f64::max).sqrt() + spin
    }

    /// Where it is, if it can be touched.
    pub fn to_touch(&self) -> Option<PlacedShape<'_>> {
        self.other.placed().filter(|_| self.touched)
    }

    /// Makes contacts of the places that may close within a substep.
    pub fn add_contacts(
        &mut self,
        touches: &[Touch],
        (h, slack_m): (f64, f64),
        velocities: &[DVec3],
        into: &mut Vec<Contact>,
    ) {
        self.span_s = h;
        for touch in touches {
            let mut contact = self.contact(touch);
            let closing = contact.jacobian.velocity(velocities).dot(contact.normal);
            // something fixed may stop the owner on a way on which it would be out of reach
            let towards = contact.jacobian.velocity_from(self.slots.0, velocities).dot(contact.normal);
            if touch.gap_m + closing.min(towards) * h > slack_m {
                continue;
            }
            let parting = -contact.bias_m_s(h);
            if parting > 0.0 && closing < parting {
                // who stands carries no weight of its own: whoever pushes it out does
                contact.rebound_m_s = parting + self.other.lift_m_s(contact.normal, h);
            }
            if self.other.is_held() && closing < -WAKE_M_S {
                self.other.wake();
                self.woken = !self.other.is_held();
            }
            into.push(contact);
        }
    }

    /// The contact of a place: the owner is the first of the two.
    fn contact(&self, touch: &Touch) -> Contact {
        let slots = self.slots_of(touch);
        let key = touch.key.packed();
        let place = key & ((1 << PART_SHIFT) - 1) | (key >> TOUCH_PARTS_SHIFT & 0xf) << PART_SHIFT;
        Contact {
            key: self.key() | place,
            jacobian: slots,
            normal: touch.normal,
            gap_m: if touch.gap_m < 0.0 { touch.gap_m * self.fade } else { touch.gap_m },
            friction: self.friction,
            rebound_m_s: 0.0,
            back_m_s: self.back_m_s(touch),
            age_s: self.other.answers_within_s(),
        }
    }

    /// By which velocity across the normal a place is to come back to where friction holds it, with its sign turned, m/s
    /// (docs/theory/soft.md, eq. 16g).
    fn back_m_s(&self, touch: &Touch) -> DVec3 {
        if self.back.len() != self.other.velocities().len() {
            return DVec3::ZERO;
        }
        let mut slots = ContactJacobian::default();
        self.other.join(&mut slots, 0, &touch.on_b, ContactSide::second(touch.normal));
        let back = slots.velocity(&self.back) * self.fade;
        back - touch.normal * touch.normal.dot(back)
    }

    /// The velocities that a place joins, arms brought to the middle of the gap: force and torque then balance exactly.
    pub fn slots_of(&self, touch: &Touch) -> ContactJacobian {
        let half = 0.5 * touch.gap_m;
        let widened = |place: Place, out: DVec3| match place {
            Place::Point(point) => Place::Point(point + out * half),
            Place::Chain { segment, share, radius_m } => Place::Chain { segment, share, radius_m: radius_m + half },
            Place::Surface { .. } => place,
        };
        let mut slots = ContactJacobian::default();
        widened(touch.on_a, -touch.normal).join(&mut slots, 0, DVec3::ZERO, ContactSide::first(touch.normal));
        let there = widened(touch.on_b, touch.normal);
        self.other.join(&mut slots, self.slots.0 as u32, &there, ContactSide::second(touch.normal));
        slots
    }

    fn key(&self) -> u64 {
        let id = self.other.id().map_or(0, |id| u64::from(id.0));
        OTHERS_KEY | (id & 0x7fff) << ID_SHIFT
    }

    /// Whether a contact is one with this agent.
    pub fn is_of(&self, contact: &Contact) -> bool {
        contact.key >> ID_SHIFT == self.key() >> ID_SHIFT
    }

    /// Appends the size of the inverse mass of its slots.
    pub fn scale(&self, mobilities: &mut Vec<f64>) {
        let from = mobilities.len();
        let inertia = self.other.neighbour().filter(|_| !self.other.is_held()).map(|n| &n.snapshot.inertia);
        match inertia {
            Some(_) if self.other.mobility().is_some() => {
                mobilities.extend(self.other.mobility().into_iter().flatten())
            }
            Some(Inertia::Rigid { inverse_mass, inverse_inertia }) => {
                let trace = (0..3).map(|i| inverse_inertia.col(i)[i]).sum::<f64>();
                mobilities.extend([*inverse_mass, trace / 3.0]);
            }
            Some(Inertia::Deformable(response)) if response.slots() == self.slots.1 => {
                response.append_mobilities(mobilities);
            }
            _ => mobilities.extend(std::iter::repeat_n(0.0, self.slots.1)),
        }
        mobilities[from..].iter_mut().for_each(|mobility| *mobility *= self.split);
    }

    /// The far end of a link to this agent, for a substep of `h` seconds.
    pub fn far(&mut self, there: Anchor, h: f64) -> Option<Far> {
        self.linked = true;
        let (point, velocity) = self.other.carried_m_s(there, h)?;
        let mut slots = ContactJacobian::default();
        self.other.hold(&mut slots, there);
        let inverse_mass = self.other.inverse_mass(&slots);
        Some(Far { point, velocity, inverse_mass })
    }

    /// Adds what a link gives to one of its points.
    pub fn pull(&mut self, there: Anchor, impulse: DVec3) {
        let mut slots = ContactJacobian::default();
        self.other.hold(&mut slots, there);
        self.lasting.resize(self.other.velocities().len(), DVec3::ZERO);
        slots.scatter(impulse, &mut self.lasting);
        self.acted = true;
    }

    /// Turns what links have given so far into the velocities that it causes.
    pub fn give_way(&mut self) {
        if !self.lasting.is_empty() {
            self.other.respond(&mut self.lasting);
        }
    }

    /// How one of its points moves by the velocities of [`Self::give_way`].
    pub fn yield_at(&self, there: Anchor) -> DVec3 {
        let mut slots = ContactJacobian::default();
        self.other.hold(&mut slots, there);
        slots.velocity(&self.lasting)
    }

    /// Forgets what links have given so far.
    pub fn ease(&mut self) {
        self.lasting.clear();
    }

    /// Forgets the contacts of the substep before.
    pub fn begin(&mut self) {
        (self.now, self.work_j, self.spent) = (0, 0.0, false);
    }

    /// Notes the work of one contact against the velocity after it, both sides', J: what only carries a weight does none.
    pub fn spend(&mut self, contact: &Contact, impulse: DVec3, velocity: DVec3) {
        let lift = if contact.rebound_m_s > 0.0 { self.other.lift_m_s(contact.normal, self.span_s) } else { 0.0 };
        self.work_j += (velocity - contact.normal * lift).dot(impulse);
    }

    /// Notes what one contact did in a substep that stands.
    /// Which of the owner's slots something fixed presses is told by `fixed`.
    pub fn note(&mut self, contact: &Contact, impulse: DVec3, fixed: &[bool]) {
        if !self.other.is_many() {
            self.feet.add(contact, impulse, (self.other.centre(), self.slots.0, fixed));
        }
        if impulse != DVec3::ZERO {
            self.acted = true;
            self.now += 1;
            self.contacts = self.contacts.max(self.now);
            self.depth_m = self.depth_m.max(-contact.gap_m / self.fade);
            let along = impulse.dot(contact.normal);
            if self.strongest.is_none_or(|(_, most)| along > most) {
                self.strongest = Some((*contact, along));
            }
        }
    }

    /// Finds what the contact that bears most in the step weighs, where that is due: how the two sides give way to an impulse there along
    /// its normal. `respond` is how the body that owns the contact answers impulses in its `own` slots.
    pub fn weigh(&mut self, tanks: &mut Tanks, own: usize, respond: impl Fn(&mut [DVec3])) {
        // who rests is only held for as long as nobody comes: that is not what it weighs
        let Some((contact, _)) = self.strongest.filter(|_| !self.other.is_asleep()) else { return };
        if !self.other.id().is_some_and(|id| tanks.get(id).is_none_or(Account::weighs)) {
            return;
        }
        let mut room = std::mem::take(&mut self.room);
        let mut answer = |impulses: &mut [DVec3]| {
            respond(&mut impulses[..own]);
            self.other.respond(self.slots_mut(impulses));
        };
        self.weighed = Some(inverse_mass(&contact, own, self.end(), &mut answer, &mut room));
        self.room = room;
    }

    /// Takes its part of the impulses of a substep, books it, and goes on.
    pub fn take(
        &mut self,
        impulses: &mut [DVec3],
        (exchange, tanks): (&mut Exchange, &mut Tanks),
        (start, h): (f64, f64),
    ) {
        if let Some(account) = self.other.id().and_then(|id| tanks.get(id)) {
            account.tank.spend(self.work_j);
        }
        if self.acted {
            let (first, end) = (self.slots.0, self.end());
            let list = &mut impulses[first..end];
            if self.evenly {
                self.spread(list, h);
            }
            self.other.book(exchange, (start, h), list);
            self.last(exchange, (start, h));
            list.iter_mut().zip(&self.lasting).for_each(|(all, part)| *all += *part);
            self.lasting.clear();
            let linear = if self.other.is_many() { list.len() } else { 1 };
            self.given += list[..linear].iter().step_by(self.other.stride()).sum::<DVec3>();
            self.other.push(list, h);
        }
        if self.other.is_many() {
            self.other.go_on_by(h, &self.gains);
        } else {
            let before = self.other.centre();
            self.other.go_on(h);
            self.feet.go(self.other.centre() - before, h);
        }
    }

    /// Books what links give: it acts evenly through the substep.
    fn last(&mut self, exchange: &mut Exchange, (start, h): (f64, f64)) {
        let parts = self.other.parts(h);
        let part_s = h / f64::from(parts);
        self.room.clear();
        self.room.extend(self.lasting.iter().map(|impulse| *impulse / f64::from(parts)));
        for part in (0..parts).filter(|_| !self.lasting.is_empty()) {
            self.other.book(exchange, (start + part_s * f64::from(part), part_s), &self.room);
        }
    }

    /// Writes on the state of the pair.
    pub fn tell(&mut self, exchange: &mut Exchange, tanks: &mut Tanks, mass_kg: f64) {
        if let (true, Some(id)) = (self.acted, self.other.id()) {
            let account = tanks.of(id, self.reduced_kg(mass_kg));
            account.expect(self.velocity(), self.given);
            let pair = exchange.pair_mut(id);
            pair.tank_j = Some(account.tank.left_j());
            pair.kind = if self.linked { PairKind::Attachment } else { PairKind::Ledger };
            (pair.contacts, pair.penetration_m) = (self.contacts, self.depth_m);
            pair.inverse_mass_per_kg = self.weighed.or(pair.inverse_mass_per_kg);
            let bears = self.other.upheld(&self.feet, self.friction).filter(|_| !self.linked);
            pair.bears = bears.filter(|_| account.bore);
            account.bore = bears.is_some();
        }
    }

    /// Whether nothing that moves is touched or held here.
    pub fn is_calm(&self) -> bool {
        !self.acted || self.other.is_held()
    }

    /// Whether it must not rest: it was woken.
    pub fn must_wake(&self) -> bool {
        self.woken
    }
}
