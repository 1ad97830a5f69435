//! How quiet a deformable must be, and for how long, before it counts as at rest.

/// A node is quiet below this speed, m/s: a tenth of a millimetre per second is invisible on any screen.
pub(crate) const SPEED_MAX_M_S: f64 = 1e-4;
/// A node is quiet below this change of speed, m/s²: a thousandth of gravity. A swing at its turning point is not quiet.
pub(crate) const ACCELERATION_MAX_M_S2: f64 = 1e-2;
/// All nodes must have been quiet for this long, seconds of the agent's own time.
pub(crate) const QUIET_S: f64 = 0.5;
