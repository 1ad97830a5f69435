//! Detects that a tube has come to rest.
//!
//! In: its motion, step by step. Out: true after enough quiet time. Never here: the use of it (sleep is up to the runtime).

use super::state::RodState;
use crate::limits::{QUIET_ACCELERATION_M_S2, QUIET_S, QUIET_SPEED_M_S};
use glam::DVec3;

/// Counts quiet time.
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
pub struct RestDetector {
    quiet_s: f64,
    before: Vec<DVec3>,
}

impl RestDetector {
    /// Becomes equal to another, in the storage that is there.
    pub fn copy_from(&mut self, other: &Self) {
        self.quiet_s = other.quiet_s;
        self.before.clone_from(&other.before);
    }

    /// Restarts the count.
    pub fn wake(&mut self) {
        self.quiet_s = 0.0;
    }

    /// Observes a step of `dt` seconds that ended at `now`; returns whether the tube has been quiet for long enough.
    pub fn observe(&mut self, now: &RodState, dt: f64) -> bool {
        let known = self.before.len() == now.x.len();
        let nodes = now.u.iter().step_by(2);
        let speed2 = nodes.clone().map(|v| v.length_squared()).fold(0.0, f64::max);
        let change2 = nodes.clone().zip(&self.before).map(|(v, b)| (*v - *b).length_squared()).fold(0.0, f64::max);
        let limit = QUIET_ACCELERATION_M_S2 * dt;
        let quiet = known && speed2 <= QUIET_SPEED_M_S * QUIET_SPEED_M_S && change2 <= limit * limit;
        self.quiet_s = if quiet { self.quiet_s + dt } else { 0.0 };
        self.before.clear();
        self.before.extend(nodes);
        self.quiet_s >= QUIET_S
    }
}
