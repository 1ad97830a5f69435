//! The other agents near a tube during one step: what they gave it, where they are, and what it gives them.
//!
//! In: neighbours as they were published; the impulses of the contacts and links that this tube owns. Out: contacts for the
//! tube's own solve, far ends of links, ledgers. Never here: the tube's own state and its solve.
//! Theory: docs/theory/coupling.md.

use super::contact::Skin;
use super::division::Division;
use super::holds::{End, Tie};
use super::mate::Mate;
use super::receive::Received;
use super::sided::Sided;
use super::tank::Tanks;
use crate::coupling::beside::{may_touch, parts};
use crate::coupling::touch::{TouchRoom, touches};
use crate::coupling::{
    Contact, Exchange, Form, Impulse, Law, PairKind, PairState, Placed, Site, Touch, View, WAKE_M_S,
};
use crate::{AgentId, Bounds, Neighbour, SimTime, Snapshot, Surroundings};
use glam::DVec3;
use std::fmt;
use std::sync::Arc;

/// The agents near one tube.
#[derive(Clone, Default)]
pub struct Company {
    form: Option<Arc<Form>>,
    exchange: Exchange,
    received: Received,
    mates: Vec<Mate>,
    /// How many of `mates` are here in this step; the rest is room.
    count: usize,
    room: Room,
    touches: Vec<Touch>,
    impulses: Vec<DVec3>,
    tanks: Tanks,
    sided: Sided,
    /// Who sleeps where the tube may get, and owns the pair: nobody but this tube would see it come.
    knocks: Vec<AgentId>,
    mass_kg: f64,
    watched: bool,
}

/// Room for searches; a copy of a tube starts with none.
#[derive(Default)]
struct Room(TouchRoom);

impl Clone for Room {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl fmt::Debug for Company {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Company").field("count", &self.count).field("exchange", &self.exchange).finish_non_exhaustive()
    }
}

impl Company {
    /// The company of a tube of this form and mass.
    pub fn new(form: Arc<Form>, mass_kg: f64) -> Self {
        Self { form: Some(form), mass_kg, ..Self::default() }
    }

    /// The tube's form.
    pub fn form(&self) -> Option<&Arc<Form>> {
        self.form.as_ref()
    }

    /// Whether anybody is near enough to need to know how the tube answers impulses.
    pub fn is_watched(&self) -> bool {
        self.watched
    }

    /// Begins a step that ends at `until`: takes in what others gave since the last one, in slots of `division`.
    pub fn open(&mut self, around: &Surroundings<'_>, division: &Division, until: SimTime) {
        self.watched = !around.links.is_empty() || around.neighbours.iter().any(|n| n.form.is_some());
        let Self { exchange, received, .. } = self;
        received.clear(2 * division.segments() + 1);
        if !around.neighbours.is_empty() || !exchange.is_empty() {
            exchange.open(around);
            exchange.take(around, until, |_, site, sum, carried| received.add(division, site, sum, carried));
        }
    }

    /// The books of all couplings.
    pub fn exchange(&self) -> &Exchange {
        &self.exchange
    }

    /// The state of the pair with `id`.
    pub fn pair_mut(&mut self, id: AgentId) -> &mut PairState {
        self.exchange.pair_mut(id)
    }

    /// Friction coefficient of the tube's skin.
    pub fn friction(&self) -> f64 {
        self.form.as_ref().map_or(0.0, |form| form.friction)
    }

    /// What it keeps of laws by which the tube acts on itself.
    pub fn sided(&mut self) -> &mut Sided {
        &mut self.sided
    }

    /// Lends what a search for places needs: the tube's form, room, and a list that comes back by [`Self::give_back`].
    pub fn search(&mut self) -> Option<(Arc<Form>, &mut TouchRoom, Vec<Touch>)> {
        let list = std::mem::take(&mut self.touches);
        self.form.clone().map(|form| (form, &mut self.room.0, list))
    }

    /// Takes back the list of a search.
    pub fn give_back(&mut self, list: Vec<Touch>) {
        self.touches = list;
    }

    /// What others gave that acts through the substep that comes, in slots; empty for nothing.
    pub fn fresh(&self) -> &[DVec3] {
        self.received.fresh()
    }

