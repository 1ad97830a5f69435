//! Events of an agent, for readers that ask for them.
//!
//! In: events, from the thread that steps the agent. Out: the same to each reader ([`crate::lock_free::ring`]). Never here: which events a reader wants.

use crate::lock_free::ring::{RingEntry, WORDS};
use glam::DVec3;
use metachron_core::{AgentId, ContactPartner, Removed, SimTime};

/// How many events of one agent are kept for readers.
pub const EVENTS_KEPT: usize = 128;

/// Something that happened to an agent, in its own time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AgentEvent {
    /// When: the end of the step in which it happened.
    pub at: SimTime,
    /// The event.
    pub kind: EventKind,
}

/// The kinds of events of an agent.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum EventKind {
    /// It began to touch something. Of two agents the one of the lower number reports it.
    ContactBegan(ContactEvent),
    /// It presses by a quarter more than was told of it so far, in the mean of a step.
    ContactGrew(ContactEvent),
    /// It ceased to.
    ContactEnded(ContactEvent),
    /// It came to rest.
    Rests,
    /// It moves again after a rest.
    Wakes,
    /// Its step has lasted too long, and is not at its end ([`crate::AgentState::Stalled`]).
    Stalled,
    /// It failed and stands still from now on ([`crate::AgentState`] has the reason).
    Parked,
    /// It has left the run.
    Gone,
    /// It steps in the cluster that this agent leads.
    Joined(AgentId),
    /// It makes its own turns again.
    Left,
    /// One of its attachments slipped for the first time, or tore: its snapshots say which.
    AttachmentGave,
    /// It could not keep its rate, and gave up time.
    RateMissed,
    /// Its motion asked for so many times as many steps as it made, more than a step may be divided into, and had not in the step before.
    UnderResolved(f64),
    /// Cells of it were removed.
    Carved(Removed),
    /// The run went back to a state that was saved; later events happen from the time of that on. Its contacts there
    /// begin anew.
    Rewound,
}

/// A contact when it began, in its first step, when it grew, or when it ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactEvent {
    /// The object or solid that it touches.
    pub with: ContactPartner,
    /// The place that bore most, metres; where it is not known, not a number.
    pub point_m: DVec3,
    /// The normal there, towards the agent that tells of it, of length 1.
    pub normal: DVec3,
    /// The force on that agent, world axes, N: in the mean of the first step, or of the step in which it was greatest.
    pub force_n: DVec3,
}

impl RingEntry for AgentEvent {
    const KEPT: usize = EVENTS_KEPT;

    fn words(&self) -> [u64; WORDS] {
        words(self)
    }

    fn of_words(words: &[u64; WORDS]) -> Option<Self> {
        event(words)
    }
}

fn words(event: &AgentEvent) -> [u64; WORDS] {
    let mut words = [0; WORDS];
    words[0] = event.at.as_nanos();
    let (kind, other) = match event.kind {
        EventKind::ContactBegan(contact) => (0, Some(contact)),
        EventKind::ContactEnded(contact) => (1, Some(contact)),
        EventKind::Rests => (2, None),
        EventKind::Wakes => (3, None),
        EventKind::Parked => (4, None),
        EventKind::Joined(leader) => {
            words[1] = 5 | u64::from(leader.0) << 32;
            return words;
        }
        EventKind::Left => (6, None),
        EventKind::AttachmentGave => (7, None),
        EventKind::ContactGrew(contact) => (9, Some(contact)),
        EventKind::Gone => (10, None),
        EventKind::RateMissed => (8, None),
        EventKind::Rewound => (12, None),
        EventKind::Stalled => (13, None),
        EventKind::UnderResolved(times) => {
            (words[1], words[2]) = (14, times.to_bits());
            return words;
        }
        EventKind::Carved(Removed { cells, triangles, mass_kg, momentum }) => {
            words[1] = 11 | u64::from(cells) << 32;
            words[2] = u64::from(triangles.cast_unsigned());
            let numbers = [mass_kg, momentum.x, momentum.y, momentum.z];
            words[3..].iter_mut().zip(numbers).for_each(|(word, number)| *word = number.to_bits());
            return words;
        }
    };
    words[1] = kind;
    if let Some(ContactEvent { with, point_m, normal, force_n }) = other {
        words[1] |= match with {
            ContactPartner::Static(number) => u64::from(number) << 32,
            ContactPartner::Agent(id) => 1 << 16 | u64::from(id.0) << 32,
        };
        let numbers = [point_m, normal, force_n].into_iter().flat_map(|v: DVec3| v.to_array());
        words[2..].iter_mut().zip(numbers).for_each(|(word, number)| *word = number.to_bits());
    }
    words
}

