//! The record of an agent's number for as long as its run lives: its name, its newest state, and the agent, until it
//! has left.
//!
//! In: an agent, once it has begun, and again where it comes back. Out: the same, from any thread, without waiting, or
//! that it has left. Numbers are never used again; of an agent that has left, the record is all that there is. Never
//! here: what an agent shows ([`super::handle`]).

use super::handle::Shared;
use crate::lock_free::slot::LatestSlot;
use arc_swap::{ArcSwapOption, Guard};
use metachron_core::{AgentId, Snapshot};
use std::ops::Deref;
use std::sync::atomic::{
    AtomicBool,
    Ordering::{Acquire, Release},
};
use std::sync::{Arc, LazyLock, OnceLock};

/// Its state, the same of all that have left: no matter, no time.
pub(super) fn nothing() -> Arc<Snapshot> {
    static NOTHING: LazyLock<Arc<Snapshot>> = LazyLock::new(Arc::default);
    Arc::clone(&NOTHING)
}

/// A number of a run.
#[derive(Debug)]
pub(crate) struct AgentRecord {
    pub id: AgentId,
    /// Unset where nothing more is known than that it has left; a state that is read may tell later ([`crate::executors::archive`]).
    name: OnceLock<Arc<str>>,
    has_left: AtomicBool,
    /// Apart from the agent, so that a reader never holds anything that could be taken away meanwhile.
    pub slot: Arc<LatestSlot<Snapshot>>,
    live: ArcSwapOption<Shared>,
}

/// An agent that is there, for a look.
pub(crate) struct Live(Guard<Option<Arc<Shared>>>);

impl AgentRecord {
    /// That of an agent that begins.
    pub fn of(shared: &Arc<Shared>) -> Self {
        let record = Self::new(shared.id, Arc::clone(&shared.slot));
        record.begin(shared);
        record
    }

    /// That of a number of which nothing is known but that its agent has left.
    pub fn unknown(id: AgentId) -> Self {
        Self::new(id, Arc::new(LatestSlot::holding(nothing())))
    }

    fn new(id: AgentId, slot: Arc<LatestSlot<Snapshot>>) -> Self {
        Self { id, name: OnceLock::new(), has_left: AtomicBool::new(true), slot, live: ArcSwapOption::empty() }
    }

    /// Its agent is there from now on.
    pub fn begin(&self, shared: &Arc<Shared>) {
        self.name.get_or_init(|| Arc::clone(&shared.identity.name));
        self.live.store(Some(Arc::clone(shared)));
        self.set_left(false);
    }

    /// Its agent has left, or is there again.
    pub fn set_left(&self, has_left: bool) {
        self.has_left.store(has_left, Release);
    }

    pub fn has_left(&self) -> bool {
        self.has_left.load(Acquire)
    }

    /// Its agent, which has left, is no longer found.
    pub fn end(&self) {
        self.live.store(None);
    }

    /// The agent's name in the scene.
    pub fn name(&self) -> &str {
        self.name.get().map_or("", |name| name)
    }

    /// Its agent; `None` of one that has left and is not kept.
    pub fn live(&self) -> Option<Live> {
        let live = self.live.load();
        live.is_some().then_some(Live(live))
    }
}

impl Deref for Live {
    type Target = Arc<Shared>;

    fn deref(&self) -> &Arc<Shared> {
        self.0.as_ref().expect("looked at only where there is one")
    }
}