    /// What others gave since the last step.
    pub fn received(&mut self) -> &mut Received {
        &mut self.received
    }

    /// Gathers those whose couplings with this tube it owns, for a step of `dt` seconds from `bounds`.
    pub fn gather(&mut self, around: &Surroundings<'_>, bounds: &Bounds, dt: f64) {
        self.dismiss();
        self.knock(around, bounds, dt);
        let friction = self.friction();
        let Self { mates, count, exchange, tanks, .. } = self;
        for neighbour in around.neighbours.iter().filter(|n| n.owned && n.snapshot.is_finite()) {
            let linked = around.links.iter().any(|link| link.other == neighbour.id);
            let touched = may_touch(neighbour, around, bounds, dt);
            if !(linked || touched) {
                continue;
            }
            if mates.len() == *count {
                mates.push(Mate::default());
            }
            if mates[*count].meet(neighbour, around, exchange, (friction, touched)) {
                mates[*count].ask(tanks);
                *count += 1;
            }
        }
    }

    /// There is nobody in this step.
    pub fn dismiss(&mut self) {
        self.count = 0;
        self.knocks.clear();
    }

    /// Finds those who own the pair with this tube and sleep where it may get within two steps of `dt` seconds.
    fn knock(&mut self, around: &Surroundings<'_>, bounds: &Bounds, dt: f64) {
        if bounds.speed_m_s <= WAKE_M_S {
            return;
        }
        let sleeps = |n: &&Neighbour| !n.owned && n.form.is_some() && n.law != Law::Off && n.snapshot.at_rest;
        for neighbour in around.neighbours.iter().filter(sleeps) {
            let Some(there) = neighbour.snapshot.bounds else { continue };
            let apart = (there.low - bounds.high).max(bounds.low - there.high).max_element();
            if apart < 2.0 * dt * bounds.speed_m_s {
                self.knocks.push(neighbour.id);
            }
        }
    }

    /// Whether there is nobody.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Into how many parts a step of `dt` seconds falls while somebody is near enough to touch or linked.
    pub fn parts(&self, dt: f64) -> u32 {
        if self.is_empty() { 1 } else { parts(dt) }
    }

    /// Appends the velocities that the others would have without this tube, in slots, on the mean of a substep `h`: what is
    /// given at its start and what falls freely through it then meet exactly at its end.
    pub fn extend(&mut self, velocities: &mut Vec<DVec3>, h: f64) {
        self.mates[..self.count].iter_mut().for_each(|mate| mate.extend(velocities, h));
    }

    /// Finds the contacts with the others, whose velocities stand behind the tube's own.
    pub fn find(&mut self, skin: &Skin<'_>, slack_m: f64, contacts: &mut Vec<Contact>) {
        let Self { form, mates, count, room, touches: list, .. } = self;
        let Some(form) = form else { return };
        let here = Placed { form, view: View::Chain { positions: skin.positions, radii_m: skin.radii_m } };
        let (first, speed) = (contacts.len(), skin.speed());
        for mate in &mut mates[..*count] {
            let reach_m = slack_m + (speed + mate.speed(skin.slots)) * skin.h_s;
            let Some(there) = mate.to_touch() else { continue };
            touches(&here, &there, reach_m, &mut room.0, list);
            mate.add_contacts(list, (skin.h_s, slack_m), skin.slots, contacts);
        }
        contacts[first..].sort_unstable_by_key(|contact| contact.key);
    }

