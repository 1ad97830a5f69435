//! Blows: contacts that rebound, each at its own time within a fine step.
//!
//! In: the places of a fine step, what a solve gave. Out: which of them rebound and when, by how much later than the step's start each
//! impulse acts, how many fine steps the macro step needs. Never here: how a rebound is solved ([`crate::cluster`]).
//! Theory: docs/theory/clusters.md, section 9.
//!
//! A blow is solved with the speed at which its sides meet, and changes velocities from the start of the step. A body that nothing else
//! holds is then carried to where the blow at its own time would have left it (eq. 27), so its flight is exact on both sides of it.
//! Blows of one body that are further apart in time are in fine steps of their own, up to [`PARTS_MAX`] in a macro step. There blows that
//! share a body are one event, at the time of the first, and one that its blow would send through something else does not rebound.

use super::Participant;
use super::foresight::Foresight;
use super::memory::Partner;
use super::progress::Progress;
use super::search::{Owner, Search};
use super::ties::Ties;
use crate::cluster::Contact;
use glam::DVec3;
use metachron_core::DisjointSets;

/// The most fine steps of a macro step that blows ask for.
const PARTS_MAX: u32 = 16;

/// By how much steps are divided in which a body that rebounds strikes another.
const DIVIDED: u32 = 4;

/// What decides whether a contact rebounds.
#[derive(Debug, Clone, Default)]
pub(super) struct Rebounds {
    /// The macro step and the fine step that are made, seconds.
    macro_s: f64,
    step_s: f64,
    /// The blows of each participant in the fine step.
    blows: Vec<Option<Blows>>,
    /// How many fine steps the macro step is made in, and how many blows ask for.
    made: u32,
    parts: u32,
    /// Participants whose blows were solved as one, and when those act.
    events: DisjointSets,
    times_s: Vec<f64>,
    foresight: Foresight,
}

/// When a participant meets what it rebounds off.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Blows {
    first_s: f64,
    last_s: f64,
    /// The pair that it meets first.
    pair: (usize, Partner),
}

/// Two sides that close.
struct Meeting {
    after_s: f64,
    /// The speed at which they close then, and by how much they part faster at the step's end, without the blow.
    approach_m_s: f64,
    gained_m_s: f64,
}

impl Rebounds {
    /// Begins a fine step of so many participants.
    pub fn begin(&mut self, macro_s: f64, step_s: f64, participants: usize) {
        (self.macro_s, self.step_s) = (macro_s, step_s);
        (self.made, self.parts) = ((macro_s / step_s).round() as u32, 1);
        self.blows.clear();
        self.blows.resize(participants, None);
    }

    /// How many fine steps the macro step has to be made in; `None` where those that it is made in are enough.
    pub fn wanted_parts(&self) -> Option<u32> {
        (self.parts > self.made).then_some(self.parts)
    }

