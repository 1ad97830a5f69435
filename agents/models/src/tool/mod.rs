//! A driven tool: follows keyframes or a hand, opens, closes, grasps a tube, a soft or a rigid body and drags it.
//!
//! In: a [`ToolSpec`], steps, the user's hand, the snapshots of what it can grasp. Out: a tip, jaws, a hold.
//! Never here: the force of the hold. What is held solves it in its own step and books it in a ledger (`felt.rs` reads it).
//!
//! `script.rs` says where the keyframes lead, `drive.rs` how far the tip gets there against what it touches, `jaws.rs` what the
//! jaws catch, `tool.rs` is the agent.

mod agent;
mod drive;
mod force_sensor;
mod gripper;
mod spec;
mod trajectory;

pub use agent::Instrument;
pub use spec::{Keyframe, ToolError, ToolSpec};

#[cfg(test)]
mod tests;
