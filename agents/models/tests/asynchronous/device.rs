//! A haptic tip of 1 kHz, driven by the local model alone that a slow soft body on the floor publishes.

use super::clocks::{Clocks, GRAVITY, Tamper};
use glam::{DQuat, DVec3};
use metachron_contact::{Agent, AnchorSpring, Law};
use metachron_core::{Anchor, Snapshot};
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::soft::{SoftBody, SoftMatter, SoftShape, SoftSpec};
use std::sync::Arc;

/// The column: its edges, metres.
const SIZE_M: DVec3 = DVec3::new(0.06, 0.06, 0.06);
const TIP_KG: f64 = 0.05;
const TIP_M: f64 = 0.01;
const SPRING_N_M: f64 = 2000.0;
const PRESS_M: f64 = 0.005;

fn floor() -> Obstacle {
    let (name, solid, position, rotation) = ("floor".into(), Solid::Plane, DVec3::ZERO, DQuat::IDENTITY);
    Obstacle { name, solid, position, rotation, friction: 0.5, restitution: 0.0 }
}

/// Least, mean and most force of the tip on the column in the last half second, N.
fn press(young_pa: f64, rate_hz: f64, due: bool, tamper: Option<Tamper>) -> [f64; 3] {
    let mut clocks = Clocks::new(Law::Ledger, &[floor()]);
    (clocks.due, clocks.tamper) = (due, tamper);
    let column = clocks.add(column(young_pa), rate_hz);
    let tip = Solid::Box { half_extents_m: DVec3::new(0.035, 0.035, TIP_M) };
    let spec = RigidSpec::free(tip, DVec3::Z * (SIZE_M.z + TIP_M + 0.002), TIP_KG);
    let tip = clocks.add(RigidBody::new(RigidSpec { gravity: DVec3::ZERO, ..spec }).unwrap(), 1000.0);
    let top = SIZE_M.z + TIP_M;
    let mut forces = vec![];
    while clocks.all[tip].time.as_secs_f64() < 1.5 {
        let at_s = clocks.all[tip].time.as_secs_f64();
        let target = DVec3::Z * (top - PRESS_M * (at_s / 0.2).min(1.0));
        clocks.all[tip].hands = vec![AnchorSpring {
            by: None,
            anchor: Anchor::Local(DVec3::ZERO),
            target,
            target_velocity: DVec3::ZERO,
            stiffness_n_m: SPRING_N_M,
            damping_n_s_m: 2.0 * (SPRING_N_M * TIP_KG).sqrt(),
        }];
        if clocks.step() == tip && at_s > 1.0 {
            let pair = clocks.all[tip].own.pairs.iter().find(|pair| pair.contacts > 0);
            forces.push(pair.map_or(0.0, |pair| pair.force_n));
        }
        if !clocks.rigid(tip).position.is_finite() || clocks.rigid(tip).position.length() > 1.0 {
            return [0.0, f64::INFINITY, f64::INFINITY];
        }
    }
    let _ = column;
    let mean = forces.iter().sum::<f64>() / forces.len() as f64;
    [forces.iter().copied().fold(f64::INFINITY, f64::min), mean, forces.iter().copied().fold(0.0, f64::max)]
}

fn column(young_pa: f64) -> SoftBody {
    let spec = SoftSpec {
        shape: SoftShape::Box { size_m: SIZE_M, segments: [2, 2, 4] },
        matter: SoftMatter { young_pa, poisson: 0.3, density_kg_m3: 1000.0, damping_per_s: 0.2 },
        position: DVec3::new(-0.5 * SIZE_M.x, -0.5 * SIZE_M.y, 0.0),
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        held: vec![],
        friction: 0.5,
        gravity: GRAVITY,
        obstacles: Arc::new([]),
        sleep: false,
    };
    SoftBody::new(spec).unwrap()
}

/// Publishes the member's own W instead of that of its cluster with the floor held.
fn own(agent: &mut dyn Agent, shown: &mut Snapshot) {
    let Some(member) = agent.member() else { return };
    let (Some(response), size) = (member.response(), member.free().len()) else { return };
    let model = &mut shown.local_model;
    let count = model.blocks.len();
    for column in 0..count {
        for axis in 0..3 {
            let mut x = vec![DVec3::ZERO; size];
            x[model.blocks[column].slot as usize] = DVec3::AXES[axis]; // no vertex is held: slots are blocks
            response.respond(&mut x);
            for row in 0..count {
                *model.compliance[row * count + column].col_mut(axis) = x[model.blocks[row].slot as usize];
            }
        }
    }
}

#[test]
fn trial() {
    for due in [false, true] {
        for rate_hz in [60.0, 30.0] {
            for young_pa in [1e4, 1e5, 1e6] {
                let (held, free) = (press(young_pa, rate_hz, due, None), press(young_pa, rate_hz, due, Some(own)));
                println!("due {due} {rate_hz} Hz {young_pa:e} Pa: {held:.2?} own {free:.2?}");
            }
        }
    }
}

#[test]
fn trace() {
    let mut clocks = Clocks::new(Law::Ledger, &[floor()]);
    let body = clocks.add(column(1e5), 60.0);
    let tip = Solid::Box { half_extents_m: DVec3::new(0.035, 0.035, TIP_M) };
    let spec = RigidSpec::free(tip, DVec3::Z * (SIZE_M.z + TIP_M + 0.002), TIP_KG);
    let tip = clocks.add(RigidBody::new(RigidSpec { gravity: DVec3::ZERO, ..spec }).unwrap(), 1000.0);
    let top = SIZE_M.z + TIP_M;
    while clocks.all[tip].time.as_secs_f64() < 1.1 {
        let at_s = clocks.all[tip].time.as_secs_f64();
        let target = DVec3::Z * (top - PRESS_M * (at_s / 0.2).min(1.0));
        clocks.all[tip].hands = vec![AnchorSpring {
            by: None,
            anchor: Anchor::Local(DVec3::ZERO),
            target,
            target_velocity: DVec3::ZERO,
            stiffness_n_m: SPRING_N_M,
            damping_n_s_m: 2.0 * (SPRING_N_M * TIP_KG).sqrt(),
        }];
        let me = clocks.step();
        if at_s > 1.0 {
            if me == tip {
                let pair = clocks.all[tip].own.pairs.iter().find(|pair| pair.contacts > 0);
                let state = clocks.rigid(tip);
                println!("t {at_s:.4} f {:.3} n {} z {:.6} v {:.5} w {:.4}", pair.map_or(0.0, |p| p.force_n), pair.map_or(0, |p| p.contacts), state.position.z, state.velocity.z, state.spin.length());
            } else {
                let model = &clocks.all[body].own.local_model;
                println!("body {:.4} held {} blocks {} step {}", clocks.all[body].time.as_secs_f64(), model.held, model.blocks.len(), model.step_s);
                for (at, block) in model.blocks.iter().enumerate() {
                    let w = model.compliance[at * model.blocks.len() + at];
                    println!("  {} v {:.5} a {:.4} f {:.4} w {:.4}", block.slot, block.velocity.z, block.acceleration.z, model.partners[0].forces[at].z, w.z_axis.z);
                }
            }
        }
    }
}
