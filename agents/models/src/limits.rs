//! Limits that several models share.
//!
//! Never here: limits of one model alone.

/// A node or vertex is quiet below this speed, m/s: a tenth of a millimetre per second is invisible on any screen.
pub(crate) const QUIET_SPEED_M_S: f64 = 1e-4;
/// A node or vertex is quiet below this change of speed, m/s²: a thousandth of gravity. A swing at its turning point is not quiet.
pub(crate) const QUIET_ACCELERATION_M_S2: f64 = 1e-2;
/// All nodes or vertices of a body at rest have been quiet for this long, seconds of its own time.
pub(crate) const QUIET_S: f64 = 0.5;
