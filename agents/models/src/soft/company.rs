//! The other agents near a soft body during one step: what they gave it, where they are, and what it gives them.
//!
//! In: neighbours as they were published; the impulses of the contacts and links that this body owns. Out: contacts for the
//! body's own solve, far ends of links, ledgers. Never here: the body's own state and its solve.
//! Theory: docs/theory/coupling.md.

use super::anchor_springs::VertexSpring;
use super::system::System;
use glam::DVec3;
use metachron_contact::StepContext;
use metachron_contact::beside::{bends, may_touch};
use metachron_contact::{Contact, Mate, Mates};
use metachron_core::{Bounds, DT_MAX_S, SimSpan};
use metachron_core::{PairState, Site};

/// Links to one agent are shared in no more rounds than this, and well enough at this error, m/s: a tenth of what counts as rest.
const SHARES_MAX: u32 = 60;
/// See [`SHARES_MAX`].
const SHARED_M_S: f64 = 1e-5;

/// The agents near one soft body.
#[derive(Default)]
pub(super) struct Company {
    mates: Mates,
    impulses: Vec<DVec3>,
    /// What was amiss with each link before and after a round of [`Self::share`], m/s.
    amiss: [Vec<DVec3>; 2],
    /// What others gave since the last step: impulses, and how far they have carried, one a vertex.
    received: Vec<DVec3>,
    carried: Vec<DVec3>,
    was_given: bool,
    watched: bool,
}

impl Company {
    /// Begins a step of `dt` seconds: takes in what others gave since the last one.
    pub fn open(&mut self, around: &StepContext<'_>, vertices: usize, dt: f64) {
        // only what bends may own a pair with this one
        self.watched = around.neighbours.iter().any(|n| !n.owned && bends(n));
        self.was_given = false;
        if around.neighbours.is_empty() && self.mates.exchange.is_empty() {
            return;
        }
        let Self { mates: Mates { exchange, .. }, received, carried, was_given, .. } = self;
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

    /// Whether somebody is near who bends, owns the pair and needs to know how this one answers impulses.
    pub fn is_watched(&self) -> bool {
        self.watched
    }

    /// Gathers those whose couplings with this body it owns, for a step of `dt` seconds from `bounds`.
    pub fn gather(&mut self, around: &StepContext<'_>, bounds: &Bounds, (dt, friction): (f64, f64)) {
        // who has been given something since is no longer on the way that it published
        let turned = |pair: &PairState| pair.in_flight_n_s > 0.0;
        self.mates.gather(around, friction, |neighbour, pair| {
            let span_s = if pair.is_some_and(turned) { dt + DT_MAX_S } else { dt };
            may_touch(neighbour, around, bounds, span_s)
        });
        self.mates.recall(around, dt);
    }

    /// Those whose couplings with this body it owns.
    pub const fn mates(&self) -> &Mates {
        &self.mates
    }

    /// The same, to act on.
    pub const fn mates_mut(&mut self) -> &mut Mates {
        &mut self.mates
    }

    /// Tells links where their far ends are for a substep of `h` seconds.
    pub fn aim(&mut self, ties: &mut [VertexSpring], positions: &[DVec3], h: f64) {
        for i in 0..ties.len() {
            let Some(link) = ties[i].link else { continue };
            let shared = ties.iter().filter(|tie| tie.link.is_some_and(|l| l.other == link.other)).count();
            let Some(far) = self.mates.far(&link, h) else { continue };
            ties[i].aim(&far, positions[ties[i].vertex], h, shared);
        }
    }

    /// Lets links to the same agent know of each other: what each gives moves the far ends of the rest, and so the free velocities
    /// `free` that `system` answers with (soft.md, eq. 4a, 4b).
    pub fn share(&mut self, ties: &mut [VertexSpring], free: &mut [DVec3], system: &System) {
        let other = |tie: &VertexSpring| tie.link.map(|link| link.other);
        let lonely = |tie: &VertexSpring| ties.iter().filter(|t| other(t) == other(tie)).count() < 2;
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
                self.impulses[tie.vertex] += tie.add_prediction(*amiss * share);
            }
            system.respond(&mut self.impulses);
            free.iter_mut().zip(&self.impulses).for_each(|(v, dv)| *v += *dv);
            std::mem::swap(&mut before, &mut amiss);
        }
        self.amiss = [before, amiss];
    }

    /// Finds what is amiss with the expected velocity of each far end, m/s.
    fn find_amiss(&mut self, ties: &[VertexSpring], free: &[DVec3], into: &mut Vec<DVec3>) {
        let mates = self.mates.all_mut();
        mates.iter_mut().for_each(Mate::ease);
        for tie in ties {
            let mate = mates.iter_mut().find(|mate| mate.other.id() == tie.link.map(|link| link.other));
            if let (Some(mate), Some(link)) = (mate, tie.link) {
                mate.pull(link.there, -tie.impulse_at(free[tie.vertex]));
            }
        }
        mates.iter_mut().for_each(Mate::give_way);
        let of = |tie: &VertexSpring| {
            let mate = mates.iter().find(|mate| mate.other.id() == tie.link.map(|link| link.other));
            let moved = tie.link.zip(mate).map(|(link, mate)| mate.yield_at(link.there));
            moved.map_or(DVec3::ZERO, |moved| tie.prediction_error(moved, free[tie.vertex]))
        };
        into.clear();
        into.extend(ties.iter().map(of));
        mates.iter_mut().for_each(Mate::ease);
    }

    /// Gives what a substep gave, `start` seconds into the step, and lets the others go on by `h`.
    pub fn accept<'a>(
        &mut self,
        contacts: impl Iterator<Item = (&'a Contact, &'a DVec3)>,
        ties: &[VertexSpring],
        span: (usize, f64, f64),
    ) {
        if !(self.mates.is_empty() && ties.is_empty()) {
            self.mates.accept(contacts, ties.iter().filter_map(VertexSpring::pulled), span);
        }
    }

    /// Ends a step of `dt` seconds of a body of `mass_kg`.
    pub fn close(&mut self, around: &StepContext<'_>, (dt, mass_kg): (f64, f64)) {
        self.mates.tell(mass_kg);
        self.mates.keep(around, dt);
        self.mates.close(around, dt);
    }

    /// Whether everybody that the body touches rests or never moves: only then may it rest itself.
    pub fn is_calm(&self) -> bool {
        !self.was_given && self.mates.is_calm()
    }
}

/// By how much longer the next step of an iteration is to be than the last, from what was amiss before it and after (BB88).
fn quotient(before: &[DVec3], after: &[DVec3]) -> f64 {
    let pairs = || before.iter().zip(after);
    let size: f64 = pairs().map(|(b, _)| b.length_squared()).sum();
    let change: f64 = pairs().map(|(b, a)| b.dot(*b - *a)).sum();
    if change > 0.0 { size / change } else { 1.0 }
}
