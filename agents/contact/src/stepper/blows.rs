//! Blows: contacts that rebound, each at its own time within a fine step.
//!
//! In: the places of a fine step, what a solve gave. Out: which of them rebound and when, by how much later than the step's start each
//! impulse acts, how many fine steps the macro step needs. Never here: how a rebound is solved ([`crate::cluster`]).
//! Theory: docs/theory/clusters.md, section 9.
//!
//! A blow is solved with the speed at which its sides meet, and changes velocities from the start of the step. A body that nothing else
//! holds is then carried to where the blow at its own time would have left it (eq. 27), so its flight is exact on both sides of it.
//! Blows of one body that are further apart in time are in fine steps of their own, up to [`PARTS_MAX`] in a macro step. There what a body
//! meets at once it rebounds off at once, and one that its blow would send through something else does not rebound.

use super::Progress;
use super::memory::Partner;
use super::search::{Judge, Owner, Search, velocity};
use crate::cluster::{Contact, Side};
use glam::DVec3;

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
    approach_m_s: f64,
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

    /// Decides for places that are new whether they rebound, and when. Before the solve those are left out that meet later.
    pub fn choose(&mut self, search: &mut Search, progress: &[Progress], judge: Judge) {
        if search.contacts.iter().all(|contact| contact.restitution <= 0.0) {
            return;
        }
        match judge {
            Judge::Foreseen => self.foresee(search, progress),
            Judge::Solved => self.stop(search),
        }
    }

    /// Takes the blows of the step as far as flights tell.
    fn foresee(&mut self, search: &mut Search, progress: &[Progress]) {
        for (contact, owner) in search.contacts.iter_mut().zip(&mut search.owners) {
            if contact.restitution <= 0.0 {
                continue;
            }
            let Some(Meeting { after_s, approach_m_s }) = self.meeting(contact, progress) else {
                contact.restitution = 0.0;
                continue;
            };
            owner.meets_s = Some(after_s);
            contact.approach_m_s = approach_m_s;
            // one that slows down on its way meets within the step all the same
            contact.gap_m = contact.gap_m.min(approach_m_s * self.step_s);
            if after_s < self.step_s {
                owner.movers(contact).for_each(|member| self.note(member, after_s, (owner.member, owner.partner)));
            }
        }
        search.retain(|owner| owner.meets_s.is_none_or(|meets_s| meets_s < self.step_s));
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
    fn stop(&mut self, search: &mut Search) {
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
    fn meeting(&self, contact: &Contact, progress: &[Progress]) -> Option<Meeting> {
        let [a, b] = contact.sides.each_ref().map(|side| gain_m_s(side, progress, contact));
        let gain_m_s2 = (b - a) / self.step_s;
        let after_s = first_root(contact.gap_m, contact.approach_m_s, gain_m_s2)?.max(-self.step_s);
        let approach_m_s = contact.approach_m_s + gain_m_s2 * after_s;
        // what both gain, as they fall, is not what drives them together where one of them lies on something
        let driven_m_s2 = (b - a).max(b).max(-a) / self.step_s;
        // what parts for less than a macro step would hop at every step
        let flies = 2.0 * contact.restitution * approach_m_s > driven_m_s2 * self.macro_s;
        // what meets in a later step is decided then
        (flies || after_s >= self.step_s).then_some(Meeting { after_s, approach_m_s })
    }
}

/// Adds to what each participant is carried by, N·s²: −τ Jᵀλ of each blow, that acts τ seconds into the step (eq. 27).
pub(super) fn note_late(search: &Search, impulses_n_s: &[DVec3], progress: &mut [Progress]) {
    for ((contact, owner), impulse) in search.contacts.iter().zip(&search.owners).zip(impulses_n_s) {
        let Some(meets_s) = owner.meets_s.filter(|_| contact.restitution > 0.0 && *impulse != DVec3::ZERO) else {
            continue;
        };
        for (side, sign) in contact.sides.iter().zip([1.0, -1.0]).filter(|(side, _)| !side.terms().is_empty()) {
            let state = &mut progress[side.member];
            state.late.resize(state.start.len(), DVec3::ZERO);
            for term in side.terms() {
                state.late[term.block] -= term.map.mul_transpose_vec3(*impulse) * (sign * meets_s);
            }
        }
    }
}

/// What a side gains along a contact's normal within the step without contact, m/s.
fn gain_m_s(side: &Side, progress: &[Progress], contact: &Contact) -> f64 {
    let now = velocity(side, |member| &progress[member].before);
    (velocity(side, |member| &progress[member].seen) - now).dot(contact.normal)
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
