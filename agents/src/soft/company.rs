//! The other agents near a soft body during one step: what they gave it, where they are, and what it gives them.
//!
//! In: neighbours as they were published; the impulses of the contacts and links that this body owns. Out: contacts for the
//! body's own solve, far ends of links, ledgers. Never here: the body's own state and its solve.
//! Theory: docs/theory/coupling.md; a soft body owns every pair but those with faster soft bodies.

use super::holds::Tie;
use super::system::System;
use crate::coupling::beside::may_touch;
use crate::coupling::touch::{TouchRoom, touches};
use crate::coupling::{Contact, Exchange, Impulse, PairKind, Placed, Site, Touch};
use crate::rod::{Mate, Tanks};
use crate::{Body, Bounds, DT_MAX_S, SimSpan, Snapshot, Surroundings};
use glam::DVec3;

/// Links to one agent are shared in no more rounds than this, and well enough at this error, m/s: a tenth of what counts as rest.
const SHARES_MAX: u32 = 60;
/// See [`SHARES_MAX`].
const SHARED_M_S: f64 = 1e-5;

/// The agents near one soft body.
#[derive(Default)]
pub(super) struct Company {
    exchange: Exchange,
    mates: Vec<Mate>,
    /// How many of `mates` are here in this step; the rest is room.
    count: usize,
    touches: Vec<Touch>,
    impulses: Vec<DVec3>,
    /// What was amiss with each link before and after a round of [`Self::share`], m/s.
    amiss: [Vec<DVec3>; 2],
    tanks: Tanks,
    /// What others gave since the last step: impulses, and how far they have carried, one a vertex.
    received: Vec<DVec3>,
    carried: Vec<DVec3>,
    was_given: bool,
    watched: bool,
}

impl Company {
    /// Begins a step of `dt` seconds: takes in what others gave since the last one.
    pub fn open(&mut self, around: &Surroundings<'_>, vertices: usize, dt: f64) {
        // only another soft body may own a pair with this one
        self.watched = around.neighbours.iter().any(|n| !n.owned && matches!(n.snapshot.body, Body::Soft(_)));
        self.was_given = false;
        if around.neighbours.is_empty() && self.exchange.is_empty() {
            return;
        }
        let Self { exchange, received, carried, was_given, .. } = self;
        exchange.open(around);
        let until = around.time + SimSpan::from_secs_f64(dt).unwrap_or(SimSpan::ZERO);
        exchange.take(around, until, |_, site, sum, moved| {
            let Site::Vertex(vertex) = site else { return };
            if !std::mem::replace(was_given, true) {
                for list in [&mut *received, &mut *carried] {
                    list.clear();
                    list.resize(vertices, DVec3::ZERO);
                }
            }
            if let Some(place) = received.get_mut(vertex as usize) {
                *place += sum.linear;
                carried[vertex as usize] += moved.linear;
            }
        });
    }

    /// What others gave since the last step, one a vertex: impulses, and how far they carried; `None` for nothing.
    pub fn received(&mut self) -> Option<[&mut Vec<DVec3>; 2]> {
        self.was_given.then_some([&mut self.received, &mut self.carried])
    }

    /// Whether a soft body is near that needs to know how this one answers impulses.
    pub fn is_watched(&self) -> bool {
        self.watched
    }

    /// Gathers those whose couplings with this body it owns, for a step of `dt` seconds from `bounds`.
    pub fn gather(&mut self, around: &Surroundings<'_>, bounds: &Bounds, (dt, friction): (f64, f64)) {
        self.count = 0;
        let Self { mates, count, exchange, tanks, .. } = self;
        for neighbour in around.neighbours.iter().filter(|n| n.owned && n.snapshot.is_finite()) {
            let linked = around.links.iter().any(|link| link.other == neighbour.id);
            // who has been given something since is no longer on the way that it published
            let turned = exchange.pair(neighbour.id).is_some_and(|pair| pair.in_flight_n_s > 0.0);
            let touched = may_touch(neighbour, around, bounds, if turned { dt + DT_MAX_S } else { dt });
            if !(linked || touched) {
                continue;
            }
            if mates.len() == *count {
                mates.push(Mate::default());
            }
            if mates[*count].meet(neighbour, around, exchange, (friction, touched)) {
                mates[*count].ask(tanks);
                if !linked {
                    mates[*count].recall(tanks, (around.time, dt));
                }
                *count += 1;
            }
        }
    }

