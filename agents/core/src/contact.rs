//! The contacts of an agent and the efforts of its joints, as its state publishes them.

use crate::{AgentId, SimTime};
use glam::DVec3;

/// The other side of a contact, or of a touch that is only sensed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum ContactPartner {
    /// A static solid, by its number in the scene.
    Static(u32),
    /// Another agent.
    Agent(AgentId),
}

/// The contact force on a body and its torque about the centre of mass, world axes.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Wrench {
    /// N.
    pub force_n: DVec3,
    /// N·m.
    pub torque_n_m: DVec3,
}

impl Wrench {
    /// Adds a force on the point `arm_m` from the centre of mass.
    pub fn add(&mut self, force_n: DVec3, arm_m: DVec3) {
        self.force_n += force_n;
        self.torque_n_m += arm_m.cross(force_n);
    }
}

impl std::ops::Mul<f64> for Wrench {
    type Output = Self;

    fn mul(self, by: f64) -> Self {
        Self { force_n: self.force_n * by, torque_n_m: self.torque_n_m * by }
    }
}

/// The effort of a joint's motor and stops together along the direction that the joint leaves free.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct JointEffort {
    /// The joint's number in the scene.
    pub joint: u32,
    /// N·m about a hinge's axis, or N along a slide's: of the first body on the second.
    pub effort: f64,
}

/// A contact with all its places. It is published by the agent, of two by that of the lower number.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ContactState {
    /// The other side.
    pub with: ContactPartner,
    /// When it began, in the agent's time: the end of its first step.
    pub since: SimTime,
    /// Places that bore something in the last step, counted in each of its parts.
    pub places: u32,
    /// The place that bore most in it, metres; not a number where that is not known.
    pub point_m: DVec3,
    /// The normal there, towards the agent, of length 1.
    pub normal: DVec3,
    /// The force on the agent, world axes, N: the mean of the last step.
    pub force_n: DVec3,
    /// The greatest of these forces since it began, world axes, N.
    pub greatest_n: DVec3,
    /// The force that its events have reported last, N.
    pub reported_n: f64,
    /// The deepest overlap in the last step, metres, ≥ 0.
    pub depth_m: f64,
    /// How much more it bears for each metre that a side which a user leads is led on within the next step, along the normal, N/m, ≥ 0; 0 where
    /// a user leads neither, in heaps, and between two that give way to nothing (docs/theory/coupling.md, eq. 7s).
    pub stiffness_n_m: f64,
}
