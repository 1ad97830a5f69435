//! Ties between the objects of a scene: couplings, and injected faults.
//!
//! In: built in code ([`crate::Scene::builder`]) or by `metachron-scene`, checked. Out: plain data that the frame loop passes to agents and to the runtime.
//! Never here: the file's text, forces.

use metachron_contact::Law;
use metachron_core::{AgentId, Anchor};

/// Interaction of two agents, other than ledger contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// The first agent.
    pub a: AgentId,
    /// The second.
    pub b: AgentId,
    /// The parts that are coupled.
    pub kind: CouplingKind,
    /// The law of the coupling.
    pub law: Law,
}

/// The parts of two agents that are coupled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CouplingKind {
    /// Their surfaces, where they are in contact.
    Contact,
    /// One point of each, joined by a spring.
    Attach {
        /// The point of the first.
        at_a: Anchor,
        /// The point of the second.
        at_b: Anchor,
        /// Stiffness, N/m, > 0.
        stiffness_n_m: f64,
        /// Damping, N·s/m, ≥ 0.
        damping_n_s_m: f64,
        /// Rest length, metres, ≥ 0.
        rest_m: f64,
        /// The force above which it tears, N, > 0: the mean over a common step of the two. Infinite where it never does.
        tears_above_n: f64,
        /// The most force that it gives, N, > 0, below that at which it tears: a greater load moves the place at which
        /// it holds, or lengthens it. Infinite where it never yields.
        yields_above_n: f64,
    },
}

/// Faults injected into the clock and the messages of an agent.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Faults {
    /// Every step is longer or shorter by a random share up to this, 0 … 0.5.
    pub jitter: f64,
    /// Share of published states that no other agent receives, 0 … 0.9.
    pub loss: f64,
    /// Seed of the random numbers of both.
    pub seed: u64,
}
