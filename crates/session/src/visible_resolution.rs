//! Resolution and rate that an agent's simulation needs for the current view.
//!
//! In: the visibility of every actor, and by which level it is drawn. Out: for each steered agent, the ε and the step
//! below which no difference is visible. Never here: the agent's reaction to it
//! ([`metachron_lod::control::RateControl`] does). Theory: `docs/theory/control.md`, section 5.

use super::assemble;
use super::cpu_budget::AgentBudget;
use metachron_core::Snapshot;
use metachron_lod::control::VisibleDetail;
use metachron_render::{Camera, Level, Size, Visibility};
use metachron_world::Scene;
use std::sync::Arc;
use std::time::Duration;

/// Visibility of the steered agents.
#[derive(Debug, Clone)]
pub(super) struct VisibleResolution {
    tracked: Vec<TrackedAgent>,
    /// The groups with agents in them, inner ones first.
    groups: Vec<AgentGroup>,
}

/// A steered agent, and when it was last in view.
#[derive(Debug, Clone)]
struct TrackedAgent {
    budget: Arc<AgentBudget>,
    seen_at: Duration,
}

/// A group with agents in it.
#[derive(Debug, Clone)]
struct AgentGroup {
    /// The actor of its impostor.
    actor: usize,
    /// For every agent whether it is in the group.
    holds: Vec<bool>,
    /// Side of a triangle of the impostor, pixels, while that is drawn in place of all that the group's agents may touch.
    side_px: Option<f64>,
}

/// The visibility of all actors in a frame.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    /// Of every actor.
    pub actors: &'a [Visibility],
    /// Their levels in the frame before.
    pub levels: &'a [Level],
    /// The newest states of the agents.
    pub states: &'a [Arc<Snapshot>],
}

/// An object counts as out of sight after it has not been in view for this long: cameras turn back.
const GONE: Duration = Duration::from_secs(1);

impl VisibleResolution {
    /// No agent of `scene` has been in view yet.
    pub fn new(budgets: &[Arc<AgentBudget>], scene: &Scene) -> Self {
        let track = |budget: &Arc<AgentBudget>| TrackedAgent { budget: Arc::clone(budget), seen_at: Duration::ZERO };
        let agents = scene.agents.len();
        let first = agents + scene.scenery.len();
        let group = |(k, members): (usize, Vec<usize>)| AgentGroup {
            actor: first + k,
            holds: (0..agents).map(|at| members.contains(&at)).collect(),
            side_px: None,
        };
        let groups = assemble::members(scene).into_iter().enumerate().map(group);
        Self {
            tracked: budgets.iter().map(track).collect(),
            groups: groups.filter(|group| group.holds.contains(&true)).collect(),
        }
    }

    /// An agent has joined: the impostors are one place further on.
    pub fn join(&mut self) {
        self.groups.iter_mut().for_each(|group| group.actor += 1);
    }

    /// Takes the actors as `camera` sees them at the time `now`.
    pub fn update(&mut self, now: Duration, seen: Seen<'_>, camera: &Camera, size: Size) {
        if size.is_empty() {
            return;
        }
        self.groups.iter_mut().for_each(|group| group.update(seen));
        for TrackedAgent { budget, seen_at } in &mut self.tracked {
            let at = budget.id().0 as usize;
            // an agent without a shape is never drawn, so it is not out of view either
            let Some(actor) = seen.actors.get(at).filter(|actor| actor.radius_m > 0.0) else { continue };
            if actor.visible {
                *seen_at = now;
                let side_px = self.groups.iter().filter(|group| group.holds[at]).find_map(|group| group.side_px);
                budget.set_visible(visible_detail(actor, side_px, pixel_m(actor, camera, size)));
            } else if now.saturating_sub(*seen_at) >= GONE {
                budget.set_visible(VisibleDetail { eps_m: f64::INFINITY, dt_s: 0.0 });
            }
        }
    }
}

/// The finest ε and step that are seen of an agent which is drawn by itself, or by an impostor with triangles of a side
/// of so many pixels, where a pixel is so many metres wide.
fn visible_detail(seen: &Visibility, side_px: Option<f64>, pixel_m: f64) -> VisibleDetail {
    match side_px {
        // nothing finer than a triangle is drawn, and no motion shorter than one tells two steps apart
        Some(side_px) => VisibleDetail { eps_m: side_px * pixel_m, dt_s: side_px / seen.own_speed_px_s },
        None => VisibleDetail { eps_m: pixel_m, dt_s: 0.0 },
    }
}

impl AgentGroup {
    fn update(&mut self, seen: Seen<'_>) {
        let drawn = seen.levels.get(self.actor).map_or(0, |level| level.triangles);
        let impostor = seen.actors.get(self.actor).filter(|impostor| drawn > 0 && impostor.visible);
        // half of a closed surface faces the eye, and half a square is a triangle
        let side = |impostor: &Visibility| (2.0 * (impostor.pixels / f64::from(drawn)).sqrt()).max(1.0);
        self.side_px = impostor.filter(|_| self.is_whole(seen.states)).map(side);
    }

    /// Whether no agent outside is in a cluster with one of the group's own: bodies that these touch are drawn by the
    /// impostor too.
    fn is_whole(&self, states: &[Arc<Snapshot>]) -> bool {
        let leader = |at: usize| states[at].cluster.map_or(at, |cluster| cluster.leader.0 as usize);
        let agents = self.holds.len().min(states.len());
        let mut ours = vec![false; agents];
        let mut mark = |at: usize| ours.get_mut(leader(at)).into_iter().for_each(|leads| *leads = true);
        (0..agents).filter(|at| self.holds[*at]).for_each(&mut mark);
        (0..agents).all(|at| self.holds[at] || !ours.get(leader(at)).is_some_and(|leads| *leads))
    }
}

/// Width of a pixel at the nearest point of an actor, metres.
fn pixel_m(seen: &Visibility, camera: &Camera, size: Size) -> f64 {
    let depth_m = (seen.centre_m - camera.eye()).dot(camera.forward()) - seen.radius_m;
    1.0 / camera.pixels_per_metre(depth_m, size)
}
