//! An agent's reports to readers: its events and its turns, and how far each reader has heard them.
//!
//! In: events and turns, from the thread that makes the agent's turns. Out: the same to each reader ([`crate::lock_free::ring`]),
//! which keeps the entries of an agent that has left until it has read them. Never here: what they mean.

use super::events::AgentEvent;
use super::turns::Turn;
use crate::lock_free::ring::{Ring, RingEntry};
use std::sync::{Arc, OnceLock};

/// An agent's events and turns; nothing is kept before the first reader.
#[derive(Debug, Default)]
pub(crate) struct EventStreams(OnceLock<Arc<Rings>>);

#[derive(Debug, Default)]
pub(crate) struct Rings {
    pub events: Ring<AgentEvent>,
    pub turns: Ring<Turn>,
}

/// How far a reader has heard an agent.
#[derive(Debug, Default)]
pub struct StreamReader {
    rings: Option<Arc<Rings>>,
    next: u64,
    /// How many stalls were told of: the thread that writes the rings cannot tell of its own.
    pub(crate) stalls: u32,
}

impl EventStreams {
    /// Tells of an event, from one thread at a time.
    pub fn event(&self, event: &AgentEvent) {
        self.0.get().into_iter().for_each(|rings| rings.events.push(event));
    }

    /// Tells of a turn, from one thread at a time.
    pub fn turn(&self, turn: impl FnOnce() -> Turn) {
        if let Some(rings) = self.0.get().filter(|rings| rings.turns.is_read()) {
            rings.turns.push(&turn());
        }
    }

    /// Begins to keep the entries of the ring `of` for a reader.
    pub fn listen<E: RingEntry>(&self, of: fn(&Rings) -> &Ring<E>) -> StreamReader {
        let rings = self.0.get_or_init(Arc::default);
        StreamReader { next: of(rings).listen(), rings: Some(Arc::clone(rings)), stalls: 0 }
    }
}

impl StreamReader {
    /// Passes the entries that it has not read on to `take`; returns how many were lost. `now` are the agent's streams,
    /// looked up before that; `None` where it has left.
    pub(crate) fn read<E: RingEntry>(
        &mut self,
        now: Option<&EventStreams>,
        of: fn(&Rings) -> &Ring<E>,
        take: impl FnMut(E),
    ) -> u64 {
        let mut lost = 0;
        if let Some(rings) = &self.rings {
            (self.next, lost) = of(rings).read(self.next, take);
        }
        // one that has come back tells anew
        match now {
            None => *self = Self::default(),
            Some(streams) => {
                let are_its = |rings: &Arc<Rings>| streams.0.get().is_some_and(|now| Arc::ptr_eq(now, rings));
                if !self.rings.as_ref().is_some_and(are_its) {
                    *self = Self { stalls: self.stalls, ..streams.listen(of) };
                }
            }
        }
        lost
    }
}
