//! What a coupled agent keeps of its couplings: the ledgers it writes, and copies of those it has taken from.
//!
//! In: what the neighbours published, and the impulses of contacts this agent owns. Out: what is new since the last reading,
//! what is still on its way, and the part of a snapshot that others read. Never here: contacts, laws, how a body answers.
//! Theory: docs/theory/coupling.md, eq. 1–4.

use super::beside::carried;
use super::taken::Taken;
use crate::asynchronous::acknowledged;
use crate::{Neighbour, StepContext};
use glam::DVec3;
use metachron_core::{AgentId, SimTime, Snapshot};
use metachron_core::{Impulse, Ledger, PairKind, PairState, Site};

/// A coupling that this agent owns.
#[derive(Debug, Clone, PartialEq)]
struct Owned {
    ledger: Ledger,
    state: PairState,
    /// Linear impulse given in this step, N·s.
    step_impulse: DVec3,
    /// What a body as a whole was given in this step, and when.
    parts: Vec<(f64, Impulse)>,
    /// What it was given a second at the end of the step before, N and N·m.
    force: Impulse,
    /// When it last did something.
    active: SimTime,
}

/// The couplings of one agent.
#[derive(Debug, Clone, Default)]
pub struct Exchange {
    owned: Vec<Owned>,
    taken: Vec<Taken>,
    /// Room for one reading.
    reading: Option<Ledger>,
    now: SimTime,
    /// Whether the owner takes all of a body that others press on, too, and so expects of two steps the weaker to go on.
    wary: bool,
}

/// The end of a step, seconds: the last part of a slow tube's (docs/theory/coupling.md, section 3).
const END_S: f64 = 1.0 / 60.0;
/// A part begins so much earlier or later than its share of the step.
const END_SLACK: f64 = 0.01;
/// How long a coupling that does nothing is still published, seconds.
const LINGER_S: f64 = 1.0;

impl Exchange {
    /// That of an owner that takes all of a body that others press on, too: of what it gives, a blow is not expected to go on. Of one
    /// that divides bodies ([`Self::default`]) all is, until all owners have found together what each has to give (eq. 6c).
    #[must_use]
    pub fn wary() -> Self {
        Self { wary: true, ..Self::default() }
    }

    /// Begins a step: pages turn, and the step's sums start from nothing.
    pub fn open(&mut self, around: &StepContext<'_>) {
        self.now = around.time;
        for owned in &mut self.owned {
            let other = around.neighbours.iter().find(|n| n.id == owned.ledger.with);
            let taken = other.and_then(|n| acknowledged(n, around.me));
            owned.ledger.turn(taken, around.time);
            owned.step_impulse = DVec3::ZERO;
            owned.parts.clear();
            (owned.state.contacts, owned.state.penetration_m, owned.state.bears) = (0, 0.0, None);
        }
    }

    /// Takes what owners have given since the last reading and what acts before `until`: `apply` gets who, where, dJ, and
    /// t dJ − dS at the step's start.
    ///
    /// A reading that is not newer than the last one, or that is not finite, gives nothing. Returns how many seconds ago the first of it
    /// was given at most: what an owner had given by the state that was read last is no news.
    pub fn take(
        &mut self,
        around: &StepContext<'_>,
        until: SimTime,
        mut apply: impl FnMut(AgentId, Site, Impulse, Impulse),
    ) -> f64 {
        let mut unread_s = 0.0_f64;
        for neighbour in around.neighbours {
            let Some(ledger) = neighbour.snapshot.given.iter().find(|l| l.with == around.me) else { continue };
            let at = self.taken.iter().position(|t| t.copy.with == neighbour.id);
            let read = at.and_then(|at| self.taken[at].read(neighbour));
            let known = at.map(|at| &self.taken[at].copy);
            if known.is_some_and(|known| !ledger.is_beyond(known)) || !ledger.is_finite() {
                continue;
            }
            unread_s = unread_s.max(read.map_or(f64::INFINITY, |read| around.time.secs_after(read)));
            let step_s = until.secs_after(around.time);
            let mut reading = self.reading.take().unwrap_or_else(|| Ledger::new(neighbour.id));
            reading.read(ledger, until);
            reading.since(known, around.time, |site, sum, way| {
                apply(neighbour.id, site, sum, carried(neighbour, step_s, sum, way))
            });
            self.taken_mut(neighbour.id).copy_from(&reading, neighbour);
            self.reading = Some(reading);
        }
        unread_s
    }

    /// Takes what owners give to a body as a whole as forces that go on: what each gave in its last step goes on evenly, until
    /// the next reading tells better. `apply` gets who, dJ and t dJ − dS at the step's start, and what acts over its `dt_s` seconds.
    pub fn follow(&mut self, around: &StepContext<'_>, dt_s: f64, mut apply: impl FnMut(AgentId, [Impulse; 3])) {
        for neighbour in around.neighbours {
            let ledger = neighbour.snapshot.given.iter().find(|l| l.with == around.me && l.is_finite());
            if ledger.is_some() || self.taken.iter().any(|t| t.copy.with == neighbour.id) {
                let taken = self.taken_mut(neighbour.id);
                apply(neighbour.id, taken.follow(ledger, neighbour, (around.time, dt_s)));
            }
        }
    }

    fn taken_mut(&mut self, from: AgentId) -> &mut Taken {
        let at = self.taken.iter().position(|t| t.copy.with == from).unwrap_or_else(|| {
            self.taken.push(Taken::new(from));
            self.taken.len() - 1
        });
        &mut self.taken[at]
    }

