//! The agents with which a body that bends shares what it owns: contacts and links.
//!
//! In: neighbours as they were published, the owner's skin, impulses of the owner's solve. Out: contacts and velocities in slots
//! behind the owner's own, far ends of links, ledgers. Never here: the owner's state and its solve, what others give it.
//! Theory: docs/theory/coupling.md.

mod far;
mod mate;
mod tanks;

pub use far::Far;
pub use mate::{Feet, Mate};

use super::{Contact, Exchange, Link, Problem, Solver};
use crate::{Neighbour, StepContext};
use glam::DVec3;
use metachron_core::{AgentId, SimSpan, Snapshot};
use metachron_core::{Foot, Impulse, PairKind, PairState, Site};
use metachron_geometry::narrow_phase::{NarrowPhaseScratch, touches};
use metachron_geometry::{PlacedShape, ShapeKind, ShapePose, Touch};
use tanks::Tanks;

/// All agents with which one body that bends shares what it owns, and the books of all its couplings.
#[derive(Clone, Default)]
pub struct Mates {
    /// What is given to others and taken from them.
    pub exchange: Exchange,
    list: Vec<Mate>,
    /// How many of `list` are here in this step; the rest is room.
    count: usize,
    touches: Vec<Touch>,
    impulses: Vec<DVec3>,
    /// The velocities before a solve.
    free: Vec<DVec3>,
    /// Which of the owner's slots fixed solids press in the substep.
    pressed: Vec<bool>,
    tanks: Tanks,
}

/// The substep in which places are looked for.
#[derive(Debug, Clone, Copy)]
pub struct Search {
    /// Its length, seconds.
    pub h_s: f64,
    /// What is farther than this from closing within it is left out, metres.
    pub slack_m: f64,
    /// The fastest point of the owner, m/s.
    pub speed_m_s: f64,
}

/// An owner, as a solve of its contacts needs it.
pub struct Owner<R> {
    /// How many slots it has: the first ones.
    pub slots: usize,
    /// How it answers impulses, one a slot of its own.
    pub respond: R,
    /// Whether the feet over which another one tips hold through the whole solve (eq. 7n). A tube lets each impulse tell: a box that leans
    /// on it at 240 Hz then lies 0.6 mm deep for 0.85, and the few places at which it touches one agree.
    pub tips: bool,
}

/// What a spring on the owner gave in a substep.
#[derive(Debug, Clone, Copy)]
pub struct Pulled {
    /// Who holds its other end.
    pub by: AgentId,
    /// The link that it is, if that end gives way.
    pub link: Option<Link>,
    /// What it gave the owner, N·s.
    pub given: DVec3,
}

impl Mates {
    /// Gathers those whose couplings the owner has and that are linked to it or, as `near` says, may touch it; `friction` is the
    /// coefficient of its skin.
    pub fn gather(
        &mut self,
        around: &StepContext<'_>,
        friction: f64,
        near: impl Fn(&Neighbour, Option<&PairState>) -> bool,
    ) {
        self.dismiss();
        let Self { list, count, exchange, tanks, .. } = self;
        for neighbour in around.neighbours.iter().filter(|n| n.owned && n.snapshot.is_finite()) {
            let touched = near(neighbour, exchange.pair(neighbour.id));
            if !(touched || is_linked(neighbour.id, around)) {
                continue;
            }
            if list.len() == *count {
                list.push(Mate::default());
            }
            if list[*count].meet(neighbour, around, exchange, (friction, touched)) {
                list[*count].ask(tanks);
                *count += 1;
            }
        }
    }

    /// There is nobody in this step.
    pub fn dismiss(&mut self) {
        self.count = 0;
    }

    /// Whether there is nobody.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Everybody who is here.
    pub fn all_mut(&mut self) -> &mut [Mate] {
        &mut self.list[..self.count]
    }

    fn all(&self) -> &[Mate] {
        &self.list[..self.count]
    }

    fn with(&mut self, id: AgentId) -> Option<&mut Mate> {
        self.all_mut().iter_mut().find(|mate| mate.other.id() == Some(id))
    }

