//! What does a heavy end do to a stack and to a chain? Prints how far a stack sinks and leans, and how far a chain stretches.
//!
//! `cargo run --release -p metachron-agents --example heavy_on_light`
//!
//! Stacks: cubes of 1 m and 1000 kg, a millimetre apart at the start, friction 0.5, 10 s. Chains: capsules of 0.2 m and 1 kg
//! on ball joints, 5 s. The last body is heavier by the ratio.

mod bodies;

use bodies::{built, floor, spec, step};
use glam::{DQuat, DVec3};
use metachron_contact::Agent;
use metachron_core::{AgentId, Body, RigidState, SimSpan, Snapshot};
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rigid::RigidBody;
use metachron_models::rigid::RigidSpec;
use metachron_models::rigid::{Joint, JointKind};
use std::sync::Arc;

fn stack(count: u32, ratio: f64) -> Vec<RigidSpec> {
    let obstacles: Arc<[Obstacle]> = Arc::from([floor()]);
    let cube = Solid::Box { half_extents_m: DVec3::splat(0.5) };
    let mass = |i: u32| if i + 1 == count { 1000.0 * ratio } else { 1000.0 };
    let at = |i: u32| DVec3::Z * (0.5 + 1.001 * f64::from(i));
    (0..count).map(|i| RigidSpec { obstacles: obstacles.clone(), ..spec(cube.clone(), at(i), mass(i)) }).collect()
}

fn chain(ratio: f64, along: DVec3) -> Vec<RigidSpec> {
    let link = Solid::Capsule { radius_m: 0.03, half_height_m: 0.06 };
    let joints: Arc<[Joint]> = (0..20_u32)
        .map(|i| Joint {
            anchor_a_m: DVec3::Z * 0.1,
            anchor_b_m: if i == 0 { DVec3::ZERO } else { DVec3::Z * -0.1 },
            ..Joint::new(AgentId(i), i.checked_sub(1).map(AgentId), JointKind::Spherical)
        })
        .collect();
    let rotation = DQuat::from_rotation_arc(DVec3::NEG_Z, along);
    let at = |i: u32| along * (0.1 + 0.2 * f64::from(i));
    let mass = |i: u32| if i == 19 { ratio } else { 1.0 };
    (0..20).map(|i| RigidSpec { rotation, joints: joints.clone(), ..spec(link.clone(), at(i), mass(i)) }).collect()
}

fn state(body: &RigidBody) -> RigidState {
    let mut snapshot = Snapshot::default();
    body.write_snapshot(&mut snapshot);
    match snapshot.body {
        Body::Rigid(state) => state,
        _ => RigidState::default(),
    }
}

/// The widest gap between the links' ends, metres.
fn stretch(bodies: &[RigidBody]) -> f64 {
    let (mut widest, mut end) = (0.0_f64, DVec3::ZERO);
    for body in bodies.iter().map(state) {
        widest = widest.max((body.position + body.rotation * DVec3::Z * 0.1).distance(end));
        end = body.position - body.rotation * DVec3::Z * 0.1;
    }
    widest
}

/// Steps all bodies as one world; `watch` sees them after every step. Microseconds and parts a step.
fn run(bodies: &mut [RigidBody], dt: f64, seconds: f64, mut watch: impl FnMut(&[RigidBody])) -> (f64, f64) {
    let span = SimSpan::from_secs_f64(dt).expect("dt is a span");
    let steps = (seconds / dt).round() as u32;
    let (mut spent, mut parts, mut apart) = (0.0, 0, Vec::new());
    for _ in 0..steps {
        let (report, took_s) = step(bodies, span, &mut apart);
        spent += took_s;
        parts += report.substeps;
        watch(bodies);
    }
    (spent / f64::from(steps) * 1e6, f64::from(parts) / f64::from(steps))
}

fn main() {
    println!("test,ratio,inv_dt,sink_m,lateral_m,stretch_max_m,us_per_step,parts_per_step");
    for inv_dt in [60.0, 240.0] {
        for ratio in [1.0, 100.0, 1000.0] {
            for count in [2, 10, 24, 40, 100] {
                let mut bodies = built(stack(count, ratio));
                let (us, parts) = run(&mut bodies, 1.0 / inv_dt, 10.0, |_| {});
                let top = state(&bodies[count as usize - 1]).position;
                let aside = bodies.iter().map(|b| state(b).position.truncate().length()).fold(0.0, f64::max);
                let sink = f64::from(count) - 0.5 - top.z;
                println!("stack{count},{ratio},{inv_dt},{sink:.2e},{aside:.2e},,{us:.1},{parts:.1}");
            }
            for (name, along) in [("hang", DVec3::NEG_Z), ("swing", DVec3::X)] {
                let mut bodies = built(chain(ratio, along));
                let mut worst = 0.0_f64;
                let (us, parts) = run(&mut bodies, 1.0 / inv_dt, 5.0, |bodies| worst = worst.max(stretch(bodies)));
                println!("chain20 {name},{ratio},{inv_dt},,,{worst:.2e},{us:.1},{parts:.1}");
            }
        }
    }
}