    /// Gives `to` an impulse that acts and may be taken so many seconds after the step's start; nobody expects it to go on.
    pub fn give_late(&mut self, to: AgentId, site: Site, times_s: [f64; 2], impulse: Impulse) {
        let now = self.now;
        let owned = self.owned_mut(to);
        owned.ledger.give_late(site, now, times_s, impulse);
        owned.step_impulse += impulse.linear;
        owned.state.impulse_n_s += impulse.linear.length();
        owned.active = now;
    }

    /// Gives `to` an impulse that acts `after_s` seconds into the step.
    pub fn give(&mut self, to: AgentId, site: Site, after_s: f64, impulse: Impulse) {
        let now = self.now;
        let owned = self.owned_mut(to);
        owned.ledger.give(site, now, after_s, impulse);
        owned.step_impulse += impulse.linear;
        if site == Site::Whole {
            owned.parts.push((after_s, impulse));
        }
        owned.state.impulse_n_s += impulse.linear.length();
        owned.active = now;
    }

    /// The state of the coupling with `to`, to be written on; it is made if there is none.
    pub fn pair_mut(&mut self, to: AgentId) -> &mut PairState {
        let now = self.now;
        let owned = self.owned_mut(to);
        owned.active = now;
        &mut owned.state
    }

    /// The state of the coupling with `to`, where there is one.
    #[must_use]
    pub fn pair(&self, to: AgentId) -> Option<&PairState> {
        self.owned.iter().find(|o| o.ledger.with == to).map(|o| &o.state)
    }

    /// Lets others know that `from` may soon give something here: who gives here too then looks at what it gives from the first on.
    pub fn expect(&mut self, from: AgentId) {
        self.taken_mut(from);
    }

    /// What `other` has been given and had not taken in the snapshot that is seen: J − J_ack, and how far that has carried it
    /// by the time `at`: (J − J_ack) t − (S − S_ack).
    pub fn in_flight(&self, me: AgentId, other: &Neighbour, at: SimTime, visit: impl FnMut(Site, Impulse, Impulse)) {
        if let Some(owned) = self.owned.iter().find(|o| o.ledger.with == other.id) {
            owned.ledger.since(acknowledged(other, me), at, visit);
        }
    }

    /// Ends a step of `dt_s` seconds: forces are known, and what is still on its way.
    pub fn close(&mut self, around: &StepContext<'_>, dt_s: f64) {
        for owned in &mut self.owned {
            if !(owned.state.kind.is_penalty() || owned.state.kind == PairKind::Tlm) {
                owned.state.force_n = owned.step_impulse.length() / dt_s;
            }
            owned.go_on(dt_s, self.wary);
            let other = around.neighbours.iter().find(|n| n.id == owned.ledger.with);
            let mut on_its_way = DVec3::ZERO;
            // who is not looked at any more has settled
            if let Some(other) = other {
                let taken = acknowledged(other, around.me);
                owned.ledger.since(taken, around.time, |_, sum, _| on_its_way += sum.linear);
            }
            owned.state.in_flight_n_s = on_its_way.length();
        }
    }

    /// Writes the ledgers, the acknowledgements and the states of the pairs.
    pub fn write(&self, into: &mut Snapshot) {
        let lively = |owned: &&Owned| owned.state.in_flight_n_s > 0.0 || self.now.secs_after(owned.active) <= LINGER_S;
        copy(self.owned.iter().filter(lively).map(|o| &o.ledger), &mut into.given);
        copy(self.taken.iter().map(|t| &t.copy), &mut into.taken);
        into.pairs.clear();
        into.pairs.extend(self.owned.iter().filter(lively).map(|o| o.state));
    }

    /// What `to` is expected to be given a second from now on, as a whole, N and N·m: as it was told in the last step.
    #[must_use]
    pub fn goes_on(&self, to: AgentId) -> Impulse {
        self.owned.iter().find(|owned| owned.ledger.with == to).map_or(Impulse::ZERO, |owned| owned.ledger.force)
    }

    /// Whether nothing was ever exchanged.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.owned.is_empty() && self.taken.is_empty()
    }

    fn owned_mut(&mut self, to: AgentId) -> &mut Owned {
        let at = self.owned.iter().position(|o| o.ledger.with == to).unwrap_or_else(|| {
            let state = PairState::new(to, PairKind::default());
            let active = self.now;
            self.owned.push(Owned {
                ledger: Ledger::new(to),
                state,
                step_impulse: DVec3::ZERO,
                parts: Vec::new(),
                force: Impulse::ZERO,
                active,
            });
            self.owned.len() - 1
        });
        &mut self.owned[at]
    }
}

impl Owned {
    /// Notes what a body was given a second at the end of a step of `dt_s` seconds: it is expected to go on, of a `wary` owner as the weaker
    /// of the last two steps ended.
    fn go_on(&mut self, dt_s: f64, wary: bool) {
        let late = self.parts.iter().filter(|(after_s, _)| *after_s >= dt_s - END_S * (1.0 + END_SLACK));
        let now = late.fold(Impulse::ZERO, |sum, (_, part)| sum + *part) * dt_s.min(END_S).recip();
        let before = std::mem::replace(&mut self.force, now);
        let weaker = wary && before.linear.length_squared() < now.linear.length_squared();
        self.ledger.force = if weaker { before } else { now };
    }
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
