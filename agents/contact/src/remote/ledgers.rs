//! Impulses between two clocks: those that an agent has given its partners, and those that it has taken from them.
//!
//! In: impulses of the pairs that the agent computes, snapshots of partners. Out: new impulses, each once, and the part of a
//! snapshot by which partners read. Never here: how an impulse was found, how a body answers. Theory: docs/theory/coupling.md, section 2.

use crate::lists::entry;
use crate::{Neighbour, StepContext};
use glam::DVec3;
use metachron_core::{AgentId, Impulse, Ledger, PairKind, PairState, SimTime, Site, Snapshot};

/// The ledgers of one agent.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub struct Ledgers {
    /// By rising numbers of the receivers.
    given: Vec<Ledger>,
    /// By rising numbers of the givers.
    taken: Vec<Taken>,
}

/// The impulses taken from one partner.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct Taken {
    copy: Ledger,
    /// The giver's own time in the last reading.
    read: SimTime,
    forces: Vec<SiteForce>,
    /// The copy that it is to have once the step in progress is made, where that has read something; else storage.
    #[serde(skip, default = "unread")]
    next: Ledger,
    #[serde(skip)]
    is_new: bool,
}

/// A ledger in which nothing was read.
const fn unread() -> Ledger {
    Ledger::new(AgentId(0))
}

/// The force of a partner at a site in the last step, N and N·m.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct SiteForce {
    site: Site,
    force: Impulse,
}

/// An impulse that a partner gave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TakenImpulse {
    /// Where it acts.
    pub site: Site,
    /// N·s and N·m·s.
    pub impulse: Impulse,
    /// The same times the seconds since it acted, dJ t − dS, N·s² and N·m·s².
    pub carried: Impulse,
}

impl Ledgers {
    /// Begins a step: pages that partners have taken are torn out.
    pub fn open(&mut self, context: &StepContext<'_>) {
        for ledger in &mut self.given {
            let other = context.neighbours.iter().find(|other| other.id == ledger.with);
            ledger.turn(other.and_then(|other| acknowledged(other, context.me)), context.time);
        }
    }

    /// Takes all that is new, each impulse once (eq. 2): it will act evenly over the step of `dt_s` seconds that begins (eq. 4c). A step that
    /// is not made has taken nothing: until [`Self::settle`] the same is new again.
    pub fn take(&mut self, context: &StepContext<'_>, dt_s: f64, mut apply: impl FnMut(TakenImpulse)) {
        for taken in &mut self.taken {
            taken.forces.clear();
            taken.is_new = false;
        }
        for neighbour in context.neighbours {
            let Some(ledger) = neighbour.snapshot.given.iter().find(|ledger| ledger.with == context.me) else {
                continue;
            };
            if !ledger.is_finite() {
                continue;
            }
            let taken = self.taken_mut(neighbour.id);
            taken.read = taken.read.max(neighbour.snapshot.time);
            // a ledger that is not newer than the copy is not read
            if taken.copy.revision >= ledger.revision {
                continue;
            }
            let Taken { copy, forces, next, is_new, .. } = taken;
            ledger.beyond(Some(copy), context.time, |site, impulse, carried| {
                forces.push(SiteForce { site, force: impulse * dt_s.recip() });
                apply(TakenImpulse { site, impulse, carried });
            });
            *is_new = true;
            next.copy_from(ledger);
            (next.with, next.ahead) = (neighbour.id, None);
            next.coming.clear();
        }
    }

    /// Takes over the copies read in the step, which is made.
    pub fn settle(&mut self) {
        for taken in &mut self.taken {
            if std::mem::take(&mut taken.is_new) {
                std::mem::swap(&mut taken.copy, &mut taken.next);
            }
        }
    }

    /// Books an impulse that acts `after_s` seconds after `time` (eq. 1).
    pub fn give(&mut self, to: AgentId, at: GivenAt, impulse: Impulse) {
        let ledger = entry(&mut self.given, &to, |ledger| ledger.with, || Ledger::new(to));
        ledger.give(at.site, at.time, at.after_s, impulse);
    }

    /// The impulses that `other` has been given and had not taken in the snapshot that is seen, J − J_ack, and the same
    /// times the seconds since they acted: (J − J_ack) t − (S − S_ack) at the time `at`.
    pub fn in_flight(&self, me: AgentId, other: &Neighbour, at: SimTime, visit: impl FnMut(Site, Impulse, Impulse)) {
        if let Ok(place) = self.given.binary_search_by_key(&other.id, |ledger| ledger.with) {
            self.given[place].beyond(acknowledged(other, me), at, visit);
        }
    }

    /// How much linear impulse is on its way to `other`, N·s.
    #[must_use]
    pub fn in_flight_n_s(&self, me: AgentId, other: &Neighbour) -> f64 {
        let mut sum = DVec3::ZERO;
        self.in_flight(me, other, SimTime::ZERO, |_, impulse, _| sum += impulse.linear);
        sum.length()
    }

    /// The forces of `from` in the last step, N and N·m.
    pub fn forces(&self, from: AgentId, mut visit: impl FnMut(Site, Impulse)) {
        if let Ok(place) = self.taken.binary_search_by_key(&from, |taken| taken.copy.with) {
            self.taken[place].forces.iter().for_each(|at| visit(at.site, at.force));
        }
    }

    /// Whether anything was taken in the last step.
    #[must_use]
    pub fn has_taken(&self) -> bool {
        self.taken.iter().any(|taken| !taken.forces.is_empty())
    }

    /// The own time of `from` in the last reading; `None` where nothing of it was ever read.
    #[must_use]
    pub fn read_of(&self, from: AgentId) -> Option<SimTime> {
        let place = self.taken.binary_search_by_key(&from, |taken| taken.copy.with).ok()?;
        Some(self.taken[place].read)
    }

    /// Writes the ledgers that partners read.
    pub fn write(&self, into: &mut Snapshot) {
        copy(self.given.iter(), &mut into.given);
        copy(self.taken.iter().map(|taken| &taken.copy), &mut into.taken);
    }

    fn taken_mut(&mut self, from: AgentId) -> &mut Taken {
        entry(
            &mut self.taken,
            &from,
            |taken| taken.copy.with,
            || Taken {
                copy: Ledger::new(from),
                read: SimTime::ZERO,
                forces: Vec::new(),
                next: unread(),
                is_new: false,
            },
        )
    }
}

/// Where and when an impulse is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GivenAt {
    /// Where on the receiver.
    pub site: Site,
    /// The start of the giver's step.
    pub time: SimTime,
    /// Seconds after that.
    pub after_s: f64,
}

/// The copy that `other` keeps of the impulses that `me` has given it.
#[must_use]
pub fn acknowledged(other: &Neighbour, me: AgentId) -> Option<&Ledger> {
    other.snapshot.taken.iter().find(|ledger| ledger.with == me)
}

/// Copies ledgers into storage that is there already.
fn copy<'a>(from: impl Iterator<Item = &'a Ledger>, into: &mut Vec<Ledger>) {
    let mut count = 0;
    for ledger in from {
        match into.get_mut(count) {
            Some(place) => place.copy_from(ledger),
            None => into.push(ledger.clone()),
        }
        count += 1;
    }
    into.truncate(count);
}

/// The state of a pair, made where it is new.
pub(crate) fn state_of(states: &mut Vec<PairState>, with: AgentId, kind: PairKind) -> &mut PairState {
    entry(states, &with, |state| state.with, || PairState::new(with, kind))
}
