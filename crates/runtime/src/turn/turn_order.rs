//! The order in which a run in real time makes the parts of its turns: all that a run on one thread needs to make the same turns.
//!
//! In: parts of turns, each made while no other is ([`super::turn_parts`]), with the reading of the clock that it used. Out: their list, in
//! that order, to a log. Whatever a turn reads of others, or others of it, changes in such a part: how many threads
//! there are and how fast they are makes no other difference. A run that is not recorded has no order, and nothing here
//! costs it anything.
//! Never here: how parts are made again ([`crate::executors::follower`]), a file, calls from outside; a caller that changes the
//! run holds the order ([`TurnOrder::between`]) and writes the change down itself.

use metachron_core::AgentId;
use std::sync::atomic::{
    AtomicBool,
    Ordering::{Acquire, Release},
};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// So many parts are passed to the log at once.
const PARTS_AT_ONCE: usize = 1024;

/// No part waits longer for that, wall time.
const PARTS_WAIT: Duration = Duration::from_millis(250);

/// The phases of a turn that are ordered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum PartKind {
    /// The agent reads of others all that its step depends on. Where it makes none this is the whole turn.
    Prepare,
    /// It shows the state after its step, and the turn ends.
    Show,
    /// It goes on after a rest.
    Wake,
    /// It hands its turns over to another that leads it from then on.
    Join,
    /// All are put into the state that was given last.
    Restore,
}

/// A part of a turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TurnPart {
    /// The phase of the turn.
    pub kind: PartKind,
    /// Whose turn it is.
    pub agent: AgentId,
    /// The reading of the run's clock that it uses. In a pool, readings of two workers may be in another order than their parts.
    pub wall: Duration,
    /// The most steps of each solve of the step that it prepares, as measured times have decided; `None` for as many as
    /// the laws take, and of other parts.
    pub factors_max: Option<u32>,
}

/// Where the parts of turns are written down.
pub trait OrderLog: Send + Sync {
    /// Takes the parts that were made since the last call, in their order, out of the list. No part is made meanwhile.
    fn take(&self, parts: &mut Vec<TurnPart>);
}

/// Makes the parts of all turns of a run one after the other, and notes them.
pub struct TurnOrder {
    parts: Mutex<Parts>,
    log: Box<dyn OrderLog>,
    closed: AtomicBool,
}

/// Parts that the log has not taken yet.
struct Parts {
    list: Vec<TurnPart>,
    taken: Duration,
}

/// While it is held, nothing but its holder's acts happens in the run.
pub struct Held<'a> {
    order: &'a TurnOrder,
    parts: MutexGuard<'a, Parts>,
    /// The agent whose second part this is.
    shows: Option<AgentId>,
}

impl std::fmt::Debug for TurnOrder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TurnOrder").field("closed", &self.closed).finish_non_exhaustive()
    }
}

impl TurnOrder {
    /// An order that `log` takes down.
    #[must_use]
    pub fn new(log: Box<dyn OrderLog>) -> Self {
        let parts = Parts { list: Vec::with_capacity(PARTS_AT_ONCE), taken: Duration::ZERO };
        Self { parts: Mutex::new(parts), log, closed: AtomicBool::new(false) }
    }

    /// Waits until no part is being made, and keeps others from being made; the log has all that were.
    pub fn between(&self) -> Held<'_> {
        let mut held = self.lock();
        self.log.take(&mut held.parts.list);
        held
    }

    /// Notes nothing any more: turns are made as without it.
    pub fn close(&self) {
        self.closed.store(true, Release);
    }

    /// As [`Self::between`], for a part that is to be noted; the log gets the parts so far now and then.
    pub(crate) fn hold(&self) -> Held<'_> {
        let mut held = self.lock();
        let Parts { list, taken } = &mut *held.parts;
        if let Some(newest) = list.last().map(|part| part.wall)
            && (list.len() >= PARTS_AT_ONCE || newest > *taken + PARTS_WAIT)
        {
            *taken = newest;
            self.log.take(list);
        }
        held
    }

    fn lock(&self) -> Held<'_> {
        let parts = self.parts.lock().unwrap_or_else(PoisonError::into_inner);
        Held { order: self, parts, shows: None }
    }
}

impl<'a> Held<'a> {
    /// Notes the part that is made now.
    pub(crate) fn note(&mut self, kind: PartKind, agent: AgentId, wall: Duration) {
        self.push(TurnPart { kind, agent, wall, factors_max: None });
    }

    /// Notes the first part of a turn, which has decided how far solves go.
    pub(super) fn note_prepared(&mut self, agent: AgentId, wall: Duration, factors_max: Option<u32>) {
        self.push(TurnPart { kind: PartKind::Prepare, agent, wall, factors_max });
    }

    fn push(&mut self, part: TurnPart) {
        if !self.order.closed.load(Acquire) {
            self.parts.list.push(part);
        }
    }

    /// Makes the step of `agent`, while others make parts; after it its second part is made.
    pub(crate) fn apart<T>(self, agent: AgentId, step: impl FnOnce() -> T) -> (T, Self) {
        let order = self.order;
        drop(self);
        let made = step();
        (made, Self { shows: Some(agent), ..order.hold() })
    }

    /// Notes the second part of a turn, if this is one, with the reading of the clock at its end.
    pub(crate) fn note_end(&mut self, wall: Duration) {
        if let Some(agent) = self.shows.take() {
            self.note(PartKind::Show, agent, wall);
        }
    }
}

/// The order that a run is recorded in, if it still is.
pub(crate) fn in_force(order: &mut Option<Arc<TurnOrder>>) -> Option<Arc<TurnOrder>> {
    order.take_if(|order| order.closed.load(Acquire));
    order.clone()
}
