//! What happens to an agent, for those who ask: a bounded ring that the agent writes and any number of readers follow.
//!
//! In: events, from the thread that steps the agent. Out: the same in their order to each reader, and how many a reader was too slow for.
//! The agent never waits and allocates nothing; without a reader it writes nothing. Never here: which events a reader wants.

use super::seqlock::{ReadOutcome, Seqlock};
use super::sync::atomic::{
    AtomicU64,
    Ordering::{Acquire, Relaxed, Release},
};
use glam::DVec3;
use metachron_core::{AgentId, ContactPartner, Removed, SimTime};
use std::sync::OnceLock;

/// How many events of one agent are kept for readers.
pub const EVENTS_KEPT: usize = 128;

/// Something that happened to an agent, in its own time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AgentEvent {
    /// When: the end of the step in which it happened.
    pub at: SimTime,
    /// What.
    pub kind: EventKind,
}

/// What can happen to an agent.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum EventKind {
    /// It began to touch something. Of two agents the one of the lower number tells of it.
    ContactBegan(ContactEvent),
    /// It presses by a quarter more than was told of it so far, in the mean of a step.
    ContactGrew(ContactEvent),
    /// It ceased to.
    ContactEnded(ContactEvent),
    /// It came to rest.
    Rests,
    /// It moves again after a rest.
    Wakes,
    /// It failed and stands still from now on ([`crate::AgentState`] has the reason).
    Parked,
    /// It has left the run.
    Gone,
    /// It steps in the cluster that this agent leads.
    Joined(AgentId),
    /// It makes its own turns again.
    Left,
    /// One of its attachments slipped for the first time, or tore: those of its snapshots say which.
    AttachmentGave,
    /// It could not keep its rate, and gave up time.
    RateMissed,
    /// Cells of it were removed.
    Carved(Removed),
}

/// A contact when it began, in its first step, when it grew, or when it ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactEvent {
    /// What it touches.
    pub with: ContactPartner,
    /// The place that bore most, metres; where it is not known, as in heaps that rapier3d steps, not a number.
    pub point_m: DVec3,
    /// The normal there, towards the agent that tells of it, of length 1.
    pub normal: DVec3,
    /// The force on that agent, world axes, N: in the mean of the first step, or of the step in which it was greatest.
    pub force_n: DVec3,
}

/// How many words an event takes.
const WORDS: usize = 11;

/// The newest events of an agent.
#[derive(Debug, Default)]
pub(super) struct EventRing(OnceLock<Box<Ring>>);

/// What the first reader makes.
#[derive(Debug)]
struct Ring {
    /// How many were written. Only the agent writes.
    written: AtomicU64,
    places: Box<[Seqlock<WORDS>]>,
}

impl EventRing {
    /// Begins to keep events; the number of the next one.
    pub fn listen(&self) -> u64 {
        let ring = self.0.get_or_init(|| {
            let places = (0..EVENTS_KEPT).map(|_| Seqlock::new()).collect();
            Box::new(Ring { written: AtomicU64::new(0), places })
        });
        ring.written.load(Acquire)
    }

    /// Writes an event, from one thread at a time; nothing where nobody listens.
    pub fn push(&self, event: &AgentEvent) {
        let Some(Ring { written, places }) = self.0.get().map(|ring| &**ring) else { return };
        let number = written.load(Relaxed);
        places[number as usize % EVENTS_KEPT].write(words(event));
        written.store(number + 1, Release);
    }

    /// Passes the events from number `next` on to `take`; the number of the next one, and how many were overwritten before they were read.
    pub fn read(&self, next: u64, mut take: impl FnMut(AgentEvent)) -> (u64, u64) {
        let Some(Ring { written: end, places }) = self.0.get().map(|ring| &**ring) else { return (next, 0) };
        let written = end.load(Acquire);
        let first = next.max(written.saturating_sub(EVENTS_KEPT as u64));
        let mut lost = first - next;
        for number in first..written {
            match places[number as usize % EVENTS_KEPT].read() {
                ReadOutcome::Complete(words) => match event(&words) {
                    // the place may have a newer one already
                    Some(event) if end.load(Acquire) <= number + EVENTS_KEPT as u64 => take(event),
                    _ => lost += 1,
                },
                ReadOutcome::Empty | ReadOutcome::Torn => lost += 1,
            }
        }
        (written, lost)
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
        11 => EventKind::Carved(Removed {
            cells: id,
            triangles: (words[2] as u32).cast_signed(),
            mass_kg: f64::from_bits(words[3]),
            momentum: vector(4),
        }),
        _ => return None,
    };
    Some(AgentEvent { at: SimTime::from_nanos(words[0]), kind })
}

#[cfg(test)]
mod tests {
    use super::*;

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
            EventKind::Carved(Removed { cells: 10, triangles: -24, mass_kg: 0.25, momentum: DVec3::NEG_Y }),
        ]
    }

    fn drain(ring: &EventRing, next: &mut u64) -> (Vec<AgentEvent>, u64) {
        let mut taken = Vec::new();
        let (now, lost) = ring.read(*next, |event| taken.push(event));
        *next = now;
        (taken, lost)
    }

    #[test]
    fn every_kind_comes_out_as_it_went_in() {
        let ring = EventRing::default();
        let mut next = ring.listen();
        let at = SimTime::from_nanos(17);
        all().into_iter().for_each(|kind| ring.push(&AgentEvent { at, kind }));
        let (taken, lost) = drain(&ring, &mut next);
        assert_eq!(taken, all().into_iter().map(|kind| AgentEvent { at, kind }).collect::<Vec<_>>());
        assert_eq!((lost, drain(&ring, &mut next).0.len()), (0, 0));
    }

    #[test]
    fn what_a_reader_was_too_slow_for_is_counted() {
        let ring = EventRing::default();
        ring.push(&AgentEvent { at: SimTime::ZERO, kind: EventKind::Left });
        let mut next = ring.listen();
        for k in 0..300 {
            ring.push(&AgentEvent { at: SimTime::from_nanos(k), kind: EventKind::Wakes });
        }
        let (taken, lost) = drain(&ring, &mut next);
        assert_eq!((taken.len(), lost), (EVENTS_KEPT, 300 - EVENTS_KEPT as u64));
        assert_eq!(taken[0].at, SimTime::from_nanos(300 - EVENTS_KEPT as u64));
    }

    #[test]
    fn a_reader_beside_the_writer_sees_each_event_once_or_counts_it_as_lost() {
        let ring = EventRing::default();
        let mut next = ring.listen();
        let (mut seen, mut lost, all) = (0, 0, 20_000);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                (0..all).for_each(|k| ring.push(&AgentEvent { at: SimTime::from_nanos(k), kind: EventKind::Left }))
            });
            let mut last = None;
            while seen + lost < all {
                let (taken, missed) = drain(&ring, &mut next);
                for event in &taken {
                    assert!(last.is_none_or(|last| event.at > last));
                    last = Some(event.at);
                }
                seen += taken.len() as u64;
                lost += missed;
            }
        });
        assert_eq!(seen + lost, all);
    }
}
