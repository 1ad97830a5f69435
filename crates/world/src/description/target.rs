//! The target frame rate of a scene, and how it is held.
//!
//! In: built in code or read from a scene file. Out: plain data for control. Never here: control.

use super::kinds::{LawKind, PolicyKind, ValueKind};

/// Default share of the lag that is reserved for choosing levels: the most that (GB99) needed.
const OPTIMISER_SHARE: f64 = 0.05;
/// The range of [`Target::render_scale`], and its default.
pub const RENDER_SCALE: (f64, f64) = (0.35, 1.0);

/// The target frame rate and how it is held; gains that are `None` are the law's own, factors the policy's.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Deserialize, schemars::JsonSchema), serde(default, deny_unknown_fields))]
pub struct Target {
    /// Target frames per second. Default 60.
    pub frame_hz: f64,
    /// Policy that chooses the level of every visible object. Default `adaptive`.
    pub policy: PolicyKind,
    /// How `robin-hood` values an object. Default `plain`.
    pub value: ValueKind,
    /// Feedback law. Default `corrected`.
    pub law: LawKind,
    /// Gain α of the printed law. Default 1e-4.
    pub alpha: Option<f64>,
    /// Gain β of the printed law. Default 5.
    pub beta: Option<f64>,
    /// Gain κ of the corrected law; below 1 it is stable for every scene. Default: the law's own.
    pub kappa: Option<f64>,
    /// Gain λ of the corrected law on the error's change. Default: the law's own.
    pub lead: Option<f64>,
    /// Share of the frame time that is left free. Default: for feedback its law's own, for policies that predict 0.02.
    pub margin: Option<f64>,
    /// Gain of the agents' own loops: share of the way to a finer level that one demand goes. Default 0.5.
    pub agent_refine: Option<f64>,
    /// Gain of the agents' own loops: share of a delay by others that one demand removes. Default 0.5.
    pub agent_yield: Option<f64>,
    /// Greatest lag from reading the camera to the finished picture, milliseconds: levels are chosen so that it is kept, and the
    /// camera is drawn at its predicted pose for that time. Default: no bound, and the camera is drawn where it was read.
    pub lag_ms: Option<f64>,
    /// Share reserved for choosing levels, of the part that culling leaves of `lag_ms`. Default 0.05.
    pub optimiser_share: f64,
    /// Whether `adaptive` and `robin-hood` spend time left over when everything is at its finest on still smoother shapes and softer
    /// shadows. Default false.
    pub raise: bool,
    /// Whether policies that choose by cost may leave objects out of the picture where not even the coarsest of everything fits: for objects without a `may_vanish` of their own. Default false.
    pub may_vanish: bool,
    /// How much a level's benefit falls with the distance from the middle of the picture. Default 0. This and the next two are for
    /// policies that choose by cost.
    pub focus: Option<f64>,
    /// How much it falls with speed across the picture. Default 0 for `greedy`, `greedy-incremental` and `greedy-repaired`, 0.5 for
    /// the others.
    pub motion: Option<f64>,
    /// How much it falls with the distance from the level of the frame before: for `greedy`, `greedy-incremental`,
    /// `greedy-repaired`, and in addition to its own for `adaptive`. Default 0.
    pub hysteresis: Option<f64>,
    /// Fraction of its width and height that the picture is drawn with, `[least, most]` or one number for both; in steps of 0.05. Then it is
    /// enlarged.
    /// Fewer pixels are drawn where all else is at its coarsest and frames are late still. Default `[0.35, 1.0]`.
    pub render_scale: OneOrRange<f64>,
}

/// One number, which fixes a value, or `[least, greatest]`, within which a controller chooses.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema),
    serde(
        untagged,
        expecting = "expected a number, of levels a whole number from 0 to 10, or a range [least, greatest]"
    ),
    schemars(inline)
)]
pub enum OneOrRange<T> {
    /// The value never changes.
    One(T),
    /// The controller may choose any value from the first to the second, both included.
    #[cfg_attr(feature = "serde", schemars(extend("x-rises" = true)))]
    Range([T; 2]),
}

impl<T: Copy> OneOrRange<T> {
    /// The least and the greatest value.
    #[must_use]
    pub fn ends(self) -> (T, T) {
        match self {
            Self::One(value) => (value, value),
            Self::Range([least, greatest]) => (least, greatest),
        }
    }
}

impl Default for Target {
    fn default() -> Self {
        Self {
            frame_hz: 60.0,
            policy: PolicyKind::default(),
            value: ValueKind::default(),
            law: LawKind::default(),
            alpha: None,
            beta: None,
            kappa: None,
            lead: None,
            margin: None,
            agent_refine: None,
            agent_yield: None,
            lag_ms: None,
            optimiser_share: OPTIMISER_SHARE,
            raise: false,
            may_vanish: false,
            focus: None,
            motion: None,
            hysteresis: None,
            render_scale: OneOrRange::Range([RENDER_SCALE.0, RENDER_SCALE.1]),
        }
    }
}

impl Target {
    /// The greatest lag from reading the camera to the finished picture, seconds, and the share reserved for choosing levels of the part
    /// that culling leaves of it; `None` where the scene sets no bound.
    #[must_use]
    pub fn lag(&self) -> Option<(f64, f64)> {
        self.lag_ms.map(|lag_ms| (lag_ms * 1e-3, self.optimiser_share))
    }
}
