//! How a rigid body lies on another agent that something fixed holds up.
//!
//! In: where its owner sees it rest. Out: the same, for others who press on it. Never here: contacts.
//! Theory: docs/theory/coupling.md, eq. 7l.

use super::Stand;
use crate::Impulse;
use crate::{AgentId, SimTime};
use glam::{DQuat, DVec3};

/// How a body rests on an agent, as that one sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Upheld {
    /// How it stands there.
    pub stand: Stand,
    /// Its centre of mass, metres.
    pub centre: DVec3,
    /// How that moved in the mean of its last step, m/s.
    pub velocity: DVec3,
    /// How it is turned.
    pub rotation: DQuat,
    /// The coefficient by which friction holds it there, ≥ 0.
    pub friction: f64,
}

impl Upheld {
    /// Whether an impulse on the body, whose centre of mass is at `centre`, only presses it there: it neither tips it nor pushes it along.
    #[must_use]
    pub fn bears(&self, centre: DVec3, impulse: Impulse) -> bool {
        let normal = self.stand.normal;
        let along = impulse.linear.dot(normal);
        (impulse.linear - normal * along).length() <= -self.friction * along && self.stand.bears(centre, impulse)
    }
}

/// On whom a body lies, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiesOn {
    /// Who bears it.
    pub on: AgentId,
    /// When the next step of that one begins, and how long its steps are, seconds.
    pub at: SimTime,
    /// See [`Self::at`].
    pub step_s: f64,
    /// How it rests there.
    pub upheld: Upheld,
}

impl LiesOn {
    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let Upheld { stand, centre, velocity, rotation, .. } = &self.upheld;
        [stand.normal, stand.centre, *centre, *velocity].iter().all(|v| v.is_finite())
            && (rotation.is_finite() && self.step_s.is_finite())
    }
}
