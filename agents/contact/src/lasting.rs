//! What others may expect of an acceleration.
//!
//! In: what a body gained in its last step. Out: what of it is expected to go on. Never here: who expects it.
//! Theory: docs/theory/coupling.md, section 3.

use glam::DVec3;

/// An acceleration farther from free fall than this is a blow and not the way things go on, m/s²: three times gravity.
const BLOW_M_S2: f64 = 30.0;

/// An acceleration as others may expect it to last: no farther from free fall than a blow.
#[must_use]
pub fn smooth(acceleration: DVec3, gravity: DVec3) -> DVec3 {
    if acceleration.is_finite() { gravity + (acceleration - gravity).clamp_length_max(BLOW_M_S2) } else { gravity }
}
