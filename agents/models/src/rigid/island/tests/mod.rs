//! What bodies that share a world must do, against closed forms and balances.

use super::super::{Joint, JointKind, RigidBody, RigidSpec};
use glam::{DQuat, DVec3};
use metachron_contact::{Agent, AnchorSpring, IslandMember, Neighbour, StepContext};
use metachron_core::{AgentId, Body, RigidState, SimSpan, SimTime, Snapshot, StepReport};
use metachron_geometry::{Obstacle, Solid};
use std::sync::Arc;

mod chains;
mod heaps;
mod held;
mod joints;
mod membership;
mod stacks;

const G: f64 = 9.81;

/// Bodies 0 … n − 1; the first leads, hands hold it, and it sees who is near.
struct Party {
    bodies: Vec<RigidBody>,
    hands: Vec<AnchorSpring>,
    near: Vec<Neighbour>,
    time: SimTime,
    apart: Vec<u32>,
}

fn spec(solid: Solid, position: DVec3) -> RigidSpec {
    RigidSpec {
        solid,
        position,
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        spin: DVec3::ZERO,
        mass_kg: 1.0,
        restitution: 0.0,
        friction: 0.5,
        gravity: DVec3::Z * -G,
        obstacles: Arc::new([]),
        joints: Arc::new([]),
        sleep: true,
    }
}

fn cube(half: f64, position: DVec3) -> RigidSpec {
    spec(Solid::Box { half_extents_m: DVec3::splat(half) }, position)
}

fn floor(friction: f64, rotation: DQuat) -> Arc<[Obstacle]> {
    let floor = Obstacle {
        name: "floor".to_owned(),
        solid: Solid::Plane,
        position: DVec3::ZERO,
        rotation,
        friction,
        restitution: 0.0,
    };
    [floor].into()
}

impl Party {
    fn new(specs: impl IntoIterator<Item = RigidSpec>) -> Self {
        let bodies = specs.into_iter().map(|spec| RigidBody::new(spec).unwrap()).collect();
        Self { bodies, hands: vec![], near: vec![], time: SimTime::ZERO, apart: vec![] }
    }

    /// The same, held by joints.
    fn jointed(specs: impl IntoIterator<Item = RigidSpec>, joints: impl IntoIterator<Item = Joint>) -> Self {
        let joints: Arc<[Joint]> = joints.into_iter().collect();
        Self::new(specs.into_iter().map(|spec| RigidSpec { joints: joints.clone(), ..spec }))
    }

    fn step(&mut self, dt: f64) -> StepReport {
        let dt = SimSpan::from_secs_f64(dt).unwrap();
        let (leader, others) = self.bodies.split_first_mut().unwrap();
        let mut others: Vec<IslandMember<'_>> = others
            .iter_mut()
            .enumerate()
            .map(|(i, body)| {
                let id = AgentId(i as u32 + 1);
                IslandMember { id, agent: body, context: StepContext::alone(id, self.time) }
            })
            .collect();
        let around =
            StepContext { hands: &self.hands, neighbours: &self.near, ..StepContext::alone(AgentId(0), self.time) };
        leader.step_island(dt, &around, &mut others, &mut self.apart).unwrap()
    }

    fn run(&mut self, dt: f64, seconds: f64) {
        (0..(seconds / dt).round() as u32).for_each(|_| {
            self.step(dt);
        });
    }

    fn snapshot(&self, index: usize) -> Snapshot {
        let mut snapshot = Snapshot::default();
        self.bodies[index].write_snapshot(&mut snapshot);
        snapshot
    }

    fn state(&self, index: usize) -> RigidState {
        let Body::Rigid(state) = self.snapshot(index).body else { panic!("a rigid body writes a rigid state") };
        state
    }

    fn energy_j(&self) -> f64 {
        (0..self.bodies.len()).map(|i| self.snapshot(i).energy_j).sum()
    }

    fn momentum(&self) -> (DVec3, DVec3) {
        self.bodies
            .iter()
            .map(RigidBody::momentum)
            .fold((DVec3::ZERO, DVec3::ZERO), |sum, p| (sum.0 + p.0, sum.1 + p.1))
    }
}
