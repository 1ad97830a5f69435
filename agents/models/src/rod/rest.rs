//! Detects that a tube has come to rest.
//!
//! In: its motion, step by step. Out: true after enough quiet time. Never here: the use of it (sleep is up to the runtime).

use super::state::RodState;
use glam::DVec3;

/// A node is quiet below this speed, m/s: a tenth of a millimetre per second is invisible on any screen.
const SPEED_MAX_M_S: f64 = 1e-4;
/// A node is quiet below this change of speed, m/s²: a thousandth of gravity. A swing at its turning point is not quiet.
const ACCELERATION_MAX_M_S2: f64 = 1e-2;
/// All nodes must have been quiet for this long, seconds of the tube's own time.
const QUIET_S: f64 = 0.5;

/// Counts quiet time.
#[derive(Debug, Clone, Default)]
pub struct RestWatch {
    quiet_s: f64,
    before: Vec<DVec3>,
}

impl RestWatch {
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
        let limit = ACCELERATION_MAX_M_S2 * dt;
        let quiet = known && speed2 <= SPEED_MAX_M_S * SPEED_MAX_M_S && change2 <= limit * limit;
        self.quiet_s = if quiet { self.quiet_s + dt } else { 0.0 };
        self.before.clear();
        self.before.extend(nodes);
        self.quiet_s >= QUIET_S
    }
}
