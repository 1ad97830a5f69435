//! The tubes of the cost measurements.
//!
//! In: segments. Out: tubes close to their rest shapes, alone in a cluster, and the tool that grasps them. Never here: time.

use super::super::bench::StepHarness;
use super::super::stability::common::{GRAVITY, plain_tube};
use glam::{DQuat, DVec3};
use metachron_contact::Neighbour;
use metachron_core::{AgentId, Anchor, Body, Grasp, Snapshot, ToolState};
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rod::{Tube, TubeSpec};
use std::sync::Arc;

/// Segments of one strand of a folded tube.
const STRAND_SEGMENTS: u32 = 14;
const STRAND_M: f64 = 0.2;
const RADIUS_M: f64 = 0.016;
/// Distance between the axes of adjacent strands: they fall by a few millimetres.
const PITCH_M: f64 = 0.034;
/// Number of layers of strands.
const LAYERS: u32 = 2;

/// A soft tube of a metre, clamped at its start, under gravity.
pub(super) fn straight(segments: u32, self_contact: bool) -> Option<Tube> {
    let path_m = vec![DVec3::ZERO, DVec3::X];
    let spec = TubeSpec {
        damping_per_s: 6.0,
        clamp: [true, false],
        self_contact,
        gravity: DVec3::NEG_Z * GRAVITY,
        ..plain_tube(path_m, 0.015, segments as usize)
    };
    Tube::new(spec).ok()
}

/// A very soft tube folded on the ground and on itself, in two layers of strands side by side.
pub(super) fn folded(segments: u32) -> Option<Tube> {
    let strands = segments.div_ceil(STRAND_SEGMENTS).max(2);
    let wide = strands.div_ceil(LAYERS);
    let mut path_m = vec![];
    for k in 0..strands {
        let (layer, column) = (k / wide, k % wide);
        // the second layer starts on the first where that ends
        let row = if layer.is_multiple_of(2) { column } else { wide - 1 - column };
        let at = |x: f64| DVec3::new(x, f64::from(row) * PITCH_M, 0.02 + f64::from(layer) * PITCH_M);
        let (near, far) = if k.is_multiple_of(2) { (0.0, STRAND_M) } else { (STRAND_M, 0.0) };
        path_m.extend([near, 0.5 * STRAND_M, far].map(at));
    }
    let plain = plain_tube(path_m, RADIUS_M, segments as usize);
    let mut spec =
        TubeSpec { self_contact: true, friction: 0.3, damping_per_s: 1.0, gravity: DVec3::NEG_Z * GRAVITY, ..plain };
    // 5e4 Pa in place of 1e6
    for stiffness in
        [&mut spec.section.ea_n, &mut spec.section.ga_n, &mut spec.section.ei_n_m2, &mut spec.section.gj_n_m2]
    {
        *stiffness *= 0.05;
    }
    Tube::new(spec).ok()
}

/// A tube on the ground, alone in a cluster, with steps of `dt_s` seconds.
pub(super) fn on_ground(tube: Tube, dt_s: f64) -> Option<StepHarness> {
    let ground = Obstacle { friction: 0.3, ..Obstacle::new("ground", Solid::Plane) };
    let mut stage = StepHarness::among(&[ground])?;
    stage.add(Box::new(tube), 1.0 / dt_s)?;
    Some(stage)
}

/// A tube in the air, alone in a cluster, with steps of `dt_s` seconds.
pub(super) fn hanging(tube: Tube, dt_s: f64) -> Option<StepHarness> {
    let mut stage = StepHarness::among(&[])?;
    stage.add(Box::new(tube), 1.0 / dt_s)?;
    Some(stage)
}

/// The tube of a stage.
pub(super) const TUBE: AgentId = AgentId(0);

/// Lets a tool grasp the middle of the tube, of this length, at its present place: a neighbour with one fixed state.
pub(super) fn grasp(stage: &mut StepHarness, length_m: f64) -> Option<()> {
    let anchor = Anchor::Arc(0.5 * length_m);
    let (tip, _) = stage.own(TUBE).body.point(anchor)?;
    let pose = ToolState {
        tip,
        led: tip,
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        spin: DVec3::ZERO,
        jaw: 0.0,
        grasp: Some(Grasp { target: TUBE, anchor, orientation: None, stiffness_n_m: 100.0, damping_n_s_m: 0.5 }),
        admits: None,
        force_n: 0.0,
        is_idle: false,
    };
    let tool = Arc::new(Snapshot { body: Body::Tool(pose), ..Snapshot::default() });
    stage.member(TUBE).neighbours = vec![Neighbour::observed(AgentId(1), tool)];
    Some(())
}
