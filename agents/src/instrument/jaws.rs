//! What the jaws catch: the nearest point of a tube or soft body within reach, held by a spring that comes on smoothly.
//!
//! In: an opening, a tip, the snapshots around. Out: a [`Grasp`]. Never here: where the tip goes.

use super::ToolSpec;
use crate::{AgentId, Anchor, Body, CurveState, Grasp, SoftState, Surroundings};
use glam::DVec3;

/// Jaws that pass below this opening grasp.
pub(crate) const GRASP_BELOW: f64 = 0.2;
/// Jaws that pass above this opening let go.
pub(super) const RELEASE_ABOVE: f64 = 0.3;
/// The hold reaches its full stiffness in this time, seconds: the tube is not torn to the tip at once.
const RAMP_S: f64 = 0.15;
/// The share of its stiffness that a hold begins with: a spring must have some.
const RAMP_START: f64 = 1e-3;

/// Jaws and what they hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Jaws {
    held: Option<Held>,
    /// The jaws were open, so that closing them can catch something.
    armed: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Held {
    target: AgentId,
    anchor: Anchor,
    for_s: f64,
}

impl Jaws {
    /// Empty jaws, ready to catch.
    pub(super) fn new() -> Self {
        Self { held: None, armed: true }
    }

    /// Whether they hold something.
    pub(super) fn holds(&self) -> bool {
        self.held.is_some()
    }

    /// Opens and closes over a step of `dt` seconds: from opening `was` to `now`, the tip at `tip`.
    pub(super) fn move_to(
        &mut self,
        spec: &ToolSpec,
        (was, now): (f64, f64),
        tip: DVec3,
        seen: (&Surroundings<'_>, f64),
    ) {
        let (around, dt) = seen;
        if now > RELEASE_ABOVE {
            *self = Self::new();
        }
        if let Some(held) = &mut self.held {
            held.for_s += dt;
        } else if now < GRASP_BELOW && self.armed {
            self.held = nearest(spec, tip, around).map(|(target, anchor, _)| Held { target, anchor, for_s: 0.0 });
            // jaws that have come to a stop catch nothing any more
            self.armed = self.held.is_none() && now < was;
        }
    }

    /// The hold as others see it.
    pub(super) fn grasp(&self, spec: &ToolSpec) -> Option<Grasp> {
        let held = self.held?;
        let u = (held.for_s / RAMP_S).min(1.0);
        let share = (u * u * (3.0 - 2.0 * u)).max(RAMP_START);
        Some(Grasp {
            target: held.target,
            anchor: held.anchor,
            stiffness_n_m: share * spec.stiffness_n_m,
            damping_n_s_m: share * spec.damping_n_s_m,
        })
    }
}

/// The nearest point within reach of what may be grasped: whose, which, and the gap to its skin.
pub(super) fn nearest(spec: &ToolSpec, tip: DVec3, around: &Surroundings<'_>) -> Option<(AgentId, Anchor, f64)> {
    let soft = around.neighbours.iter().filter(|other| spec.graspable.contains(&other.id)).filter_map(|other| {
        let (anchor, gap_m) = match &other.snapshot.body {
            Body::Curve(curve) => nearest_on(curve, tip).map(|(arc_m, gap_m)| (Anchor::Arc(arc_m), gap_m))?,
            Body::Soft(soft) => nearest_vertex(soft, tip)?,
            _ => return None,
        };
        Some((other.id, anchor, gap_m))
    });
    soft.filter(|(_, _, gap_m)| *gap_m <= spec.reach_m).min_by(|a, b| a.2.total_cmp(&b.2))
}

/// The nearest vertex of a soft body, and how far it is.
fn nearest_vertex(soft: &SoftState, tip: DVec3) -> Option<(Anchor, f64)> {
    let apart = (0..).zip(&soft.positions).map(|(vertex, at)| (Anchor::Vertex(vertex), at.distance(tip)));
    apart.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The point of a curve whose skin is nearest: rest arc length, and the gap (negative inside).
fn nearest_on(curve: &CurveState, tip: DVec3) -> Option<(f64, f64)> {
    let mut best: Option<(f64, f64)> = None;
    for i in 1..curve.positions.len() {
        let (a, b) = (curve.positions[i - 1], curve.positions[i]);
        let along = b - a;
        let length_squared = along.length_squared();
        let u = if length_squared > 0.0 { ((tip - a).dot(along) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
        let mix = |from: f64, to: f64| from + (to - from) * u;
        let gap = tip.distance(a + along * u) - mix(curve.radii_m[i - 1], curve.radii_m[i]);
        if best.is_none_or(|(_, least)| gap < least) {
            best = Some((mix(curve.arc_m[i - 1], curve.arc_m[i]), gap));
        }
    }
    best
}
