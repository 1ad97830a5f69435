//! The scenes of `bench contact` of rigid bodies alone.
//!
//! In: sizes, a coefficient of restitution. Out: stages. Never here: soft bodies, measurements.

use super::super::rig::plain_world::rigid_specs;
use super::stage::{Body, Stage, block, drawn, rigid, walls};
use anyhow::Context;
use glam::{DQuat, DVec3};
use metachron_contact::joint::{Joint, JointKind};
use metachron_core::AgentId;
use metachron_geometry::Solid;
use metachron_models::rigid::RigidSpec;
use metachron_scene::{Source, load};

/// The step of scenes that say nothing else, seconds.
pub(super) const STEP_S: f64 = 1.0 / 60.0;

/// Twenty boxes on each other, each aside by up to `off_m`.
pub(super) fn tower(off_m: f64) -> Stage {
    let half = DVec3::new(0.04, 0.04, 0.02);
    let boxes = (0..20).map(|at| {
        let middle = DVec3::new(drawn(at, 0), drawn(at, 1), 0.0) * off_m + DVec3::Z * (0.02 + 0.04 * at as f64);
        match block(middle, half, 0.2, 0.0) {
            Body::Rigid(spec) => Body::Rigid(RigidSpec { friction: 0.8, ..spec }),
            other => other,
        }
    });
    Stage::on_floor(boxes.collect(), 2e-3, 0.8)
}

/// Two rods on hinges, let go from level.
pub(super) fn pendulum() -> Stage {
    let shape = Solid::Capsule { radius_m: 0.02, half_height_m: 0.2 };
    let rotation = DQuat::from_rotation_arc(DVec3::Z, DVec3::X);
    let rods = [0.25, 0.75].map(|x| Body::Rigid(RigidSpec { rotation, ..rigid(shape.clone(), DVec3::X * x, 1.0) }));
    let hinge = |a: u32, b: Option<u32>| Joint {
        anchor_a_m: DVec3::NEG_Z * 0.25,
        anchor_b_m: if b.is_some() { DVec3::Z * 0.25 } else { DVec3::ZERO },
        rest: if b.is_some() { DQuat::IDENTITY } else { rotation.inverse() },
        ..Joint::new(AgentId(a), b.map(AgentId), hinge_about(DVec3::Y))
    };
    Stage::apart(rods.into(), 2e-3).jointed(vec![hinge(0, None), hinge(1, Some(0))])
}

fn hinge_about(axis: DVec3) -> JointKind {
    JointKind::Revolute { axis, range_rad: None, motor: None }
}

/// The scene `pile`.
pub(super) fn pile() -> anyhow::Result<Stage> {
    let scene = load(&Source::open("pile")?, &[])?;
    let bodies = rigid_specs(&scene)?.into_iter().cloned().map(Body::Rigid).collect();
    let mut obstacles = scene.obstacles.to_vec();
    obstacles.iter_mut().for_each(|solid| solid.restitution = 0.0);
    Ok(Stage { obstacles, ..Stage::apart(bodies, STEP_S) })
}

/// A bin of `n`³ boxes of unlike sizes (1 : 27 in mass), turned at random, poured.
pub(super) fn mess(n: usize) -> Stage {
    let boxes = (0..n * n * n).map(|k| {
        let [x, y, z] = cell(k, n);
        let middle = DVec3::new(x, y, 0.0) * 0.06 + DVec3::Z * (0.05 + 0.06 * z);
        let half_m = 0.017 + 0.0085 * drawn(k, 0);
        let solid = Solid::Box { half_extents_m: DVec3::splat(half_m) };
        let turn = DVec3::new(drawn(k, 1), drawn(k, 2), drawn(k, 3)) * 2.0;
        let spec = rigid(solid, middle, 700.0 * (2.0 * half_m).powi(3));
        Body::Rigid(RigidSpec { rotation: DQuat::from_scaled_axis(turn), friction: 0.5, ..spec })
    });
    let mut stage = Stage::on_floor(boxes.collect(), STEP_S, 0.6);
    stage.obstacles.extend(walls(0.03 * n as f64 + 0.005, 0.024, 0.05 * n as f64));
    stage
}