    /// Recalls for a step of `dt` seconds how those that are only touched moved otherwise than expected, and what they were given
    /// (docs/theory/soft.md, eq. 16f, 16g).
    pub fn recall(&mut self, around: &StepContext<'_>, dt: f64) {
        self.for_touched(around, |mate, exchange, tanks| {
            mate.divide(exchange, tanks, around);
            mate.recall(tanks, (around.time, dt));
        });
    }

    /// Recalls for a step of `dt` seconds what those that are only touched were given.
    pub fn regain(&mut self, around: &StepContext<'_>, dt: f64) {
        self.for_touched(around, |mate, exchange, tanks| {
            mate.divide(exchange, tanks, around);
            mate.regain(tanks, dt);
        });
    }

    /// Does `act` with each to whom no link leads.
    fn for_touched(&mut self, around: &StepContext<'_>, mut act: impl FnMut(&mut Mate, &Exchange, &mut Tanks)) {
        let Self { list, count, exchange, tanks, .. } = self;
        let touched = |mate: &&mut Mate| mate.other.id().is_some_and(|id| !is_linked(id, around));
        list[..*count].iter_mut().filter(touched).for_each(|mate| act(mate, exchange, tanks));
    }

    /// Appends the velocities that the others would have without the owner, in slots, on the mean of a substep `h`: what is given at
    /// its start and what falls freely through it then meet exactly at its end.
    pub fn extend(&mut self, velocities: &mut Vec<DVec3>, h: f64) {
        self.all_mut().iter_mut().for_each(|mate| mate.extend(velocities, h));
    }

    /// Appends the contacts with the others, whose velocities stand behind the owner's own.
    pub fn find(
        &mut self,
        here: &PlacedShape<'_>,
        search: Search,
        velocities: &[DVec3],
        (room, contacts): (&mut NarrowPhaseScratch, &mut Vec<Contact>),
    ) {
        let Search { h_s, slack_m, speed_m_s } = search;
        for mate in &mut self.list[..self.count] {
            let reach_m = slack_m + (speed_m_s + mate.speed(velocities)) * h_s;
            let Some(there) = mate.to_touch() else { continue };
            touches(here, &there, reach_m, room, &mut self.touches);
            drop_far_side(here, &there, &mut self.touches);
            let first = contacts.len();
            mate.add_contacts(&self.touches, (h_s, slack_m), velocities, contacts);
            mate.other.bear(contacts[first..].iter().map(|contact| -contact.normal));
        }
    }

    /// Solves the `contacts` of an owner; `problem` tells all else of them. What stands is taken to be pressed, and where that was wrong to be free (docs/theory/coupling.md, eq. 7a): decided impulse by impulse, W
    /// would not be linear, and the solve give nothing. A pair whose push-out would add more energy than its tank can bear is solved again
    /// without (section 5).
    pub fn solve(
        &mut self,
        solver: &mut Solver,
        (contacts, problem): (&mut [Contact], Problem<'_>),
        velocities: &mut [DVec3],
        Owner { slots: own, respond, tips }: Owner<impl Fn(&mut [DVec3])>,
    ) {
        let stands = self.all_mut().iter_mut().map(|mate| mate.other.press(tips)).filter(|stands| *stands).count() > 0;
        let mut free = std::mem::take(&mut self.free);
        free.clear();
        if !self.is_empty() {
            free.extend_from_slice(velocities);
        }
        loop {
            solver.solve(&Problem { contacts, ..problem }, velocities, &mut |impulses: &mut [DVec3]| {
                respond(&mut impulses[..own]);
                self.respond(impulses);
            });
            let found = || contacts.iter().zip(solver.impulses());
            // each time round one more who stands gives way, or is pushed out no more
            let gives_way = stands && self.gives_way(found(), velocities.len());
            if !gives_way && !self.overspends(found(), velocities) {
                break;
            }
            self.stop_push_out(contacts);
            velocities.copy_from_slice(&free);
            solver.undo();
        }
        self.all_mut().iter_mut().for_each(|mate| mate.other.release());
        self.free = free;
    }

    /// Whether the impulses that a solve found tip or lift somebody who stands: the first of them.
    fn gives_way<'a>(&mut self, contacts: impl Iterator<Item = (&'a Contact, &'a DVec3)>, slots: usize) -> bool {
        let Self { list, count, impulses, .. } = self;
        impulses.clear();
        impulses.resize(slots, DVec3::ZERO);
        contacts.for_each(|(contact, impulse)| contact.jacobian.scatter(*impulse, impulses));
        list[..*count].iter_mut().any(|mate| mate.gives_way(impulses))
    }

