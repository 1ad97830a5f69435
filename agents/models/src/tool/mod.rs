//! A driven tool: follows keyframes or a user spring, opens, closes, grasps a tube, a soft or a rigid body and drags it.
//!
//! In: a [`ToolSpec`], steps, the user spring, the snapshots of graspable agents. Out: a tip, jaws, a grasp.
//! Never here: the grasp force; it is a row of the cluster's problem.
//!
//! `trajectory.rs` evaluates the keyframes, `drive.rs` computes how far the tip gets there against contact, `gripper.rs` the
//! grasp, `pivot.rs` the
//! point that the shaft of one in a trocar passes through, `agent.rs` is the agent, `member.rs` its part in a contact cluster.

mod agent;
mod drive;
mod gripper;
mod member;
mod pivot;
mod spec;

pub use crate::trajectory::Keyframe;
pub use agent::Tool;
pub use spec::{LIMITS, ToolError, ToolSpec};

#[cfg(test)]
mod tests;
