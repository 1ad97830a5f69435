//! The turn in progress of a run whose turns are made on its caller's thread, for other threads that ask.
//!
//! In: that turn, once. Out: the same, as long as its run keeps it. Never here: how it is judged ([`crate::turn::watchdog`]).

use metachron_core::AgentId;
use std::fmt::Debug;
use std::sync::{Arc, OnceLock, Weak};

/// A turn in progress, if there is one.
pub(crate) trait CallersTurn: Debug + Send + Sync {
    /// Judges it: the agent whose code makes it last too long, if it does.
    fn judge(&self) -> Option<AgentId>;

    /// Parks its agents from outside, if it lasts too long; whether it does.
    fn park(&self) -> bool;
}

/// The place of that turn; empty of a run in real time, whose turns are watched.
#[derive(Debug, Default)]
pub(crate) struct CallersTurnSlot(OnceLock<Weak<dyn CallersTurn>>);

impl CallersTurnSlot {
    /// From now on turns are made on the caller's thread.
    pub fn set(&self, turn: &Arc<impl CallersTurn + 'static>) {
        let turn: Weak<dyn CallersTurn> = Arc::downgrade(turn) as _;
        self.0.get_or_init(|| turn);
    }

    /// Judges the turn in progress.
    pub fn judge(&self) -> Option<AgentId> {
        self.get()?.judge()
    }

    /// Parks the agents of a turn that lasts too long; whether there is one.
    pub fn park(&self) -> bool {
        self.get().is_some_and(|turn| turn.park())
    }

    fn get(&self) -> Option<Arc<dyn CallersTurn>> {
        self.0.get()?.upgrade()
    }
}