/// The event of these words; `None` for words that no event has.
fn event(words: &[u64; WORDS]) -> Option<AgentEvent> {
    let id = (words[1] >> 32) as u32;
    let vector = |at: usize| DVec3::from_array([0, 1, 2].map(|k| f64::from_bits(words[at + k])));
    let with = if words[1] >> 16 & 1 == 1 { ContactPartner::Agent(AgentId(id)) } else { ContactPartner::Static(id) };
    let contact = ContactEvent { with, point_m: vector(2), normal: vector(5), force_n: vector(8) };
    let kind = match words[1] & 0xff {
        0 => EventKind::ContactBegan(contact),
        1 => EventKind::ContactEnded(contact),
        2 => EventKind::Rests,
        3 => EventKind::Wakes,
        4 => EventKind::Parked,
        5 => EventKind::Joined(AgentId(id)),
        6 => EventKind::Left,
        7 => EventKind::AttachmentGave,
        8 => EventKind::RateMissed,
        9 => EventKind::ContactGrew(contact),
        10 => EventKind::Gone,
        13 => EventKind::Stalled,
        14 => EventKind::UnderResolved(f64::from_bits(words[2])),
        11 => EventKind::Carved(Removed {
            cells: id,
            triangles: (words[2] as u32).cast_signed(),
            mass_kg: f64::from_bits(words[3]),
            momentum: vector(4),
        }),
        12 => EventKind::Rewound,
        _ => return None,
    };
    Some(AgentEvent { at: SimTime::from_nanos(words[0]), kind })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lock_free::ring::Ring;

    fn all() -> Vec<EventKind> {
        let contact = |with| ContactEvent { with, point_m: DVec3::X, normal: DVec3::Z, force_n: DVec3::splat(-2.5) };
        vec![
            EventKind::ContactBegan(contact(ContactPartner::Agent(AgentId(70_000)))),
            EventKind::ContactGrew(contact(ContactPartner::Static(0))),
            EventKind::ContactEnded(contact(ContactPartner::Static(3))),
            EventKind::Rests,
            EventKind::Wakes,
            EventKind::Parked,
            EventKind::Joined(AgentId(u32::MAX)),
            EventKind::Left,
            EventKind::AttachmentGave,
            EventKind::RateMissed,
            EventKind::Gone,
            EventKind::Rewound,
            EventKind::Stalled,
            EventKind::UnderResolved(1e5),
            EventKind::Carved(Removed { cells: 10, triangles: -24, mass_kg: 0.25, momentum: DVec3::NEG_Y }),
        ]
    }

    #[test]
    fn every_kind_comes_out_as_it_went_in() {
        let ring = Ring::default();
        let next = ring.listen();
        let at = SimTime::from_nanos(17);
        all().into_iter().for_each(|kind| ring.push(&AgentEvent { at, kind }));
        let mut taken = Vec::new();
        let (next, lost) = ring.read(next, |event| taken.push(event));
        assert_eq!(taken, all().into_iter().map(|kind| AgentEvent { at, kind }).collect::<Vec<_>>());
        assert_eq!((lost, ring.read(next, |_| panic!("nothing is new"))), (0, (next, 0)));
    }
}