    /// Before the solve: takes the blows of the step as far as flights tell, leaves out those that meet later.
    pub fn foresee(&mut self, all: &[Participant<'_>], search: &mut Search, ties: &Ties, progress: &[Progress]) {
        if !any_rebounds(search) {
            return;
        }
        let mut foresight = std::mem::take(&mut self.foresight);
        foresight.begin(search, ties, progress);
        let mut start = 0;
        while start < search.owners.len() {
            let pair = search.owners[start].pair();
            let end = start + search.owners[start..].iter().take_while(|owner| owner.pair() == pair).count();
            if search.contacts[start..end].iter().any(|contact| contact.restitution > 0.0) {
                foresight.look(all, search, start..end, progress);
                (start..end).for_each(|at| self.meet(&foresight, &mut search.contacts[at], &mut search.owners[at]));
            }
            start = end;
        }
        self.foresight = foresight;
        search.retain(|owner| owner.meets_s.is_none_or(|meets_s| meets_s < self.step_s));
    }

    /// Takes one contact for a blow, or its rebound.
    fn meet(&mut self, foresight: &Foresight, contact: &mut Contact, owner: &mut Owner) {
        if contact.restitution <= 0.0 {
            return;
        }
        let Some(Meeting { after_s, approach_m_s, gained_m_s }) = self.meeting(foresight, contact) else {
            contact.restitution = 0.0;
            return;
        };
        owner.meets_s = Some(after_s);
        (contact.approach_m_s, contact.gained_m_s) = (approach_m_s, gained_m_s);
        // one that slows down on its way meets within the step all the same
        contact.gap_m = contact.gap_m.min(approach_m_s * self.step_s);
        if after_s < self.step_s {
            owner.movers(contact).for_each(|member| self.note(member, after_s, owner.pair()));
        }
    }

    /// Notes a blow of a participant, and asks for steps that are no longer than what is between it and the others.
    fn note(&mut self, member: usize, after_s: f64, pair: (usize, Partner)) {
        let blows = self.blows[member].get_or_insert(Blows { first_s: after_s, last_s: after_s, pair });
        if after_s < blows.first_s {
            (blows.first_s, blows.pair) = (after_s, pair);
        } else if pair == blows.pair {
            return;
        }
        blows.last_s = blows.last_s.max(after_s);
        let apart_s = blows.last_s - blows.first_s;
        // steps are whole nanoseconds
        let finest_s = self.macro_s / f64::from(PARTS_MAX) * (1.0 + 1e-6);
        if apart_s > finest_s {
            let parts = (self.macro_s / apart_s).ceil() as u32;
            self.parts = self.parts.max(parts.next_power_of_two().min(PARTS_MAX));
        }
    }

    /// After a solve: what is struck by what rebounds, or is sent through something by it, was not foreseen.
    pub fn stop(&mut self, search: &mut Search) {
        if !any_rebounds(search) {
            return;
        }
        let is_new = |contact: &Contact, owner: &Owner| contact.restitution > 0.0 && owner.meets_s.is_none();
        for at in 0..search.contacts.len() {
            let (contact, owner) = (&search.contacts[at], search.owners[at]);
            if !is_new(contact, &owner) {
                continue;
            }
            let struck = owner.movers(contact).any(|member| self.blows[member].is_some());
            search.contacts[at].restitution = 0.0;
            if !struck {
                continue;
            }
            if self.made < PARTS_MAX {
                self.parts = self.parts.max((DIVIDED * self.made).min(PARTS_MAX));
            } else {
                owner.both().for_each(|member| self.calm(search, member));
            }
        }
    }

    /// Takes the rebounds of a participant.
    fn calm(&self, search: &mut Search, member: usize) {
        for (contact, owner) in search.contacts.iter_mut().zip(&search.owners) {
            if owner.both().any(|other| other == member) {
                contact.restitution = 0.0;
            }
        }
    }

    /// When the sides of a contact meet that then rebound, seconds from now: before now where they are in each other.
    fn meeting(&self, foresight: &Foresight, contact: &Contact) -> Option<Meeting> {
        let gain_m_s = |at: usize| foresight.gain_m_s(at, &contact.sides[at], contact.normal);
        let gain_m_s2 = (gain_m_s(1) - gain_m_s(0)) / self.step_s;
        let after_s = first_root(contact.gap_m, contact.approach_m_s, gain_m_s2)?.max(-self.step_s);
        let approach_m_s = contact.approach_m_s + gain_m_s2 * after_s;
        let gained_m_s = -gain_m_s2 * (self.step_s - after_s);
        // what parts for less than a macro step would hop at every step
        let flies = 2.0 * contact.restitution * approach_m_s > gain_m_s2 * self.macro_s;
        // what meets in a later step is decided then
        (flies || after_s >= self.step_s).then_some(Meeting { after_s, approach_m_s, gained_m_s })
    }

    /// Adds to what each participant is carried by, N·s²: −τ Jᵀλ of each blow, that acts τ seconds into the step (eq. 27).
    ///
    /// Blows that share a body in one fine step were solved as one and come at one time, that of the first: the impulses of a light body
    /// between two heavy ones cancel but for its own momentum, and at times of their own would carry it through both.
    pub fn note_late(&mut self, search: &Search, impulses_n_s: &[DVec3], progress: &mut [Progress]) {
        let Self { events, times_s, .. } = self;
        let all = || search.contacts.iter().zip(&search.owners).zip(impulses_n_s);
        let blows = || {
            all().filter_map(|((contact, owner), impulse)| {
                let meets_s = owner.meets_s.filter(|_| contact.restitution > 0.0 && *impulse != DVec3::ZERO)?;
                Some((contact, owner, impulse, meets_s, owner.movers(contact).next()?))
            })
        };
        events.reset(progress.len());
        blows()
            .for_each(|(contact, owner, _, _, first)| owner.movers(contact).for_each(|body| events.join(first, body)));
        times_s.clear();
        times_s.resize(progress.len(), f64::INFINITY);
        for (_, _, _, meets_s, first) in blows() {
            let time_s = &mut times_s[events.lowest(first)];
            *time_s = time_s.min(meets_s);
        }
        for (contact, _, impulse, _, first) in blows() {
            let acts_s = times_s[events.lowest(first)];
            for (side, sign) in contact.sides.iter().zip([1.0, -1.0]).filter(|(side, _)| !side.terms().is_empty()) {
                let state = &mut progress[side.member];
                state.late.resize(state.start.len(), DVec3::ZERO);
                for term in side.terms() {
                    state.late[term.block] -= term.map.mul_transpose_vec3(*impulse) * (sign * acts_s);
                }
            }
        }
    }
}

fn any_rebounds(search: &Search) -> bool {
    search.contacts.iter().any(|contact| contact.restitution > 0.0)
}

/// When a gap g closes that does so at a speed v, which grows by a: the root t of g = v t + ½ a t² at which it closes, t < 0 for g < 0.
fn first_root(gap: f64, speed: f64, gain: f64) -> Option<f64> {
    let inside = speed * speed + 2.0 * gain * gap;
    // the form that loses no digits where the gain is small
    let below = speed + inside.max(0.0).sqrt();
    (inside >= 0.0 && below > 0.0).then(|| 2.0 * gap / below)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fall_from_rest_takes_its_time() {
        let t = first_root(1.0, 0.0, 9.81).unwrap();
        assert!((t - (2.0_f64 / 9.81).sqrt()).abs() < 1e-15);
        assert_eq!(first_root(1.0, -1.0, 0.0), None, "it parts");
        assert_eq!(first_root(0.5, 2.0, 0.0), Some(0.25));
        assert_eq!(first_root(-0.5, 2.0, 0.0), Some(-0.25), "it has met");
        assert_eq!(first_root(1.0, 1.0, -1.0), None, "it turns before");
        assert_eq!(first_root(-2e-5, 0.0, 9.81), None, "it lies");
    }
}