/// The place of a number in a cube of `n`³: sideways from the middle, upward from the ground.
fn cell(number: usize, n: usize) -> [f64; 3] {
    let middle = 0.5 * (n - 1) as f64;
    [(number % n) as f64 - middle, (number / n % n) as f64 - middle, (number / n / n) as f64]
}

/// Layers of boxes, each box on four of the layer below.
pub(super) fn bricks(wide: usize, layers: usize) -> Stage {
    let boxes = (0..wide * wide * layers).map(|k| {
        let [x, y, layer] = [k % wide, k / wide % wide, k / wide / wide].map(|v| v as f64);
        let shift = 0.03 * (layer % 2.0);
        let middle = DVec3::new(0.065 * x + shift, 0.065 * y + shift, 0.0302 + 0.0604 * layer);
        block(middle, DVec3::splat(0.03), 0.5, 0.05 * libm::sin(12.9898 * (k + 1) as f64))
    });
    Stage::on_floor(boxes.collect(), STEP_S, 0.5)
}

/// Ten boxes of 50 g under one of `ratio` times their mass.
pub(super) fn stack(ratio: f64) -> Stage {
    let half = DVec3::splat(0.03);
    let below = (0..10).map(|i| {
        let middle = DVec3::new(0.001 * f64::from(i % 3), 0.0, 0.03 + 0.0602 * f64::from(i));
        block(middle, half, 0.05, 0.3 * f64::from(i))
    });
    let top = block(DVec3::Z * (0.03 + 0.602), half, 0.05 * ratio, 0.1);
    Stage::on_floor(below.chain([top]).collect(), STEP_S, 0.5)
}

/// Twenty links of which the last has `ratio` times the mass of the others.
pub(super) fn chain(ratio: f64) -> Stage {
    let along = DVec3::new(1.0, 0.0, -1.0).normalize();
    let rotation = DQuat::from_rotation_arc(DVec3::NEG_Z, along);
    let shape = Solid::Capsule { radius_m: 0.03, half_height_m: 0.06 };
    let links = (0..20).map(|i| {
        let spec = rigid(shape.clone(), along * (0.1 + 0.2 * f64::from(i)), if i == 19 { ratio } else { 1.0 });
        Body::Rigid(RigidSpec { rotation, ..spec })
    });
    let joints = (0..20).map(|i: u32| {
        let other = (i > 0).then(|| AgentId(i - 1));
        let anchor_b_m = if i > 0 { DVec3::NEG_Z * 0.1 } else { DVec3::ZERO };
        Joint { anchor_a_m: DVec3::Z * 0.1, anchor_b_m, ..Joint::new(AgentId(i), other, JointKind::Spherical) }
    });
    Stage::apart(links.collect(), STEP_S).jointed(joints.collect())
}

/// Five capsules that start inside each other, on hinges.
pub(super) fn overlap() -> anyhow::Result<Stage> {
    let shape = Solid::Capsule { radius_m: 0.05, half_height_m: 0.03 };
    let places = [-0.0038, -0.0121, -0.0164, 0.0032, -0.0081];
    let middle = |i: usize| places.get(i).map(|x| DVec3::new(*x, 0.0, 2.0 - 0.06 * i as f64)).context("a capsule");
    let mut bodies = Vec::new();
    let mut joints = Vec::new();
    for i in 0..places.len() {
        let here = middle(i)?;
        bodies.push(Body::Rigid(rigid(shape.clone(), here, 2.0 * 0.6_f64.powi(i as i32))));
        let (other, axis, anchor_b_m) = match i {
            0 => (None, DVec3::Z, here),
            _ => (Some(AgentId(i as u32 - 1)), if i % 2 == 1 { DVec3::Y } else { DVec3::X }, here - middle(i - 1)?),
        };
        joints.push(Joint { anchor_b_m, ..Joint::new(AgentId(i as u32), other, hinge_about(axis)) });
    }
    Ok(Stage::apart(bodies, 1.0 / 240.0).jointed(joints))
}
