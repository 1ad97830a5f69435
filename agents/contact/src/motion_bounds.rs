//! The bound of places and velocities that users give.
//!
//! In: a vector. Out: whether it is within. Never here: the bounds of forces, messages.

use glam::DVec3;

/// The largest coordinate of a place that a body is at, moved or led to, or held at, metres, and of its velocity and spin, m/s and rad/s.
pub const MOTION_MAX: f64 = 1e6;

/// Whether a place, a velocity or a spin is finite and within [`MOTION_MAX`] along each axis.
#[must_use]
pub fn is_within_motion(vector: DVec3) -> bool {
    // no comparison holds for NaN
    vector.to_array().into_iter().all(|value| value.abs() <= MOTION_MAX)
}