    /// Whether there is nobody.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Appends the velocities that the others would have without this body, in slots.
    pub fn extend(&mut self, velocities: &mut Vec<DVec3>, h: f64) {
        self.mates[..self.count].iter_mut().for_each(|mate| mate.extend(velocities, h));
    }

    /// Finds the contacts with the others, whose velocities stand behind the body's own.
    pub fn find(
        &mut self,
        here: &Placed<'_>,
        (h, slack_m, speed): (f64, f64, f64),
        velocities: &[DVec3],
        (room, contacts): (&mut TouchRoom, &mut Vec<Contact>),
    ) {
        for mate in &mut self.mates[..self.count] {
            let reach_m = slack_m + (speed + mate.speed(velocities)) * h;
            let Some(there) = mate.to_touch() else { continue };
            touches(here, &there, reach_m, room, &mut self.touches);
            mate.add_contacts(&self.touches, (h, slack_m), velocities, contacts);
        }
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

    /// Begins a solve: whether somebody stands on something fixed, which is taken to carry what presses it.
    pub fn press(&mut self) -> bool {
        self.mates[..self.count].iter_mut().map(|mate| mate.other.press()).filter(|stands| *stands).count() > 0
    }

    /// Whether the impulses that a solve found tip or lift somebody who stands: the first of them.
    pub fn gives_way<'a>(&mut self, contacts: impl Iterator<Item = (&'a Contact, &'a DVec3)>, slots: usize) -> bool {
        let Self { mates, count, impulses, .. } = self;
        impulses.clear();
        impulses.resize(slots, DVec3::ZERO);
        contacts.for_each(|(contact, impulse)| contact.slots.scatter(*impulse, impulses));
        mates[..*count].iter_mut().any(|mate| mate.gives_way(impulses))
    }

    /// Ends a solve.
    pub fn release(&mut self) {
        self.mates[..self.count].iter_mut().for_each(|mate| mate.other.release());
    }

    /// Turns the impulses on the others, one a slot, into the velocities they cause; the body's own slots are left alone.
    pub fn respond(&self, impulses: &mut [DVec3]) {
        self.mates[..self.count].iter().for_each(|mate| mate.other.respond(mate.slots_mut(impulses)));
    }

    /// The size of the inverse mass of each slot of the others, behind those of the body.
    pub fn scale(&self, mobilities: &mut Vec<f64>) {
        self.mates[..self.count].iter().for_each(|mate| mate.scale(mobilities));
    }

    /// Tells links where their far ends are for a substep of `h` seconds.
    pub fn aim(&mut self, ties: &mut [Tie], positions: &[DVec3], h: f64) {
        for i in 0..ties.len() {
            let Some(link) = ties[i].link else { continue };
            let shared = ties.iter().filter(|tie| tie.link.is_some_and(|l| l.other == link.other)).count();
            let mate = self.mates[..self.count].iter_mut().find(|mate| mate.other.id() == Some(link.other));
            let Some(far) = mate.and_then(|mate| mate.far(link.there, h)) else { continue };
            ties[i].aim(&far, positions[ties[i].vertex], (h, shared));
        }
    }

    /// Lets links to the same agent know of each other: what each gives moves the far ends of the rest, and so the free velocities
    /// `free` that `system` answers with (soft.md, eq. 4a, 4b).
    pub fn share(&mut self, ties: &mut [Tie], free: &mut [DVec3], system: &System) {
        let other = |tie: &Tie| tie.link.map(|link| link.other);
        let lonely = |tie: &Tie| ties.iter().filter(|t| other(t) == other(tie)).count() < 2;
        if ties.iter().all(|tie| tie.link.is_none() || lonely(tie)) {
            return;
        }
        let mut share = 1.0;
        let [mut before, mut amiss] = std::mem::take(&mut self.amiss);
        before.clear();
        for _ in 0..SHARES_MAX {
            self.find_amiss(ties, free, &mut amiss);
            if amiss.iter().all(|amiss| amiss.length() < SHARED_M_S) {
                break;
            }
            share *= quotient(&before, &amiss);
            self.impulses.clear();
            self.impulses.resize(free.len(), DVec3::ZERO);
            for (tie, amiss) in ties.iter_mut().zip(&amiss) {
                self.impulses[tie.vertex] += tie.spare(*amiss * share);
            }
            system.respond(&mut self.impulses);
            free.iter_mut().zip(&self.impulses).for_each(|(v, dv)| *v += *dv);
            std::mem::swap(&mut before, &mut amiss);
        }
        self.amiss = [before, amiss];
    }

