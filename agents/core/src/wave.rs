//! The data that one end of a transmission line publishes (docs/theory/coupling.md, eq. 10).

use crate::SimTime;
use glam::DVec3;

/// The data that one end publishes.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Wave {
    /// ∫ w dt since the run began, N·s.
    pub sent: DVec3,
    /// The delay of the line, seconds; zero as long as the owner of the pair has not chosen it.
    pub delay_s: f64,
    /// Vector from this end to the other when the line was made, metres; zero for a line of a contact.
    pub start: DVec3,
    /// The time from which both ends apply the initial stretch of the link.
    pub since: SimTime,
}
