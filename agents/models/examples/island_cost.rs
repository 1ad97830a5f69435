//! What does an island add to the rapier3d world it is made of? Prints the time of both for the same pile, and their ratio.
//!
//! `cargo run --release -p metachron-agents --example island_cost [SIDE]`, a cube of SIDE³ boxes (10: 1000).
//!
//! Both worlds have the same boxes and the same solver settings and are stepped in turn, so that a busy machine slows both.

mod bodies;

use bodies::{built, floor, spec, step};
use glam::DVec3;
use metachron_core::SimSpan;
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rigid::RigidBody;
use metachron_models::rigid::RigidSpec;
use rapier3d::prelude::*;
use std::sync::Arc;
use std::time::Instant;

const HALF: f64 = 0.1;
const DT: f64 = 1.0 / 240.0;
const STEPS: u32 = 480;

fn place(side: u32, i: u32) -> DVec3 {
    let at = |n: u32| f64::from(n) * 2.02 * HALF;
    DVec3::new(at(i % side), at(i / side % side), at(i / side / side) + 1.01 * HALF)
}

fn boxes(side: u32) -> Vec<RigidBody> {
    let obstacles: Arc<[Obstacle]> = Arc::from([floor()]);
    let solid = Solid::Box { half_extents_m: DVec3::splat(HALF) };
    built(
        (0..side.pow(3))
            .map(|i| RigidSpec { obstacles: obstacles.clone(), ..spec(solid.clone(), place(side, i), 1.0) }),
    )
}

fn plain(side: u32) -> PhysicsWorld {
    let mut world = PhysicsWorld { gravity: Vector::new(0.0, 0.0, -9.81), ..PhysicsWorld::default() };
    let softness = SpringCoefficients::new(300.0, 10.0);
    world.integration_parameters = IntegrationParameters {
        dt: DT as f32,
        length_unit: (2.0 * HALF * 3.0_f64.sqrt()) as f32,
        num_solver_iterations: 4,
        num_internal_stabilization_iterations: 2,
        contact_softness: softness,
        static_contact_softness: softness,
        normalized_max_linear_velocity: f32::MAX,
        ..IntegrationParameters::default()
    };
    let floor = Solid::Plane.to_shared_shape().expect("a plane is a shape");
    world.colliders.insert(ColliderBuilder::new(floor).friction(0.5));
    for i in 0..side.pow(3) {
        let body = RigidBodyBuilder::dynamic()
            .translation(place(side, i).as_vec3())
            .can_sleep(false)
            .allow_fast_rotation(true)
            .gyroscopic_forces_enabled(true);
        let half = HALF as f32;
        world.insert(body, ColliderBuilder::cuboid(half, half, half).mass(1.0).friction(0.5));
    }
    world
}

fn main() {
    let side = std::env::args().nth(1).and_then(|side| side.parse().ok()).unwrap_or(10);
    let (mut bodies, mut world) = (boxes(side), plain(side));
    let span = SimSpan::from_secs_f64(DT).expect("dt is a span");
    let (mut ours, mut theirs, mut apart) = (Vec::new(), Vec::new(), Vec::new());
    for number in 0..STEPS {
        let (_, island_s) = step(&mut bodies, span, &mut apart);
        let start = Instant::now();
        world.step();
        let plain_s = start.elapsed().as_secs_f64();
        // the first steps build both worlds
        if number >= STEPS / 8 {
            ours.push(island_s * 1e6);
            theirs.push(plain_s * 1e6);
        }
    }
    println!("boxes,share_of_steps,island_us_per_step,rapier_us_per_step,ratio");
    for share in [0.1, 0.25, 0.5] {
        let (ours, theirs) = (quantile(&mut ours, share), quantile(&mut theirs, share));
        println!("{},{share},{ours:.0},{theirs:.0},{:.3}", side.pow(3), ours / theirs);
    }
}

/// The time that this share of the steps does not exceed: the lower ones are those that nothing else interrupted.
fn quantile(times: &mut [f64], share: f64) -> f64 {
    times.sort_by(f64::total_cmp);
    times[((times.len() - 1) as f64 * share) as usize]
}
