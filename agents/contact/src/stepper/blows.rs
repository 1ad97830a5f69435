//! Blows: contacts that rebound, each at its own time.
//!
//! In: the places of a macro step. Out: when the first of them that rebounds closes; which contacts rebound now. Never here: how a
//! rebound is solved ([`crate::cluster`]). Theory: docs/theory/clusters.md, section 9.
//!
//! A macro step that a blow falls into ends where the sides meet, so that the blow acts there and not where they were before. In the fine
//! steps of unlike members a blow acts at the start of its fine step: that is a sixteenth of the longest step off at most.

use super::Progress;
use super::search::{Search, velocity};
use crate::cluster::{Contact, Side};

/// Sides that are closer than this have met, metres: a millionth of what any picture shows.
const MET_M: f64 = 1e-6;

/// What decides whether a contact rebounds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Rebounds {
    /// The macro step that was asked for, and the fine step that is made, seconds.
    pub macro_s: f64,
    pub step_s: f64,
    /// Whether all members make steps of one length: then a blow waits for its time.
    pub is_even: bool,
}

impl Rebounds {
    /// Whether the sides of a contact that closes at this speed part for long enough.
    fn flies(&self, contact: &Contact, approach_m_s: f64, progress: &[Progress]) -> bool {
        // what both gain, as they fall, is not what drives them together where one of them lies on something
        let [a, b] = contact.sides.each_ref().map(|side| gain_m_s(side, progress, contact));
        let driven_m_s2 = (b - a).max(b).max(-a) / self.step_s;
        // what parts for less than a macro step would hop at every step
        2.0 * contact.restitution * approach_m_s > driven_m_s2 * self.macro_s
    }

    /// When the first contact that will rebound closes, seconds from now; `None` for none within the macro step.
    pub fn first(&self, search: &Search, progress: &[Progress]) -> Option<f64> {
        let closing = search.contacts.iter().filter_map(|contact| self.closes_at(contact, progress));
        closing.filter(|closes_s| *closes_s < self.macro_s).reduce(f64::min)
    }

    /// When a contact closes that then rebounds; `None` for one that has met already.
    fn closes_at(&self, contact: &Contact, progress: &[Progress]) -> Option<f64> {
        if contact.restitution <= 0.0 || contact.gap_m <= MET_M {
            return None;
        }
        let [a, b] = contact.sides.each_ref().map(|side| gain_m_s(side, progress, contact));
        let gain_m_s2 = (b - a) / self.step_s;
        let closes_s = first_root(contact.gap_m, contact.approach_m_s, gain_m_s2)?;
        let approach_m_s = contact.approach_m_s + gain_m_s2 * closes_s;
        self.flies(contact, approach_m_s, progress).then_some(closes_s)
    }

    /// Leaves out contacts whose blow is still to come, and takes the restitution of those that do not rebound.
    pub fn choose(&self, search: &mut Search, progress: &[Progress]) {
        if search.contacts.iter().all(|contact| contact.restitution <= 0.0) {
            return;
        }
        if self.is_even {
            // the step ends no later than they close: nothing acts before
            search.retain(|contact| self.closes_at(contact, progress).is_none());
        }
        for contact in &mut search.contacts {
            let met = !self.is_even || contact.gap_m <= MET_M;
            if !(met && self.flies(contact, contact.approach_m_s, progress)) {
                contact.restitution = 0.0;
            }
        }
    }
}

/// What a side gains along a contact's normal within the step without contact, m/s.
fn gain_m_s(side: &Side, progress: &[Progress], contact: &Contact) -> f64 {
    let now = velocity(side, |member| &progress[member].before);
    (velocity(side, |member| &progress[member].seen) - now).dot(contact.normal)
}

/// When a gap g closes that does so at a speed v, which grows by a: the least t ≥ 0 with g = v t + ½ a t².
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
        assert_eq!(first_root(1.0, 1.0, -1.0), None, "it turns before");
    }
}
