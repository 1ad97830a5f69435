//! Specification of a tool: script and grasp, the numbers a scene gives, and their checks.

use crate::trajectory::Keyframe;
use glam::DVec3;
use metachron_core::{AgentId, unit_rotation};
use metachron_geometry::ContactTraits;

/// A tool before it is built.
#[derive(Debug, Clone)]
pub struct ToolSpec {
    /// Its motion: at least one keyframe, times rising. A tool with one keyframe waits there for a user spring.
    pub keyframes: Vec<Keyframe>,
    /// Whether the motion starts again after the last keyframe. A script that does not end where it began first goes back
    /// there, in as long as its last leg took.
    pub repeat: bool,
    /// How far the jaws reach from the tip, metres, > 0: from the tip to the skin of the grasped body. A rigid body is kept
    /// from turning as by springs at this distance.
    pub reach_m: f64,
    /// Stiffness of the grasp, N/m, > 0.
    pub stiffness_n_m: f64,
    /// Damping of the grasp, N·s/m, ≥ 0.
    pub damping_n_s_m: f64,
    /// Force limit of its drive, newtons, 1e-6 … 1000: a stronger resistance holds the tip back from its path. Above that range light
    /// bodies are pressed into their supports.
    pub max_force_n: f64,
    /// The agents it can grasp: tubes, soft and rigid bodies.
    pub graspable: Vec<AgentId>,
    /// The remote centre of motion, metres: a fixed point that the shaft passes through wherever the tip is, as through a trocar; the
    /// rotations of keyframes then only turn the tool about its shaft. The pivot is on the shaft ([`ToolSpec::insertion_m`]) in every
    /// keyframe; a tip led farther away, or nearer, stops there. `None` for a tool whose rotation is led.
    pub pivot_m: Option<DVec3>,
    /// Its groups, combine rules, spin friction, and whether it is a sensor.
    pub traits: ContactTraits,
    /// Offset of the tip's start from the first keyframe, metres: it approaches its path from there as after a user spring.
    pub starts_off_m: DVec3,
}

/// Why a tool cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ToolError {
    /// There is no keyframe.
    #[error("a tool needs at least one keyframe")]
    NoKeyframe,
    /// A keyframe is not later than the one before it.
    #[error("keyframe {index} is at {at_s} s; its time must be later than that of the keyframe before, {before_s} s")]
    NotRising {
        /// Number of the keyframe, from 0.
        index: usize,
        /// Its time.
        at_s: f64,
        /// The time of the keyframe before.
        before_s: f64,
    },
    /// A number of a keyframe is outside its range.
    #[error("{what} of keyframe {index} is {value}; it must be {wanted}")]
    BadKeyframe {
        /// Number of the keyframe, from 0.
        index: usize,
        /// Which number.
        what: &'static str,
        /// The value given.
        value: f64,
        /// The range it must be in.
        wanted: &'static str,
    },
    /// The tip of a keyframe is so far from the pivot, or so near, that the pivot is not on the shaft.
    #[error(
        "keyframe {index} has its tip {depth_m} m from the pivot; it must be between {least_m} and {most_m} m away, with the pivot on \
         the shaft"
    )]
    Unreachable {
        /// Number of the keyframe, from 0.
        index: usize,
        /// Distance from the pivot to the tip, metres.
        depth_m: f64,
        /// Its least, metres.
        least_m: f64,
        /// Its greatest, metres.
        most_m: f64,
    },
    /// A number of the tool is outside its range.
    #[error("{what} is {value}; it must be {wanted}")]
    BadNumber {
        /// Which number.
        what: &'static str,
        /// The value given.
        value: f64,
        /// The range it must be in.
        wanted: &'static str,
    },
}

/// The largest coordinate of a tool, metres.
pub(super) const REACH_MAX_M: f64 = 1e6;
/// The strongest drive, newtons: its tip has a mass of 6 kg.
const FORCE_MAX_N: f64 = 1e3;
/// The longest script, seconds (11 days).
const SCRIPT_MAX_S: f64 = 1e6;

impl ToolSpec {
    /// Whether every number is in its range.
    pub(super) fn check(&self) -> Result<(), ToolError> {
        if self.keyframes.is_empty() {
            return Err(ToolError::NoKeyframe);
        }
        let number = |what, value: f64, good: bool, wanted| {
            if good { Ok(()) } else { Err(ToolError::BadNumber { what, value, wanted }) }
        };
        let within = |value: f64, low: f64, high: f64| (low..=high).contains(&value);
        number("the reach", self.reach_m, within(self.reach_m, 1e-9, 1e3), "between 1e-9 and 1000 m")?;
        let k = self.stiffness_n_m;
        number("the stiffness", k, within(k, f64::MIN_POSITIVE, 1e9), "above zero and at most 1e9 N/m")?;
        let c = self.damping_n_s_m;
        let f = self.max_force_n;
        number("the maximum force", f, within(f, 1e-6, FORCE_MAX_N), "between 1e-6 and 1000 N")?;
        number("the damping", c, within(c, 0.0, 1e9), "between 0 and 1e9 N·s/m")?;
        let off_m = self.starts_off_m.length();
        number(
            "the initial offset from the first keyframe",
            off_m,
            within(off_m, 0.0, REACH_MAX_M),
            "finite, within 1e6 m",
        )?;
        let pivot = self.pivot();
        for value in self.pivot_m.map_or([0.0; 3], |pivot_m| pivot_m.to_array()) {
            number("the pivot", value, within(value, -REACH_MAX_M, REACH_MAX_M), "finite, within 1e6 m")?;
        }
        let mut before_s = f64::NEG_INFINITY;
        for (index, key) in self.keyframes.iter().enumerate() {
            key.check(index)?;
            pivot.map_or(Ok(()), |pivot| pivot.check(index, key))?;
            if key.at_s <= before_s {
                return Err(ToolError::NotRising { index, at_s: key.at_s, before_s });
            }
            before_s = key.at_s;
        }
        Ok(())
    }
}

impl Keyframe {
    fn check(&self, index: usize) -> Result<(), ToolError> {
        let check = |what, value: f64, range: (f64, f64), wanted| {
            let good = (range.0..=range.1).contains(&value);
            if good { Ok(()) } else { Err(ToolError::BadKeyframe { index, what, value, wanted }) }
        };
        check("the time", self.at_s, (0.0, SCRIPT_MAX_S), "between 0 and 1e6 s")?;
        check("the jaw", self.jaw, (0.0, 1.0), "between 0 and 1")?;
        for value in self.tip_m.to_array() {
            check("the tip", value, (-REACH_MAX_M, REACH_MAX_M), "finite, within 1e6 m")?;
        }
        let (what, wanted) = ("the rotation's length", "above zero and finite");
        let bad = || ToolError::BadKeyframe { index, what, value: self.rotation.length(), wanted };
        unit_rotation(self.rotation).map(drop).ok_or_else(bad)
    }
}