    /// Finds what is amiss with the expected velocity of each far end, m/s.
    fn find_amiss(&mut self, ties: &[Tie], free: &[DVec3], into: &mut Vec<DVec3>) {
        let mates = &mut self.mates[..self.count];
        mates.iter_mut().for_each(Mate::ease);
        for tie in ties {
            let mate = mates.iter_mut().find(|mate| mate.other.id() == tie.link.map(|link| link.other));
            if let (Some(mate), Some(link)) = (mate, tie.link) {
                mate.pull(link.there, -tie.gives(free[tie.vertex]));
            }
        }
        mates.iter_mut().for_each(Mate::give_way);
        let of = |tie: &Tie| {
            let mate = mates.iter().find(|mate| mate.other.id() == tie.link.map(|link| link.other));
            let moved = tie.link.zip(mate).map(|(link, mate)| mate.yield_at(link.there));
            moved.map_or(DVec3::ZERO, |moved| tie.amiss(moved, free[tie.vertex]))
        };
        into.clear();
        into.extend(ties.iter().map(of));
        mates.iter_mut().for_each(Mate::ease);
    }

    /// Gives what the contacts and ties of a substep gave, `start` seconds into the step, and lets the others go on by `h`.
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
            let Some(by) = tie.by else { continue };
            match tie.link {
                // a tool is led: it only learns of it
                None => {
                    exchange.give(by, Site::Whole, start, Impulse { linear: -tie.given, angular: DVec3::ZERO });
                    let pair = exchange.pair_mut(by);
                    (pair.kind, pair.contacts) = (PairKind::Grasp, 1);
                }
                Some(link) => {
                    let mate = mates.iter_mut().find(|mate| mate.other.id() == Some(by));
                    mate.into_iter().for_each(|mate| mate.pull(link.there, -tie.given));
                }
            }
        }
        for mate in mates {
            mate.take(impulses, (exchange, tanks), (start, h));
        }
    }

    /// Weighs the strongest contact with each: one answer each at most.
    pub fn weigh(&mut self, system: &System) {
        let Self { mates, count, tanks, .. } = self;
        let mates = mates[..*count].iter_mut();
        mates.for_each(|mate| mate.weigh(tanks, system.vertices(), |impulses| system.respond(impulses)));
    }

    /// Ends a step of `dt` seconds of a body of `mass_kg`.
    pub fn close(&mut self, around: &Surroundings<'_>, (dt, mass_kg): (f64, f64)) {
        let end = around.time + SimSpan::from_secs_f64(dt).unwrap_or(SimSpan::ZERO);
        for mate in &mut self.mates[..self.count] {
            mate.tell(&mut self.exchange, &mut self.tanks, mass_kg);
            mate.keep(&mut self.tanks, end);
        }
        self.tanks.close(dt);
        if !self.exchange.is_empty() {
            self.exchange.close(around, dt);
        }
    }

    /// Whether everybody that the body touches rests or never moves: only then may it rest itself.
    pub fn is_calm(&self) -> bool {
        !self.was_given && self.mates[..self.count].iter().all(Mate::is_calm)
    }

    /// Writes ledgers and pairs, and who must stay awake.
    pub fn write(&self, into: &mut Snapshot) {
        self.exchange.write(into);
        let woken = self.mates[..self.count].iter().filter(|mate| mate.must_wake()).filter_map(|mate| mate.other.id());
        into.touches.extend(woken);
    }
}

/// By how much longer the next step of an iteration is to be than the last, from what was amiss before it and after (BB88).
fn quotient(before: &[DVec3], after: &[DVec3]) -> f64 {
    let pairs = || before.iter().zip(after);
    let size: f64 = pairs().map(|(b, _)| b.length_squared()).sum();
    let change: f64 = pairs().map(|(b, a)| b.dot(*b - *a)).sum();
    if change > 0.0 { size / change } else { 1.0 }
}
