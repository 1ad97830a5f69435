//! Rigid bodies for examples: plain ones, the floor, and a step of all as one world.
//!
//! In: shapes, places, masses. Out: specs and bodies. Never here: what is measured.

use glam::{DQuat, DVec3};
use metachron_contact::{Agent, IslandMember, StepContext};
use metachron_core::{AgentId, SimSpan, SimTime, StepReport};
use metachron_geometry::{Obstacle, Solid};
use metachron_models::rigid::RigidBody;
use metachron_models::rigid::RigidSpec;

/// A body at rest at `position` that falls on what is around it, does not bounce and never sleeps.
pub fn spec(solid: Solid, position: DVec3, mass_kg: f64) -> RigidSpec {
    RigidSpec { gravity: DVec3::Z * -9.81, ..RigidSpec::free(solid, position, mass_kg) }
}

/// The plane z = 0.
pub fn floor() -> Obstacle {
    Obstacle {
        name: "floor".to_owned(),
        solid: Solid::Plane,
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        friction: 0.5,
        restitution: 0.0,
    }
}

/// The bodies of `specs`.
pub fn built(specs: impl IntoIterator<Item = RigidSpec>) -> Vec<RigidBody> {
    specs.into_iter().map(|spec| RigidBody::new(spec).expect("the body can be built")).collect()
}

/// One step of all bodies as one world; the seconds that it took, without making the list of who takes part.
pub fn step(bodies: &mut [RigidBody], span: SimSpan, apart: &mut Vec<u32>) -> (StepReport, f64) {
    let around = |i| StepContext::alone(AgentId(i), SimTime::ZERO);
    let (leader, others) = bodies.split_first_mut().expect("there is a body");
    let mut others: Vec<IslandMember<'_>> = (1..)
        .zip(others.iter_mut())
        .map(|(i, agent)| IslandMember { id: AgentId(i), agent, context: around(i) })
        .collect();
    let start = std::time::Instant::now();
    let report = leader.step_island(span, &around(0), &mut others, apart).expect("nobody is lost");
    (report, start.elapsed().as_secs_f64())
}
