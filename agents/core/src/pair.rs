//! The present state of a coupling between two agents, as its owner publishes it.

use super::wave::Wave;
use crate::AgentId;

crate::choices! {
    /// How an agent's couplings act.
    #[derive(Default)]
    pub enum PairKind {
        /// Contact by impulse ledger.
        #[default]
        Ledger = "ledger",
        /// Contact within one cluster.
        Cluster = "cluster",
        /// Contact or link by wave variables.
        Tlm = "tlm",
        /// A tool's hold.
        Grasp = "grasp",
        /// A bilateral link of the scene.
        Attachment = "attach",
    }
}

/// The present state of a coupling, published by its owner.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct PairState {
    /// The agent on the other side.
    pub with: AgentId,
    /// By which law.
    pub kind: PairKind,
    /// Places that touch or are held.
    pub contacts: u32,
    /// Mean force of the last step, newtons.
    pub force_n: f64,
    /// The deepest overlap seen in the last step, metres, ≥ 0.
    pub penetration_m: f64,
    /// The impulses given to the other side so far, magnitudes summed, N·s.
    pub impulse_n_s: f64,
    /// The impulse that the other side has not yet acknowledged, N·s.
    pub in_flight_n_s: f64,
    /// How easily the owner and the other side give way along the normal at the contact that bears most, 1/kg, ≥ 0, when they last
    /// pressed on each other (a few steps ago at most); the sum is W of that contact. `None` where no contact was solved between the two.
    pub inverse_mass_per_kg: Option<[f64; 2]>,
    /// The mass that the law adds to the other side, kg: k T² of wave variables, else zero.
    pub parasitic_kg: f64,
    /// The wave that this end of a line sends; with wave variables both sides publish the pair.
    pub wave: Option<Wave>,
}

impl PairState {
    /// A coupling that has done nothing yet.
    #[must_use]
    pub const fn new(with: AgentId, kind: PairKind) -> Self {
        Self {
            with,
            kind,
            contacts: 0,
            force_n: 0.0,
            penetration_m: 0.0,
            impulse_n_s: 0.0,
            in_flight_n_s: 0.0,
            inverse_mass_per_kg: None,
            parasitic_kg: 0.0,
            wave: None,
        }
    }
}
