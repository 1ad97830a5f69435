//! Events of a scene's attachments, as the agents that hold them publish them.
//!
//! In: which attachment failed, when, and by which force. Out: the same in snapshots and reports. Never here: forces.

use crate::{AgentId, SimTime};
use std::fmt;

/// An attachment of a scene, by its number among those of its kind, from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum AttachmentId {
    /// A coupling that joins a point of one agent to one of another.
    Coupling(u32),
    /// A joint.
    Joint(u32),
    /// A part of an agent that is attached to its place at the start; by its number among those of the agent.
    Part(u32),
}

/// Written as places of scenes are: `coupling.0`, `joint.3`, `attach.1` of an object.
impl fmt::Display for AttachmentId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Coupling(number) => write!(f, "coupling.{number}"),
            Self::Joint(number) => write!(f, "joint.{number}"),
            Self::Part(number) => write!(f, "attach.{number}"),
        }
    }
}

/// Something that happened to an attachment.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct AttachmentEvent {
    /// Which one.
    pub attachment: AttachmentId,
    /// Whether it yielded or tore.
    pub kind: AttachmentEventKind,
    /// The agent at its other end; `None` is the world.
    pub with: Option<AgentId>,
    /// When it happened, in the scene's time: the end of the step over which it gave too much.
    pub at: SimTime,
    /// The force that it gave: its mean over that step, newtons.
    pub force_n: f64,
}

crate::choices! {
    /// The kinds of events of an attachment.
    #[derive(PartialOrd, Ord)]
    pub enum AttachmentEventKind {
        /// It slipped for the first time.
        Yielded = "yielded",
        /// It tore, for good.
        Tore = "tore",
    }
}
