//! Grasping: the nearest point of a tube, soft or rigid body within reach, held by a spring whose stiffness ramps up smoothly.
//!
//! In: an opening, the pose of the jaws, neighbouring snapshots. Out: a [`Grasp`]. Never here: the path of the tip.
//!
//! A deformable is held at a point: it turns about it as its own stiffness allows. A rigid body is kept from turning as well: jaws
//! are plates and not a point, and press on it over their whole reach.

use super::ToolSpec;
use glam::{DQuat, DVec3};
use metachron_contact::{Neighbour, StepContext};
use metachron_core::{
    AgentId, Anchor, Body, CurveState, GRASP_BELOW, Grasp, GraspOrientation, RigidState, SoftState, ToolState,
};
use metachron_geometry::{ShapeKind, SolidShape};

/// Jaws that open past this opening release.
pub(super) const RELEASE_ABOVE: f64 = 0.3;
/// Time in which the grasp reaches its full stiffness, seconds: otherwise the tube would be pulled abruptly to the tip.
const RAMP_S: f64 = 0.15;
/// The share of its stiffness with which a grasp begins: a spring must have some.
const RAMP_START: f64 = 1e-3;

/// Jaws and the grasped body.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Jaws {
    held: Option<ActiveGrasp>,
    /// The jaws were open, so that closing them can catch something.
    armed: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
struct ActiveGrasp {
    target: AgentId,
    anchor: Anchor,
    /// Rotation from a rigid body's axes to the tool's, when it was grasped.
    rotation: Option<DQuat>,
    held_s: f64,
}

/// The nearest graspable point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GraspCandidate {
    pub(super) target: AgentId,
    anchor: Anchor,
    /// From the tip to its skin, metres; a tube's is below zero inside.
    pub gap_m: f64,
    /// Rotation of a rigid body.
    rotation: Option<DQuat>,
}

impl Jaws {
    /// Empty jaws, ready to grasp.
    pub(super) fn new() -> Self {
        Self { held: None, armed: true }
    }

    /// Whether they hold a body.
    pub(super) fn holds(&self) -> bool {
        self.held.is_some()
    }

    /// Lets `dt` seconds pass for a grasp that lasts.
    pub(super) fn age(&mut self, dt: f64) {
        if let Some(held) = &mut self.held {
            held.held_s += dt;
        }
    }

    /// Opens or closes from the opening `was` to that of `tool`, the tool as it is now: grasps and releases.
    pub(super) fn move_to(&mut self, spec: &ToolSpec, was: f64, tool: &ToolState, context: &StepContext<'_>) {
        let ToolState { tip, rotation, jaw: now, .. } = *tool;
        if now > RELEASE_ABOVE {
            *self = Self::new();
        }
        if self.held.is_none() && now < GRASP_BELOW && self.armed {
            self.held = nearest(spec, tip, context).map(|GraspCandidate { target, anchor, rotation: body, .. }| {
                let rotation = body.map(|body| (rotation.conjugate() * body).normalize());
                ActiveGrasp { target, anchor, rotation, held_s: 0.0 }
            });
            // jaws that have come to a stop grasp nothing any more
            self.armed = self.held.is_none() && now < was;
        }
    }

    /// The grasp as published.
    pub(super) fn grasp(&self, spec: &ToolSpec) -> Option<Grasp> {
        let held = self.held?;
        let u = (held.held_s / RAMP_S).min(1.0);
        let share = (u * u * (3.0 - 2.0 * u)).max(RAMP_START);
        Some(Grasp {
            target: held.target,
            anchor: held.anchor,
            orientation: held.rotation.map(|rotation| GraspOrientation { rotation, arm_m: spec.reach_m }),
            stiffness_n_m: share * spec.stiffness_n_m,
            damping_n_s_m: share * spec.damping_n_s_m,
        })
    }
}

/// The nearest graspable point within reach.
pub(super) fn nearest(spec: &ToolSpec, tip: DVec3, context: &StepContext<'_>) -> Option<GraspCandidate> {
    nearest_of(spec, tip, context, spec.reach_m)
}

/// The nearest point within `reach_m` on graspable agents.
pub(super) fn nearest_of(
    spec: &ToolSpec,
    tip: DVec3,
    context: &StepContext<'_>,
    reach_m: f64,
) -> Option<GraspCandidate> {
    let graspable = context.neighbours.iter().filter(|other| spec.graspable.contains(&other.id));
    let near = graspable.filter_map(|other| point_of(other, tip)).filter(|near| near.gap_m <= reach_m);
    near.min_by(|a, b| a.gap_m.total_cmp(&b.gap_m))
}

/// The nearest point of an agent, if it can be held.
fn point_of(other: &Neighbour, tip: DVec3) -> Option<GraspCandidate> {
    let ((anchor, gap_m), rotation) = match &other.snapshot.body {
        Body::Curve(curve) => (nearest_on(curve, tip).map(|(arc_m, gap_m)| (Anchor::Arc(arc_m), gap_m))?, None),
        Body::Soft(soft) => (nearest_vertex(soft, tip)?, None),
        Body::Rigid(state) => {
            let ShapeKind::Solid(form) = &other.form.as_ref()?.kind else { return None };
            (nearest_in(form, state, tip)?, Some(state.rotation))
        }
        Body::Tool(_) | Body::Nothing => return None,
    };
    Some(GraspCandidate { target: other.id, anchor, gap_m, rotation })
}

/// The nearest point of a solid, and its distance: zero inside.
fn nearest_in(form: &SolidShape, state: &RigidState, tip: DVec3) -> Option<(Anchor, f64)> {
    let local = state.rotation.conjugate() * (tip - state.position);
    let place = (local + form.com_local).as_vec3();
    if !place.is_finite() {
        return None;
    }
    let found = form.shape.project_local_point(place, true);
    if found.is_inside {
        return Some((Anchor::Local(local), 0.0));
    }
    let point = found.point.as_dvec3() - form.com_local;
    Some((Anchor::Local(point), point.distance(local)))
}

/// The nearest vertex of a soft body, and its distance.
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
