//! A still life for pictures: a folded tube in a tray, three rigid bodies, two tools. No physics runs.

use glam::{DQuat, DVec3};
use metachron_core::{AgentId, Anchor, Body, CurveState, Grasp, Resolution, RigidState, SimTime, Snapshot, ToolState};
use metachron_geometry::{Obstacle, Solid, ToolShape};
use metachron_render::{Actor, Appearance, Camera, Form, Level, Material, SceneView, States, StaticObject};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Number of the tube among the actors.
pub const TUBE: u32 = 0;

/// A stage with everything posed at time zero, and a camera that shows it.
pub fn still_life() -> (SceneView, Camera) {
    let appearance = |colour, material| Appearance { colour, material };
    let solid = |id, solid, appearance| Actor { id: AgentId(id), form: Form::Solid(solid), appearance };
    let tool = |id| Actor {
        id: AgentId(id),
        form: Form::Tool(ToolShape { shaft_radius_m: 0.004, shaft_length_m: 0.35 }),
        appearance: appearance([205, 208, 214], Material::Metal),
    };
    let actors = vec![
        Actor { id: AgentId(TUBE), form: Form::Tube, appearance: appearance([216, 122, 110], Material::Tissue) },
        solid(1, Solid::Ball { radius_m: 0.028 }, appearance([226, 214, 190], Material::Plastic)),
        solid(
            2,
            Solid::Box { half_extents_m: DVec3::new(0.03, 0.022, 0.02) },
            appearance([78, 122, 140], Material::Plastic),
        ),
        solid(3, Solid::Capsule { radius_m: 0.014, half_height_m: 0.03 }, appearance([200, 202, 208], Material::Metal)),
        tool(4),
        tool(5),
    ];
    let mut stage = SceneView::new(actors, tray());
    let rigid = |position, rotation| Body::Rigid(RigidState { position, rotation, ..RigidState::default() });
    let held = folded_tube(150);
    let grip_arc_m = 0.47 * held.arc_m[150];
    let (point, _) = held.point_at(grip_arc_m).expect("the tube has nodes");
    let grasp = Grasp {
        target: AgentId(TUBE),
        anchor: Anchor::Arc(grip_arc_m),
        orientation: None,
        stiffness_n_m: 200.0,
        damping_n_s_m: 1.0,
    };
    let tool = |tip: DVec3, from: DVec3, jaw, grasp| {
        let rotation = DQuat::from_rotation_arc(DVec3::Z, (tip - from).normalize());
        Body::Tool(ToolState {
            tip,
            led: tip,
            rotation,
            velocity: DVec3::ZERO,
            spin: DVec3::ZERO,
            jaw,
            grasp,
            admits: None,
            force_n: 0.6,
            is_idle: false,
        })
    };
    let bodies = [
        Body::Curve(held),
        rigid(DVec3::new(0.25, -0.115, 0.028), DQuat::IDENTITY),
        rigid(DVec3::new(0.27, 0.02, 0.02), DQuat::from_rotation_z(0.5)),
        rigid(DVec3::new(0.25, 0.13, 0.014), DQuat::from_rotation_x(PI / 2.0) * DQuat::from_rotation_y(0.6)),
        tool(point + DVec3::new(0.0, 0.0, 0.012), DVec3::new(-0.2, 0.45, 0.5), 0.25, Some(grasp)),
        tool(DVec3::new(0.10, -0.09, 0.09), DVec3::new(0.42, -0.34, 0.42), 0.9, None),
    ];
    for (id, body) in (0..).zip(bodies) {
        stage.set_snapshot(AgentId(id), &Arc::new(Snapshot { body, ..Snapshot::default() }), true);
    }
    stage.pose(SimTime::ZERO, States::Latest);
    let camera = Camera::looking(DVec3::new(0.12, -0.62, 0.52), DVec3::new(0.03, 0.0, 0.02), 0.72);
    (stage, camera)
}

/// The tray the tube lies in: a bottom and four walls, and the floor below.
fn tray() -> Vec<StaticObject> {
    let steel = Appearance { colour: [74, 88, 94], material: Material::Skin };
    let (x, y, wall, high) = (0.36, 0.22, 0.008, 0.03);
    let side = |position, half_extents_m| StaticObject {
        obstacle: Obstacle { position, ..Obstacle::new("tray", Solid::Box { half_extents_m }) },
        appearance: steel,
        throws_shadow: true,
    };
    let floor = StaticObject {
        obstacle: Obstacle { solid: Solid::Plane, ..side(DVec3::new(0.0, 0.0, -0.016), DVec3::ONE).obstacle },
        appearance: Appearance { colour: [30, 58, 66], material: Material::Skin },
        throws_shadow: true,
    };
    vec![
        floor,
        side(DVec3::new(0.0, 0.0, -0.008), DVec3::new(x, y, 0.008)),
        side(DVec3::new(-x, 0.0, high - 0.016), DVec3::new(wall, y + wall, high)),
        side(DVec3::new(x, 0.0, high - 0.016), DVec3::new(wall, y + wall, high)),
        side(DVec3::new(0.0, -y, high - 0.016), DVec3::new(x - wall, wall, high)),
        side(DVec3::new(0.0, y, high - 0.016), DVec3::new(x - wall, wall, high)),
    ]
}

/// About 1.7 m of tube in folds, with a wave of its radius and a hump where a tool holds it; `n` segments.
pub fn folded_tube(n: usize) -> CurveState {
    let place = |t: f64| {
        let sway = (TAU * 4.0 * t).sin();
        let x = -0.29 + 0.46 * t + 0.014 * (TAU * 8.0 * t).sin();
        let hump = (-((t - 0.47) / 0.035).powi(2)).exp();
        let z = 0.021 + 0.012 * (1.0 + (TAU * 5.3 * t).sin()) + 0.07 * hump;
        DVec3::new(x, 0.16 * sway * (1.0 - 0.25 * (TAU * 1.5 * t).cos()), z)
    };
    // nodes at equal lengths along a dense polygon
    let dense: Vec<DVec3> = (0..=4000).map(|i| place(f64::from(i) / 4000.0)).collect();
    let mut along = vec![0.0];
    for pair in dense.windows(2) {
        along.push(along[along.len() - 1] + pair[0].distance(pair[1]));
    }
    let length = along[4000];
    let arc_m: Vec<f64> = (0..=n).map(|i| length * i as f64 / n as f64).collect();
    let at = |s: f64| {
        let right = along.partition_point(|&a| a < s).clamp(1, 4000);
        let w = (s - along[right - 1]) / (along[right] - along[right - 1]);
        dense[right - 1].lerp(dense[right], w)
    };
    let positions: Vec<DVec3> = arc_m.iter().map(|&s| at(s)).collect();
    let chord = |i: usize| (positions[i + 1] - positions[i]).normalize();
    CurveState {
        velocities: vec![DVec3::ZERO; n + 1],
        frames: (0..n).map(|i| DQuat::from_rotation_arc(DVec3::Z, chord(i))).collect(),
        radii_m: arc_m.iter().map(|s| 0.0195 * (1.0 - 0.13 * (TAU * s / 0.11).cos())).collect(),
        flattening_m: vec![],
        arc_m,
        positions,
    }
}

/// One level for all actors.
pub fn level(eps_m: f64, n: u8) -> Vec<Level> {
    vec![Resolution { eps_m, n }.into(); 6]
}
