//! What ties the objects of a scene to each other: couplings, and faults on the way between them.
//!
//! In: built by [`super::load`], checked. Out: plain data that the frame loop hands to agents and to the runtime.
//! Never here: the file's text, forces.

use metachron_contact::Law;
use metachron_core::{AgentId, Anchor};

/// How two agents act on each other, where that is not contact by the ledger.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// The first agent.
    pub a: AgentId,
    /// The second.
    pub b: AgentId,
    /// What of them is coupled.
    pub kind: CouplingKind,
    /// By which law.
    pub law: Law,
}

/// What of two agents is coupled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CouplingKind {
    /// Their surfaces, where they touch.
    Contact,
    /// One point of each, by a spring.
    Attach {
        /// The point of the first.
        at_a: Anchor,
        /// The point of the second.
        at_b: Anchor,
        /// Stiffness, N/m, > 0.
        stiffness_n_m: f64,
        /// Damping, N·s/m, ≥ 0.
        damping_n_s_m: f64,
        /// Length at rest, metres, ≥ 0.
        rest_m: f64,
    },
}

/// What goes wrong on purpose on the way from an agent to the others.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Faults {
    /// Every step is longer or shorter by up to this share, 0 … 0.5.
    pub jitter: f64,
    /// Share of published states that nobody sees, 0 … 0.9.
    pub loss: f64,
    /// Seed of both.
    pub seed: u64,
}
