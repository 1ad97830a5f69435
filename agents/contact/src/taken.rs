//! What an agent has taken from the owner of one of its couplings.
//!
//! In: that owner's ledger, whenever it is read. Out: a copy of it, and the force that it amounts to, which goes on between
//! readings. Never here: how a body answers. Theory: docs/theory/coupling.md, eq. 2 and 4c.

use super::exchange::{SILENT_STEPS, carried};
use crate::Neighbour;
use metachron_core::{AgentId, SimTime};
use metachron_core::{Ahead, Impulse, Ledger, Site};

/// The copy of one ledger.
#[derive(Debug, Clone)]
pub(super) struct Taken {
    /// What has been taken; what goes on is taken ahead.
    pub(super) copy: Ledger,
    /// The owner's own time in the reading.
    read: Option<SimTime>,
    /// What the owner gave a second in its last step, N and N·m, and how long that was.
    rate: Impulse,
    span_s: f64,
}

impl Taken {
    /// Nothing yet.
    pub(super) const fn new(from: AgentId) -> Self {
        Self { copy: Ledger::new(from), read: None, rate: Impulse::ZERO, span_s: 0.0 }
    }

    /// Keeps a copy of `ledger`.
    pub(super) fn copy_from(&mut self, ledger: &Ledger, owner: &Neighbour) {
        self.copy.copy_from(ledger);
        (self.copy.with, self.read) = (owner.id, Some(owner.snapshot.time));
    }

    /// Looks at the owner: its own time in the reading before.
    pub(super) fn read(&mut self, owner: &Neighbour) -> Option<SimTime> {
        self.read.replace(owner.snapshot.time)
    }

    /// What a step of `dt_s` seconds from `now` takes: dJ, t dJ − dS, and the impulse that acts evenly over the step.
    pub(super) fn follow(
        &mut self,
        ledger: Option<&Ledger>,
        owner: &Neighbour,
        (now, dt_s): (SimTime, f64),
    ) -> [Impulse; 3] {
        let (mut sum, mut carried) = (Impulse::ZERO, Impulse::ZERO);
        if let Some(ahead) = self.copy.ahead.take() {
            (sum, carried) = (-ahead.sum, -ahead.carried(now));
        }
        if self.read.is_none_or(|read| read != owner.snapshot.time) {
            let gained = self.learn(ledger, owner, (now, dt_s));
            (sum, carried) = (sum + gained[0], carried + gained[1]);
        }
        let Some(read) = self.read else { return [sum, carried, Impulse::ZERO] };
        let gap_s = now.secs_after(read);
        let until_s = gap_s + dt_s;
        if until_s > SILENT_STEPS * dt_s.max(self.span_s) {
            self.rate = Impulse::ZERO;
        }
        let meanwhile = self.rate * gap_s;
        let ahead = Ahead { sum: self.rate * until_s, from: read, middle_s: 0.5 * until_s };
        self.copy.ahead = (ahead.sum != Impulse::ZERO).then_some(ahead);
        [sum + meanwhile, carried + meanwhile * (0.5 * gap_s), self.rate * dt_s]
    }

    /// Reads a ledger before a step of `dt_s` seconds: what is new in it by the time `now`, and the force that it amounts to.
    fn learn(&mut self, ledger: Option<&Ledger>, owner: &Neighbour, (now, dt_s): (SimTime, f64)) -> [Impulse; 2] {
        let mut gained = [Impulse::ZERO; 2];
        let began = ledger.and_then(|ledger| ledger.pages.first()).map(|page| page.origin);
        let from = self.read.or(began).unwrap_or(owner.snapshot.time);
        let span_s = owner.snapshot.time.secs_after(from);
        if let Some(ledger) = ledger.filter(|ledger| ledger.is_beyond(&self.copy) || self.read.is_none()) {
            ledger.beyond(Some(&self.copy), now, |site, sum, way| {
                if site == Site::Whole {
                    gained = [gained[0] + sum, gained[1] + carried(owner, dt_s.max(span_s), sum, way)];
                }
            });
            self.copy_from(ledger, owner);
            self.copy.coming.clear(); // what acts late is part of the force
        }
        self.read = Some(owner.snapshot.time);
        if span_s > 0.0 {
            (self.rate, self.span_s) = (gained[0] * span_s.recip(), span_s);
        }
        gained
    }
}
