//! By which law two agents act on each other.

use metachron_core::{AgentId, Anchor};

/// How two agents act on each other where they touch.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Law {
    /// Both are solved in one problem by the contact cluster that steps them: the default.
    #[default]
    Cluster,
    /// Asynchronous: one side computes the impulses and books them in a ledger, the other takes them in its next step.
    Ledger,
    /// Wave variables on a line between the two: passive whatever the delay, at the price of a mass k T².
    Tlm {
        /// Stiffness of the line, N/m, > 0.
        stiffness_n_m: f64,
        /// Damping beside it, N·s/m, ≥ 0.
        damping_n_s_m: f64,
    },
    /// No contact: the two pass through each other.
    Off,
}

impl Law {
    /// Whether the two sides keep clocks of their own, each seeing the other's newest published state.
    #[must_use]
    pub const fn is_asynchronous(self) -> bool {
        matches!(self, Self::Ledger | Self::Tlm { .. })
    }
}

/// A lasting bilateral coupling between a point of this agent and one of another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// The agent on the other side.
    pub other: AgentId,
    /// The point of this agent.
    pub here: Anchor,
    /// The point of the other.
    pub there: Anchor,
    /// Stiffness, N/m, > 0.
    pub stiffness_n_m: f64,
    /// Damping, N·s/m, ≥ 0.
    pub damping_n_s_m: f64,
    /// The distance at which it exerts no force, metres, ≥ 0.
    pub rest_m: f64,
    /// [`Law::Cluster`], [`Law::Ledger`] or [`Law::Tlm`].
    pub law: Law,
    /// Its number in the scene, by which both ends know it.
    pub number: u32,
    /// The force above which it tears, N, > 0: the mean over a macro step of its cluster. Infinite where it never does; an asynchronous
    /// link never does.
    pub tears_above_n: f64,
    /// The force that it gives at most, N, > 0, below that at which it tears: what would take more moves the place at which it holds, or
    /// lengthens it. Infinite where it never yields; an asynchronous link never does.
    pub yields_above_n: f64,
}

impl Link {
    /// A spring from `here` to a point `there` of `other` with this stiffness, N/m, > 0: number 0, without damping or a length at rest, in one
    /// problem with all that touches, which neither tears nor yields.
    #[must_use]
    pub const fn new(other: AgentId, here: Anchor, there: Anchor, stiffness_n_m: f64) -> Self {
        Self {
            other,
            here,
            there,
            stiffness_n_m,
            damping_n_s_m: 0.0,
            rest_m: 0.0,
            law: Law::Cluster,
            number: 0,
            tears_above_n: f64::INFINITY,
            yields_above_n: f64::INFINITY,
        }
    }
}
