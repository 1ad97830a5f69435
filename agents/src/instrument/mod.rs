//! A driven tool: follows keyframes or a hand, opens, closes, grasps a tube and drags it.

use crate::AgentId;
use glam::{DQuat, DVec3};

/// A tool before it is built.
#[derive(Debug, Clone)]
pub struct ToolSpec {
    /// Its motion: at least one keyframe, times rising.
    pub keyframes: Vec<Keyframe>,
    /// Whether the motion starts again after the last keyframe.
    pub repeat: bool,
    /// How far from the tip the jaws reach, metres, > 0.
    pub reach_m: f64,
    /// Stiffness of the hold, N/m, > 0.
    pub stiffness_n_m: f64,
    /// Damping of the hold, N·s/m, ≥ 0.
    pub damping_n_s_m: f64,
    /// The tubes it can grasp.
    pub graspable: Vec<AgentId>,
}

/// Where a tool is at one time of its script.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keyframe {
    /// Seconds from the start of the script, ≥ 0.
    pub at_s: f64,
    /// The point between the jaws, metres.
    pub tip_m: DVec3,
    /// Rotation from the tool's axes (shaft along −z, so the jaws point along +z) to the world's.
    pub rotation: DQuat,
    /// Opening of the jaws: 0 shut … 1 wide open. Jaws that pass below 0.2 grasp; above 0.3 they let go.
    pub jaw: f64,
}