    /// Whether the impulses that a solve found would add more energy than the tank of their pair can bear: the first of them whose
    /// push-out has not been given up yet.
    fn overspends<'a>(
        &mut self,
        contacts: impl Iterator<Item = (&'a Contact, &'a DVec3)> + Clone,
        velocities: &[DVec3],
    ) -> bool {
        let Self { list, count, tanks, .. } = self;
        list[..*count].iter_mut().any(|mate| mate.overspends(contacts.clone(), velocities, tanks))
    }

    /// Takes push-out from the contacts with those whose tank could not bear it.
    fn stop_push_out(&self, contacts: &mut [Contact]) {
        for mate in self.all().iter().filter(|mate| mate.is_spent()) {
            contacts.iter_mut().filter(|contact| mate.is_of(contact)).for_each(Contact::stop_push_out);
        }
    }

    /// Appends to `feet` where the owner of `own` slots lies on those whom something fixed carries, by the `contacts` of the last substep
    /// (docs/theory/coupling.md, eq. 7p).
    pub fn carry<'a>(
        &mut self,
        contacts: impl Iterator<Item = (&'a Contact, &'a DVec3)> + Clone,
        own: usize,
        feet: &mut Vec<Foot>,
    ) {
        let Self { list, count, impulses, .. } = self;
        list[..*count].iter().for_each(|mate| mate.carry(contacts.clone(), (own, impulses), feet));
    }

    /// Takes in what a solve found: the work of the contacts with others on both sides; `velocities` are those after it.
    pub fn watch<'a>(&mut self, contacts: impl Iterator<Item = (&'a Contact, &'a DVec3)>, velocities: &[DVec3]) {
        let mates = self.all_mut();
        mates.iter_mut().for_each(Mate::begin);
        for (contact, impulse) in contacts {
            let velocity = contact.jacobian.velocity(velocities);
            let mate = mates.iter_mut().find(|mate| mate.is_of(contact));
            mate.into_iter().for_each(|mate| mate.spend(contact, *impulse, velocity));
        }
    }

    /// Turns the impulses on the others, one a slot, into the velocities they cause; the owner's own slots are left alone.
    pub fn respond(&self, impulses: &mut [DVec3]) {
        self.all().iter().for_each(|mate| mate.respond(impulses));
    }

    /// The size of the inverse mass of each slot of the others, behind those of the owner (docs/theory/contact.md, eq. 9).
    pub fn scale(&self, mobilities: &mut Vec<f64>) {
        self.all().iter().for_each(|mate| mate.scale(mobilities));
    }

    /// Where the far end of a link is for a substep of `h` seconds.
    pub fn far(&mut self, link: &Link, h: f64) -> Option<Far> {
        self.with(link.other).and_then(|mate| mate.far(link.there, h))
    }

    /// Gives what the contacts and springs of a substep that stands gave, `start` seconds into the step, and lets the others go on
    /// by `h`. The owner has `own` slots.
    ///
    /// An impulse acts at the start of its substep: all of the substep's way is made with the velocity after it.
    pub fn accept<'a>(
        &mut self,
        contacts: impl Iterator<Item = (&'a Contact, &'a DVec3)>,
        springs: impl Iterator<Item = Pulled>,
        (own, start, h): (usize, f64, f64),
    ) {
        self.impulses.clear();
        self.impulses.resize(self.all().last().map_or(own, Mate::end), DVec3::ZERO);
        self.note(contacts, own);
        springs.for_each(|spring| self.pass_on(&spring, start));
        let Self { list, count, impulses, exchange, tanks, .. } = self;
        list[..*count].iter_mut().for_each(|mate| mate.take(impulses, (exchange, tanks), (start, h)));
    }

    /// Notes the contacts of a substep, those with fixed solids first; the owner has `own` slots.
    fn note<'a>(&mut self, contacts: impl Iterator<Item = (&'a Contact, &'a DVec3)>, own: usize) {
        let Self { list, count, impulses, pressed, .. } = self;
        let mates = &mut list[..*count];
        pressed.clear();
        pressed.resize(own, false);
        for (contact, impulse) in contacts {
            contact.jacobian.scatter(*impulse, impulses);
            match mates.iter_mut().find(|mate| mate.is_of(contact)) {
                Some(mate) => mate.note(contact, *impulse, pressed),
                None if *impulse != DVec3::ZERO => contact.jacobian.mark_fixed(pressed),
                None => {}
            }
        }
    }

    /// Passes on what a spring gave: a tool is led, and only learns of it.
    fn pass_on(&mut self, spring: &Pulled, start: f64) {
        let Pulled { by, link, given } = *spring;
        if let Some(link) = link {
            self.with(by).into_iter().for_each(|mate| mate.pull(link.there, -given));
        } else {
            self.exchange.give(by, Site::Whole, start, Impulse { linear: -given, angular: DVec3::ZERO });
            let pair = self.exchange.pair_mut(by);
            (pair.kind, pair.contacts) = (PairKind::Grasp, 1);
        }
    }

    /// Weighs the strongest contact with each: one answer each at most. `respond` is the owner's, in `own` slots.
    pub fn weigh(&mut self, own: usize, respond: impl Fn(&mut [DVec3])) {
        let Self { list, count, tanks, .. } = self;
        list[..*count].iter_mut().for_each(|mate| mate.weigh(tanks, own, &respond));
    }

    /// Keeps what [`Self::recall`] and [`Self::regain`] ask for in the step after one of `dt` seconds; comes after [`Self::tell`].
    pub fn keep(&mut self, around: &StepContext<'_>, dt: f64) {
        let end = around.time + SimSpan::from_secs_f64(dt).unwrap_or(SimSpan::ZERO);
        let Self { list, count, tanks, .. } = self;
        list[..*count].iter_mut().for_each(|mate| mate.keep(tanks, end));
    }

    /// Writes on the states of all pairs of an owner of `mass_kg`.
    pub fn tell(&mut self, mass_kg: f64) {
        let Self { list, count, exchange, tanks, .. } = self;
        list[..*count].iter_mut().for_each(|mate| mate.tell(exchange, tanks, mass_kg));
    }

    /// Ends a step of `dt` seconds.
    pub fn close(&mut self, around: &StepContext<'_>, dt: f64) {
        self.tanks.close(dt);
        if !self.exchange.is_empty() {
            self.exchange.close(around, dt);
        }
    }

    /// Whether everybody who is touched or held rests or never moves.
    pub fn is_calm(&self) -> bool {
        self.all().iter().all(Mate::is_calm)
    }

    /// Writes ledgers and pairs, and who must stay awake.
    pub fn write(&self, into: &mut Snapshot) {
        self.exchange.write(into);
        into.touches.extend(self.all().iter().filter(|mate| mate.must_wake()).filter_map(|mate| mate.other.id()));
    }
}

/// Drops the places of a closed skin that are more than half way through a solid and lead out of it on the side that is away from the
/// skin's middle: pushed to both sides, a thin plate in a soft body would be given energy without end.
fn drop_far_side(here: &PlacedShape<'_>, there: &PlacedShape<'_>, touches: &mut Vec<Touch>) {
    let (ShapeKind::Surface(skin), ShapePose::Surface(positions)) = (&here.form.kind, here.view) else { return };
    let (ShapeKind::Solid(solid), ShapePose::Solid { position, .. }) = (&there.form.kind, there.view) else { return };
    let half_m = 0.5 * f64::from(solid.shape.compute_local_aabb().half_extents().min_element());
    if !skin.closed || touches.iter().all(|touch| touch.gap_m > -half_m) {
        return;
    }
    let towards = positions.iter().sum::<DVec3>() / positions.len() as f64 - position;
    touches.retain(|touch| touch.gap_m > -half_m || touch.normal.dot(towards) > 0.0);
}

fn is_linked(other: AgentId, around: &StepContext<'_>) -> bool {
    around.links.iter().any(|link| link.other == other)
}
