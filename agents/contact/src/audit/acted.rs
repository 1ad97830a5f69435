//! Impulses that owners have given a spring-held body by a certain time, spread evenly over each owner's step, as the body takes them.
//!
//! In: what all agents published last. Out: dJ, and the displacement it has caused by the body's own time. Never here: the body's response.
//! Theory: docs/theory/coupling.md, eq. 4c.

use super::Member;
use metachron_core::{Ahead, Impulse, Ledger, SimTime, Site};
use std::ops::Range;

/// dJ and t dJ − dS, at the body's own time, of all impulses that act by `at` and are not yet in its state.
pub(super) fn acted(member: &Member<'_>, members: &[Member<'_>], at: SimTime) -> [Impulse; 2] {
    let now = member.snapshot.time;
    let mut all = [Impulse::ZERO; 2];
    for giver in members {
        let taken = member.snapshot.taken.iter().find(|ledger| ledger.with == giver.id);
        let ahead = taken.and_then(|taken| taken.ahead).filter(|ahead| ahead.middle_s != 0.0);
        let given = giver.snapshot.given.iter().find(|ledger| ledger.with == member.id);
        let given = given.filter(|given| taken.is_none_or(|taken| given.is_beyond(taken)));
        let back = ahead.map(|ahead| taken_back(&ahead, now, at));
        let new = given.map(|given| {
            let account = Account { given, taken };
            match ahead {
                Some(ahead) => account.acting_evenly(ahead.from..giver.snapshot.time, now, at),
                None => account.due(now, at),
            }
        });
        for [sum, carried] in [back, new].into_iter().flatten() {
            all = [all[0] + sum, all[1] + carried];
        }
    }
    all
}

/// The impulse taken evenly since the owner's last known time, or since `at` if that is earlier, with the opposite sign.
fn taken_back(ahead: &Ahead, now: SimTime, at: SimTime) -> [Impulse; 2] {
    let since_s = now.secs_after(ahead.from.min(at));
    let sum = ahead.sum * (-since_s / (2.0 * ahead.middle_s));
    [sum, sum * (0.5 * since_s)]
}

/// What an owner has given a body, and how much of that the body has taken.
struct Account<'a> {
    given: &'a Ledger,
    taken: Option<&'a Ledger>,
}

impl Account<'_> {
    /// The part that acts by `at` of an impulse given evenly over `span` of the owner's time.
    fn acting_evenly(&self, span: Range<SimTime>, now: SimTime, at: SimTime) -> [Impulse; 2] {
        let Range { start: from, end: until } = span;
        let [sum, carried] = self.outstanding(now);
        if until <= at || until <= from {
            return [sum, carried];
        }
        let acting_s = at.secs_after(from).max(0.0);
        let sum = sum * (acting_s / until.secs_after(from));
        [sum, sum * (now.secs_after(from) - 0.5 * acting_s)]
    }

    /// The part that is due by `at`.
    fn due(&self, now: SimTime, at: SimTime) -> [Impulse; 2] {
        let given = self.given;
        let [mut sum, mut carried] = self.outstanding(now);
        for coming in given.coming.iter().filter(|coming| coming.acts > at) {
            let Some(page) = given.pages.iter().find(|page| page.number == coming.page) else { continue };
            sum += -coming.entry.sum;
            carried += coming.entry.moment - coming.entry.sum * now.secs_after(page.origin);
        }
        [sum, carried]
    }

    /// All that was given and not yet taken.
    fn outstanding(&self, now: SimTime) -> [Impulse; 2] {
        let mut all = [Impulse::ZERO; 2];
        self.given.beyond(self.taken, now, |site, sum, carried| {
            if site == Site::Whole {
                all = [all[0] + sum, all[1] + carried];
            }
        });
        all
    }
}
