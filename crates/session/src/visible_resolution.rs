//! Resolution that an agent's simulation needs for the current view.
//!
//! In: what the camera sees of every actor. Out: for each steered agent, the ε below which no difference is visible. Never here: the
//! agent's reaction to it ([`metachron_lod::control::RateControl`] does). Theory: `docs/theory/control.md`, section 5.

use super::cpu_budget::AgentBudget;
use metachron_render::{Camera, Size, Visibility};
use std::sync::Arc;
use std::time::Duration;

/// Visibility of the steered agents.
#[derive(Debug)]
pub(super) struct VisibleResolution {
    tracked: Vec<TrackedAgent>,
}

/// A steered agent, and when it was last in view.
#[derive(Debug)]
struct TrackedAgent {
    budget: Arc<AgentBudget>,
    seen_at: Duration,
}

/// An object counts as out of sight after it has not been in view for this long: cameras turn back.
const GONE: Duration = Duration::from_secs(1);

impl VisibleResolution {
    /// No agent has been in view yet.
    pub fn new(budgets: &[Arc<AgentBudget>]) -> Self {
        let track = |budget: &Arc<AgentBudget>| TrackedAgent { budget: Arc::clone(budget), seen_at: Duration::ZERO };
        Self { tracked: budgets.iter().map(track).collect() }
    }

    /// Takes the actors as `camera` sees them at the time `now`.
    pub fn update(&mut self, now: Duration, seen: &[Visibility], camera: &Camera, size: Size) {
        if size.is_empty() {
            return;
        }
        for TrackedAgent { budget, seen_at } in &mut self.tracked {
            // an agent without a shape is never drawn, so it is not out of view either
            let Some(seen) = seen.get(budget.id().0 as usize).filter(|seen| seen.radius_m > 0.0) else { continue };
            if seen.visible {
                *seen_at = now;
                budget.set_visible_eps(pixel_m(seen, camera, size));
            } else if now.saturating_sub(*seen_at) >= GONE {
                budget.set_visible_eps(f64::INFINITY);
            }
        }
    }
}

/// Width of a pixel at the nearest point of an actor, metres.
fn pixel_m(seen: &Visibility, camera: &Camera, size: Size) -> f64 {
    let depth_m = (seen.centre_m - camera.eye()).dot(camera.forward()) - seen.radius_m;
    1.0 / camera.pixels_per_metre(depth_m, size)
}
