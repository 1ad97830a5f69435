//! Agents with an error tolerance: the final state of their controllers, for the report of a run.
//!
//! In: the range end at which a controller rests. Out: a [`ToleranceStatus`] per agent, which shows where the tolerance cannot be met. Never here: the
//! law ([`metachron_lod::control::ErrorControl`]).

use metachron_core::AgentId;
use metachron_lod::Bound;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// Published state of one agent's controller; lock-free.
#[derive(Debug)]
pub(super) struct ErrorStatus {
    agent: AgentId,
    tolerance_m: f64,
    rests: AtomicU8,
}

/// Whether an agent meets its error tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToleranceStatus {
    /// The tolerance, metres.
    pub tolerance_m: f64,
    /// The end of its ranges at which the controller rested; `None` between the ends.
    pub rests: Option<Bound>,
}

impl ErrorStatus {
    /// Of an agent whose controller rests at neither end yet.
    pub fn new(agent: AgentId, tolerance_m: f64) -> Arc<Self> {
        Arc::new(Self { agent, tolerance_m, rests: AtomicU8::new(0) })
    }

    /// Publishes where the controller rests.
    pub fn publish(&self, rests: Option<Bound>) {
        let number = match rests {
            None => 0,
            Some(Bound::Finest) => 1,
            Some(Bound::Coarsest) => 2,
        };
        self.rests.store(number, Ordering::Relaxed);
    }

    fn tolerance_status(&self) -> ToleranceStatus {
        let rests = match self.rests.load(Ordering::Relaxed) {
            1 => Some(Bound::Finest),
            2 => Some(Bound::Coarsest),
            _ => None,
        };
        ToleranceStatus { tolerance_m: self.tolerance_m, rests }
    }
}

/// Whether this agent meets its tolerance; `None` for an agent without one.
pub(super) fn tolerance_status(all: &[Arc<ErrorStatus>], agent: AgentId) -> Option<ToleranceStatus> {
    all.iter().find(|one| one.agent == agent).map(|one| one.tolerance_status())
}
