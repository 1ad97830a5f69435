//! `model = "instrument"`: a driven tool with jaws.

use super::Point;
use schemars::JsonSchema;
use serde::Deserialize;

/// A driven tool: it follows its keyframes, or the user's hand, and grasps tubes, soft and rigid bodies.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InstrumentFile {
    /// Its motion: 1 … 10000 keyframes. One keyframe is a tool that waits there for a hand.
    #[schemars(length(min = 1, max = 10_000))]
    pub keyframe: Vec<KeyframeFile>,
    /// Whether the motion starts again after the last keyframe. Default false.
    pub repeat: Option<bool>,
    /// How far from the tip the jaws reach, metres, 1e-6 … 100. Default 0.02. Against turning, a rigid object is held as by the
    /// hold's stiffness and damping at this distance.
    pub reach_m: Option<f64>,
    /// Stiffness of the hold, N/m, 1e-3 … 1e7. Default 200.
    pub stiffness_n_m: Option<f64>,
    /// Damping of the hold, N·s/m, 0 … 1e5. Default 1.
    pub damping_n_s_m: Option<f64>,
    /// The most that the drive pushes with, newtons, 1e-3 … 1e6. Default 50. The tip gives way to it by up to 5 mm; what is stronger
    /// holds it back from its path. What it holds or is linked to does not count.
    pub max_force_n: Option<f64>,
    /// Names of what it can grasp: tubes, sheets, solids, ropes, rigid objects that move. Default every tube of the scene.
    pub grasps: Option<Vec<String>>,
}

/// Where a tool is at one time of its script.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KeyframeFile {
    /// Seconds from the start of the script, 0 … 1e6, later than the keyframe before. Default 0 for the first.
    pub at_s: Option<f64>,
    /// The point between the jaws, metres.
    pub tip_m: Point,
    /// Rotation by angles about the world's x, then y, then z axis, degrees; unrotated jaws point along +z.
    /// Default: that of the keyframe before; for the first, none.
    pub rotation_deg: Option<Point>,
    /// Opening of the jaws: 0 shut … 1 wide open; below 0.2 they grasp, above 0.3 they let go.
    /// Default: that of the keyframe before; for the first, 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub jaw: Option<f64>,
}
