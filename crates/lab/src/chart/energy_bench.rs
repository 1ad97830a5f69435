//! A step harness with energy sums: bodies and tubes, their springs, and the sums over them.
//!
//! In: bodies and tubes with rates, springs from fixed points. Out: their energy. Never here: which bodies, which claims.

use super::bench::StepHarness;
use metachron_contact::AnchorSpring;
use metachron_core::{AgentId, Body, RigidState};
use metachron_geometry::Obstacle;
use metachron_models::rigid::{RigidBody, RigidSpec};
use metachron_models::rod::{Tube, TubeSpec};

/// Agents, and the data for sums over them.
pub(super) struct Play {
    /// The agents.
    pub(super) stage: StepHarness,
    /// The springs of each agent.
    springs: Vec<Vec<AnchorSpring>>,
}

impl Play {
    /// An empty stage among static solids; `None` where one of these is invalid.
    pub(super) fn among(obstacles: &[Obstacle]) -> Option<Self> {
        Some(Self { stage: StepHarness::among(obstacles)?, springs: Vec::new() })
    }

    /// Adds a rigid body that fixed springs pull; `None` where the body cannot be built.
    pub(super) fn add_body(&mut self, spec: RigidSpec, rate_hz: f64, springs: Vec<AnchorSpring>) -> Option<AgentId> {
        let id = self.stage.add(Box::new(RigidBody::new(spec).ok()?), rate_hz)?;
        self.stage.member(id).user_springs.clone_from(&springs);
        self.springs.push(springs);
        Some(id)
    }

    /// Adds a tube; `None` where it cannot be built.
    pub(super) fn add_tube(&mut self, spec: TubeSpec, rate_hz: f64) -> Option<AgentId> {
        let id = self.stage.add(Box::new(Tube::new(spec).ok()?), rate_hz)?;
        self.springs.push(Vec::new());
        Some(id)
    }

    /// Energy of all agents and springs, joules.
    pub(super) fn energy_j(&self) -> f64 {
        let one = |(snapshot, springs): (&metachron_core::Snapshot, &Vec<AnchorSpring>)| {
            let springs_j = if let Body::Rigid(state) = &snapshot.body { springs_j(springs, state) } else { 0.0 };
            snapshot.energy_j + springs_j
        };
        self.stage.snapshots().zip(&self.springs).map(one).sum()
    }
}

/// Energy of springs between fixed points and a body, joules.
pub(super) fn springs_j(springs: &[AnchorSpring], state: &RigidState) -> f64 {
    let one = |spring: &AnchorSpring| {
        let end = Body::Rigid(*state).point(spring.anchor);
        end.map_or(0.0, |(end, _)| 0.5 * spring.stiffness_n_m * end.distance_squared(spring.target))
    };
    springs.iter().map(one).sum()
}
