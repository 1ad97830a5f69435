//! The newest entries of an agent: a bounded ring that the agent writes and any number of readers follow.
//!
//! In: entries, from the thread that steps the agent. Out: the same in their order to each reader, and how many a reader was too slow for.
//! The agent never waits and allocates nothing; without a reader it writes nothing. Never here: what the entries mean.

use super::seqlock::{ReadOutcome, Seqlock};
use super::sync::atomic::{
    AtomicU64,
    Ordering::{Acquire, Relaxed, Release},
};
use std::marker::PhantomData;
use std::sync::OnceLock;

/// How many words an entry takes.
pub(crate) const WORDS: usize = 11;

/// Something that a ring keeps.
pub(crate) trait RingEntry: Sized {
    /// How many of one agent are kept for readers.
    const KEPT: usize;

    /// It as words.
    fn words(&self) -> [u64; WORDS];

    /// The entry of these words; `None` for words that are no entry.
    fn of_words(words: &[u64; WORDS]) -> Option<Self>;
}

/// The newest entries of an agent.
#[derive(Debug)]
pub(crate) struct Ring<E>(OnceLock<Box<Places>>, PhantomData<fn() -> E>);

/// The storage of entries, made for the first reader.
#[derive(Debug)]
struct Places {
    /// How many were written. Only the agent writes.
    written: AtomicU64,
    places: Box<[Seqlock<WORDS>]>,
}

impl<E> Default for Ring<E> {
    fn default() -> Self {
        Self(OnceLock::new(), PhantomData)
    }
}

impl<E: RingEntry> Ring<E> {
    /// Begins to keep entries; the number of the next one.
    pub fn listen(&self) -> u64 {
        let ring = self.0.get_or_init(|| {
            let places = (0..E::KEPT).map(|_| Seqlock::new()).collect();
            Box::new(Places { written: AtomicU64::new(0), places })
        });
        ring.written.load(Acquire)
    }

    /// Whether anybody ever listened.
    pub fn is_read(&self) -> bool {
        self.0.get().is_some()
    }

    /// Writes an entry, from one thread at a time; nothing where nobody listens.
    pub fn push(&self, entry: &E) {
        let Some(Places { written, places }) = self.0.get().map(|ring| &**ring) else { return };
        let number = written.load(Relaxed);
        places[number as usize % E::KEPT].write(entry.words());
        written.store(number + 1, Release);
    }

    /// Passes the entries from number `next` on to `take`; the number of the next one, and how many were overwritten before they were read.
    pub fn read(&self, next: u64, mut take: impl FnMut(E)) -> (u64, u64) {
        let Some(Places { written, places }) = self.0.get().map(|ring| &**ring) else { return (next, 0) };
        let written = written.load(Acquire);
        let first = next.max(written.saturating_sub(E::KEPT as u64));
        let mut lost = first - next;
        for number in first..written {
            // the place may have a newer one already, and before that is counted
            match places[number as usize % E::KEPT].read_write(number / E::KEPT as u64 + 1) {
                ReadOutcome::Complete(words) => match E::of_words(&words) {
                    Some(entry) => take(entry),
                    None => lost += 1,
                },
                ReadOutcome::Empty | ReadOutcome::Torn => lost += 1,
            }
        }
        (written, lost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::records::events::{AgentEvent, EventKind};
    use metachron_core::SimTime;

    fn drain(ring: &Ring<AgentEvent>, next: &mut u64) -> (Vec<AgentEvent>, u64) {
        let mut taken = Vec::new();
        let (now, lost) = ring.read(*next, |event| taken.push(event));
        *next = now;
        (taken, lost)
    }

    #[test]
    fn what_a_reader_was_too_slow_for_is_counted() {
        let ring = Ring::default();
        ring.push(&AgentEvent { at: SimTime::ZERO, kind: EventKind::Left });
        let mut next = ring.listen();
        for k in 0..300 {
            ring.push(&AgentEvent { at: SimTime::from_nanos(k), kind: EventKind::Wakes });
        }
        let (taken, lost) = drain(&ring, &mut next);
        assert_eq!((taken.len(), lost), (AgentEvent::KEPT, 300 - AgentEvent::KEPT as u64));
        assert_eq!(taken[0].at, SimTime::from_nanos(300 - AgentEvent::KEPT as u64));
    }

    #[test]
    fn an_entry_in_whose_place_a_newer_one_is_already_counts_as_lost() {
        let ring = Ring::default();
        let mut next = ring.listen();
        let event = |k| AgentEvent { at: SimTime::from_nanos(k), kind: EventKind::Left };
        (0..AgentEvent::KEPT as u64).for_each(|k| ring.push(&event(k)));
        // as a writer leaves it that is interrupted before it counts
        ring.0.get().unwrap().places[0].write(event(1000).words());
        let (taken, lost) = drain(&ring, &mut next);
        assert_eq!((taken.len(), taken[0].at, lost), (AgentEvent::KEPT - 1, SimTime::from_nanos(1), 1));
    }

    #[test]
    fn a_reader_beside_the_writer_sees_each_event_once_or_counts_it_as_lost() {
        let ring = Ring::default();
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
