//! The ranges that keys of several models share.

/// Coordinates of a scene stay within this, metres: past it a millimetre is lost in 32-bit drawing.
pub(crate) const POSITION_MAX_M: f64 = 1e5;

/// Fastest start, m/s and rad/s: a faster body passes through anything within one step.
pub(super) const SPEED_MAX: f64 = 1e4;

/// Greatest angle of a rotation to either side, degrees: past it double precision leaves less than a billionth of a turn.
pub(super) const ROTATION_MAX_DEG: f64 = 1e6;

/// Most keyframes of a script.
pub(super) const KEYFRAMES_MAX: usize = 10_000;
