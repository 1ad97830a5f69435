//! Specification of a tool: script and grasp, the numbers a scene gives, and their checks.

use crate::trajectory::Keyframe;
use glam::DVec3;
use metachron_contact::MOTION_MAX;
use metachron_core::{AgentId, NumberRange, OutOfRange, Ranges, unit_rotation};
use metachron_geometry::ContactTraits;

/// Ranges of the numbers of [`ToolSpec`]. The tip has a mass of 6 g per newton of its drive (docs/theory/coupling.md, eq. 9e): past a
/// kilonewton it presses an object of 50 g millimetres into the floor, past a hundred kilonewtons through it.
pub const LIMITS: Ranges = Ranges(&[
    ("reach_m", NumberRange::new(1e-9, 1e3, "m")),
    ("stiffness_n_m", NumberRange::new(f64::MIN_POSITIVE, 1e9, "N/m")),
    ("damping_n_s_m", NumberRange::new(0.0, 1e9, "N·s/m")),
    ("max_force_n", NumberRange::new(1e-6, 1e3, "N")),
]);

/// A tool before it is built.
#[derive(Debug, Clone)]
pub struct ToolSpec {
    /// Its motion: at least one keyframe, times rising. A tool with one keyframe waits there for a user spring.
    pub keyframes: Vec<Keyframe>,
    /// Whether the motion starts again after the last keyframe. A script that does not end where it began first goes back
    /// there, in as long as its last leg took.
    pub repeat: bool,
    /// How far the jaws reach from the tip, metres: from the tip to the skin of the grasped body. A rigid body is kept
    /// from turning as by springs at this distance.
    pub reach_m: f64,
    /// Stiffness of the grasp, N/m.
    pub stiffness_n_m: f64,
    /// Damping of the grasp, N·s/m.
    pub damping_n_s_m: f64,
    /// Force limit of its drive, newtons, within the range of [`LIMITS`]: a stronger resistance holds the tip back from its path.
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
    #[error("in keyframe {index} {fault}")]
    BadKeyframe {
        /// Number of the keyframe, from 0.
        index: usize,
        /// The number, its value and its range.
        fault: OutOfRange,
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
    #[error(transparent)]
    BadNumber(#[from] OutOfRange),
}

const COORDINATE: NumberRange = NumberRange::new(-MOTION_MAX, MOTION_MAX, "m");
/// The times of a script: up to 11 days.
const TIME: NumberRange = NumberRange::new(0.0, 1e6, "s");
/// How far jaws are open.
const JAW: NumberRange = NumberRange::new(0.0, 1.0, "");

impl ToolSpec {
    /// Whether every number is in its range.
    pub(super) fn check(&self) -> Result<(), ToolError> {
        if self.keyframes.is_empty() {
            return Err(ToolError::NoKeyframe);
        }
        LIMITS.check([self.reach_m, self.stiffness_n_m, self.damping_n_s_m, self.max_force_n])?;
        COORDINATE.check("the initial offset from the first keyframe", self.starts_off_m.length())?;
        let pivot = self.pivot();
        for value in self.pivot_m.map_or([0.0; 3], |pivot_m| pivot_m.to_array()) {
            COORDINATE.check("the pivot", value)?;
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
        let wrong = |fault| ToolError::BadKeyframe { index, fault };
        TIME.check("the time", self.at_s).map_err(wrong)?;
        JAW.check("the jaw", self.jaw).map_err(wrong)?;
        self.tip_m.to_array().into_iter().try_for_each(|value| COORDINATE.check("the tip", value)).map_err(wrong)?;
        let bad = || OutOfRange::new("the rotation's length", self.rotation.length(), "one above zero and finite");
        unit_rotation(self.rotation).map(drop).ok_or_else(|| wrong(bad()))
    }
}
