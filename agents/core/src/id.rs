//! The number of an agent.

/// An agent's number: its index in the scene, fixed for a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
pub struct AgentId(pub u32);
