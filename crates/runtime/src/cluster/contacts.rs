//! The contacts of a member of a cluster, and their events: contacts that begin and end.
//!
//! In: the impulses of each pair in a step. Out: the member's contacts, events. A contact that lasts less than a step
//! begins at its end, and ends with the next. Never here: contacts that only sense.

use super::MemberState;
use crate::records::events::{AgentEvent, ContactEvent, EventKind};
use crate::records::streams::EventStreams;
use metachron_contact::member::Partner;
use metachron_contact::step::PairTotal;
use metachron_core::{ContactPartner, ContactState, SimSpan, SimTime};

/// By which factor a contact presses more where it is told of again.
const GREW_BY: f64 = 1.25;

impl MemberState {
    /// Takes in the totals of pairs in a step of `dt` that ends `now`.
    pub(super) fn note_contacts(&mut self, totals: &[PairTotal], dt: SimSpan, now: SimTime, streams: &EventStreams) {
        let dt_s = dt.as_secs_f64();
        // contacts without a total in this step have ended
        self.contacts.iter_mut().for_each(|contact| contact.depth_m = f64::NAN);
        for total in totals {
            let with = match total.partner {
                Partner::Agent(id) => ContactPartner::Agent(id),
                Partner::Static(number) => ContactPartner::Static(number),
                _ => continue,
            };
            let force_n = total.impulse_n_s / dt_s;
            let seen = ContactState {
                with,
                since: now,
                places: total.contacts,
                point_m: total.point_m,
                normal: total.normal,
                force_n,
                greatest_n: force_n,
                reported_n: force_n.length(),
                depth_m: total.depth_m,
                stiffness_n_m: total.stiffness_n_m,
            };
            match self.contacts.binary_search_by_key(&with, |contact| contact.with) {
                Ok(at) => {
                    let before = &mut self.contacts[at];
                    let greater = force_n.length_squared() > before.greatest_n.length_squared();
                    let greatest_n = if greater { force_n } else { before.greatest_n };
                    let grew = force_n.length() > GREW_BY * before.reported_n;
                    let reported_n = if grew { force_n.length() } else { before.reported_n };
                    let here = if total.contacts > 0 { seen } else { ContactState { places: 0, force_n, ..*before } };
                    *before =
                        ContactState { since: before.since, greatest_n, reported_n, depth_m: total.depth_m, ..here };
                    if grew {
                        streams.event(&AgentEvent { at: now, kind: EventKind::ContactGrew(event(before)) });
                    }
                }
                // a pair that only touches has not begun to press
                Err(_) if total.contacts == 0 => {}
                Err(at) => {
                    self.contacts.insert(at, seen);
                    streams.event(&AgentEvent { at: now, kind: EventKind::ContactBegan(event(&seen)) });
                }
            }
        }
        self.contacts.retain(|contact| {
            let goes_on = !contact.depth_m.is_nan();
            if !goes_on {
                streams.event(&AgentEvent { at: now, kind: EventKind::ContactEnded(event(contact)) });
            }
            goes_on
        });
    }

    /// Tells that all contacts that are there begin: of one that went back to `now`, where readers have none of it.
    pub fn record_contacts(&self, now: SimTime, streams: &EventStreams) {
        for contact in &self.contacts {
            streams.event(&AgentEvent { at: now, kind: EventKind::ContactBegan(event(contact)) });
        }
    }
}

fn event(contact: &ContactState) -> ContactEvent {
    let ContactState { with, point_m, normal, greatest_n, .. } = *contact;
    ContactEvent { with, point_m, normal, force_n: greatest_n }
}