    /// Takes in what a solve found: the work of the contacts with others on both sides; `velocities` are those after it.
    pub fn watch<'a>(&mut self, contacts: impl Iterator<Item = (&'a Contact, &'a DVec3)>, velocities: &[DVec3]) {
        let mates = &mut self.mates[..self.count];
        mates.iter_mut().for_each(Mate::begin);
        for (contact, impulse) in contacts {
            let velocity = contact.slots.velocity(velocities);
            let mate = mates.iter_mut().find(|mate| mate.is_of(contact));
            mate.into_iter().for_each(|mate| mate.spend(contact, *impulse, velocity));
        }
    }

    /// Turns the impulses on the others, one a slot, into the velocities they cause; the tube's own slots are left alone.
    pub fn respond(&self, impulses: &mut [DVec3]) {
        self.mates[..self.count].iter().for_each(|mate| mate.other.respond(mate.slots_mut(impulses)));
    }

    /// The size of the inverse mass of each slot of the others, behind those of the tube (docs/theory/contact.md, eq. 9).
    pub fn scale(&self, mobilities: &mut Vec<f64>) {
        self.mates[..self.count].iter().for_each(|mate| mate.scale(mobilities));
    }

    /// Tells links where their far ends are for the substep from `start` to `start + h` seconds of the step.
    pub fn aim(&mut self, ties: &mut [Tie], positions: &[DVec3], (start, h): (f64, f64)) {
        for tie in ties {
            let End::Linked(link) = tie.end else { continue };
            let mate = self.mates[..self.count].iter_mut().find(|mate| mate.other.id() == Some(link.other));
            let Some(far) = mate.and_then(|mate| mate.far(link.there, h)) else { continue };
            let point = tie.mix(positions[tie.segment], positions[tie.segment + 1]);
            tie.aim(&far, point, (start, h));
        }
    }

    /// Gives what the contacts of a substep that stands gave, `start` seconds into the step, and lets the others go on by `h`.
    ///
    /// An impulse acts at the start of its substep: all of the substep's way is made with the velocity after it.
    pub fn accept<'a>(
        &mut self,
        contacts: impl Iterator<Item = (&'a Contact, &'a DVec3)>,
        ties: &[Tie],
        (own, start, h): (usize, f64, f64),
    ) {
        if self.is_empty() && ties.is_empty() {
            return;
        }
        let Self { mates, count, impulses, exchange, tanks, .. } = self;
        let mates = &mut mates[..*count];
        impulses.clear();
        impulses.resize(mates.last().map_or(own, Mate::end), DVec3::ZERO);
        for (contact, impulse) in contacts {
            contact.slots.scatter(*impulse, impulses);
            mates.iter_mut().find(|mate| mate.is_of(contact)).into_iter().for_each(|mate| mate.note(contact, *impulse));
        }
        for tie in ties {
            let (Some(by), impulse) = (tie.by, tie.given) else { continue };
            match tie.end {
                // a tool is led: it only learns of it
                End::Led => {
                    exchange.give(by, Site::Whole, start, Impulse { linear: -impulse, angular: DVec3::ZERO });
                    let pair = exchange.pair_mut(by);
                    (pair.kind, pair.contacts) = (PairKind::Grasp, 1);
                }
                End::Linked(link) => {
                    let mate = mates.iter_mut().find(|mate| mate.other.id() == Some(by));
                    mate.into_iter().for_each(|mate| mate.pull(link.there, -impulse));
                }
            }
        }
        for mate in mates {
            mate.take(impulses, (exchange, tanks), (start, h));
        }
    }

    /// Weighs the strongest contact with each: one answer each at most. `respond` is the tube's own, in `own` slots.
    pub fn weigh(&mut self, own: usize, respond: impl Fn(&mut [DVec3])) {
        let Self { mates, count, tanks, .. } = self;
        mates[..*count].iter_mut().for_each(|mate| mate.weigh(tanks, own, &respond));
    }

    /// Ends a step of `dt` seconds.
    pub fn close(&mut self, around: &Surroundings<'_>, dt: f64) {
        for mate in &mut self.mates[..self.count] {
            mate.tell(&mut self.exchange, &mut self.tanks, self.mass_kg);
        }
        self.tanks.close(dt);
        if !self.exchange.is_empty() {
            self.exchange.close(around, dt);
        }
    }

    /// Whether everybody that the tube touches rests or never moves: only then may it rest itself.
    pub fn is_calm(&self) -> bool {
        self.received.is_empty() && self.mates[..self.count].iter().all(Mate::is_calm)
    }

    /// Writes ledgers and pairs, and who must stay awake.
    pub fn write(&self, into: &mut Snapshot) {
        self.exchange.write(into);
        let woken = self.mates[..self.count].iter().filter(|mate| mate.must_wake()).filter_map(|mate| mate.other.id());
        into.touches.extend(woken.chain(self.knocks.iter().copied()));
    }
}
