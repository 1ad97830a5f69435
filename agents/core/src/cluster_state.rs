//! How a contact cluster was solved, as its members publish it.

use crate::AgentId;

/// An agent's part in the contact cluster that it was stepped in last.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ClusterState {
    /// The member of lowest number: it makes the cluster's turns.
    pub leader: AgentId,
    /// Steps of this member within the last macro step, ≥ 1.
    pub parts: u32,
    /// The last macro step, seconds.
    pub step_s: f64,
    /// How the cluster was solved; of the leader only.
    pub solves: Option<ClusterSolves>,
}

crate::choices! {
    /// How far a solve of contacts went, the dearest last. All laws hold to the tolerance but at the last two.
    #[derive(PartialOrd, Ord, Default)]
    pub enum SolveLevel {
        /// The impulses of the last step still hold.
        #[default]
        Kept = "kept",
        /// Newton's method found the rest from them.
        Near = "near",
        /// Interior points led to where all laws hold.
        Polished = "polished",
        /// Interior points, ended before all laws held, by the budget or after as many steps as any solve makes: inside all bounds, with momentum and
        /// passivity as everywhere; the miss says how far off.
        Interior = "interior",
        /// Rigid bodies for whose solve there was no time were stepped by rapier3d, as deep in each other as that leaves them; others as far as above.
        RigidPile = "rigid-pile",
    }
}

/// How a cluster was solved. Counts are those of all steps that its leader has led so far.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct ClusterSolves {
    /// Contacts of the last step, unloaded ones included.
    pub contacts: u32,
    /// Problems solved.
    pub problems: u64,
    /// Factors of the coupled matrix.
    pub factors: u64,
    /// Products of conjugate gradients: of problems that are solved without factors.
    pub products: u64,
    /// Problems whose solve ended before all laws of contact held to the tolerance.
    pub unfinished: u64,
    /// The dearest level of a solve of the last step.
    pub level: SolveLevel,
    /// Factors of the last step.
    pub last_factors: u32,
    /// The greatest miss of laws and momentum by answers of the last step, m/s, ≥ 0; infinite where numbers overflowed.
    pub miss_m_s: f64,
    /// The deepest overlap of the last step, metres, ≥ 0.
    pub depth_m: f64,
    /// The deepest overlap ever, metres, ≥ 0.
    pub deepest_m: f64,
}
