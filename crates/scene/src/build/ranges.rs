//! The ranges that keys of several models share.

use crate::check::{Allowed, allowed};

/// Coordinates of a scene stay within this, metres: past it a millimetre is lost in 32-bit drawing.
pub(crate) const POSITION_MAX_M: f64 = 1e5;

/// Fastest start, m/s and rad/s: a faster body passes through anything within one step.
pub(super) const SPEED_MAX: f64 = 1e4;

/// Greatest angle of a rotation to either side, degrees: past it double precision leaves less than a billionth of a turn.
pub(super) const ROTATION_MAX_DEG: f64 = 1e6;

/// Most keyframes of a script.
pub(super) const KEYFRAMES_MAX: usize = 10_000;

/// Sizes of solids, rigid or soft.
pub(super) const LENGTH: Allowed = allowed(1e-6..=1e4, "m");

/// Scales of meshes: metres per unit of the file.
pub(super) const SCALE: Allowed = allowed(1e-6..=1e6, "");

/// Coulomb friction coefficients of surfaces.
pub(super) const FRICTION: Allowed = allowed(0.0..=10.0, "");

/// Stiffness of springs of couplings and joints.
pub(super) const STIFFNESS: Allowed = allowed(1e-6..=1e9, "N/m");

/// Damping of the same springs.
pub(super) const DAMPING: Allowed = allowed(0.0..=1e7, "N·s/m");

/// Forces above which couplings and joints tear.
pub(super) const TEARING: Allowed = allowed(1e-6..=1e9, "N");

/// Times of keyframes and loads.
pub(super) const TIME: Allowed = allowed(0.0..=1e6, "s");
