//! Agents that hold an error: what their controllers say of that, for the end of a run.
//!
//! In: where a controller rests. Out: one sentence where an agent cannot hold what it is to hold. Never here: the law
//! ([`crate::control::ErrorControl`]).

use metachron_budget::Bound;
use metachron_core::AgentId;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// What the controller of one agent tells. Nobody waits for it.
#[derive(Debug)]
pub(super) struct Holding {
    agent: AgentId,
    tolerance_m: f64,
    rests: AtomicU8,
}

/// Whether an agent holds the error that it is to hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// The error that it is to hold, metres.
    pub tolerance_m: f64,
    /// The end of its ranges at which it rested; `None` between them.
    pub rests: Option<Bound>,
}

impl Holding {
    /// Of an agent that rests nowhere yet.
    pub fn new(agent: AgentId, tolerance_m: f64) -> Arc<Self> {
        Arc::new(Self { agent, tolerance_m, rests: AtomicU8::new(0) })
    }

    /// The controller rests here.
    pub fn tell(&self, rests: Option<Bound>) {
        let number = match rests {
            None => 0,
            Some(Bound::Finest) => 1,
            Some(Bound::Coarsest) => 2,
        };
        self.rests.store(number, Ordering::Relaxed);
    }

    fn held(&self) -> Held {
        let rests = match self.rests.load(Ordering::Relaxed) {
            1 => Some(Bound::Finest),
            2 => Some(Bound::Coarsest),
            _ => None,
        };
        Held { tolerance_m: self.tolerance_m, rests }
    }
}

/// Whether this agent holds what it is to hold; `None` of one that holds no error.
pub(super) fn held(all: &[Arc<Holding>], agent: AgentId) -> Option<Held> {
    all.iter().find(|one| one.agent == agent).map(|one| one.held())
}
