//! `model = "tool"`: a driven tool with jaws.

use super::Point;
use super::ranges::within;
use metachron_models::tool::LIMITS;
use schemars::JsonSchema;
use serde::Deserialize;

/// A driven tool: it follows its keyframes, or the user who drags it, and grasps tubes, soft and rigid bodies.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = within(LIMITS))]
pub struct ToolFile {
    /// Its motion: 1 … 10000 keyframes. With one keyframe the tool stays there until the user drags it.
    #[schemars(length(min = 1, max = 10_000))]
    pub keyframe: Vec<KeyframeFile>,
    /// Whether the motion starts again after the last keyframe. Default false.
    pub repeat: Option<bool>,
    /// Reach of the jaws from the tip, metres. Default 0.02. A grasped rigid object is also held against rotation, by the
    /// grasp's stiffness and damping at this distance.
    pub reach_m: Option<f64>,
    /// Stiffness of the grasp, N/m. Default 200.
    pub stiffness_n_m: Option<f64>,
    /// Damping of the grasp, N·s/m. Default 1.
    pub damping_n_s_m: Option<f64>,
    /// Greatest force of the drive, newtons. Default 50. Under it the tip is displaced by up to 5 mm; a greater load holds
    /// the tip back from its path. Forces of grasps and attachments do not count.
    pub max_force_n: Option<f64>,
    /// Remote centre of motion, metres: a fixed point that the shaft passes through wherever the tip is, as through a trocar, in every
    /// keyframe 0.025 … 0.325 from the tip. Rotations of keyframes then only turn the tool about its shaft. Default: none.
    pub pivot_m: Option<Point>,
    /// Names of objects that it can grasp: tubes, sheets, solids, ropes, rigid objects that move. Default: every tube of the scene.
    pub grasps: Option<Vec<String>>,
}

/// Pose of a tool at one time of its script.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeyframeFile {
    /// Seconds from the start of the script; later than the keyframe before. Default 0 for the first.
    pub at_s: Option<f64>,
    /// The point between the jaws, metres.
    pub tip_m: Point,
    /// Rotation by angles about the world's x, then y, then z axis, degrees; unrotated jaws point along +z.
    /// Default: that of the keyframe before; for the first, none.
    pub rotation_deg: Option<Point>,
    /// Opening of the jaws: shut at 0, wide open at 1; below 0.2 they grasp, above 0.3 they release.
    /// Default: that of the keyframe before; for the first, 1.
    pub jaw: Option<f64>,
}
