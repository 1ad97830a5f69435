//! External springs at vertices of a soft body: the user's and those of tools. Implicit in the step.
//!
//! In: pulls. Out: forces and stiffness in the system, and the impulse of each spring. Never here: vertices that never move.
//! Theory: docs/theory/soft.md, eq. 3.

use super::system::System;
use glam::{DMat3, DVec3};
use metachron_contact::AnchorSpring;
use metachron_core::{AgentId, Anchor};

/// A spring on one vertex.
#[derive(Debug, Clone, Copy)]
pub(super) struct VertexSpring {
    /// The pulling agent; `None` for a user spring.
    pub by: Option<AgentId>,
    /// Which vertex.
    pub vertex: usize,
    /// Position of the other end at the start of the substep, metres, and its velocity, m/s.
    target: DVec3,
    target_velocity: DVec3,
    stiffness_n_m: f64,
    damping_n_s_m: f64,
    /// The impulse of the substep for a vertex at rest, N·s, and its decrease per velocity of the vertex, kg.
    still: DVec3,
    resistance_kg: f64,
    /// The impulse of the step, N·s.
    pub impulse: DVec3,
}

impl VertexSpring {
    /// The spring of a pull on a body of `count` vertices; `None` where it has no such vertex or is not finite.
    pub fn new(pull: &AnchorSpring, count: usize) -> Option<Self> {
        let AnchorSpring { by, anchor, target, target_velocity, stiffness_n_m, damping_n_s_m } = *pull;
        let Anchor::Vertex(vertex) = anchor else { return None };
        let vertex = vertex as usize;
        let fair = |c: f64| c.is_finite() && c >= 0.0;
        let finite = target.is_finite() && target_velocity.is_finite();
        let known = finite && vertex < count && fair(stiffness_n_m) && fair(damping_n_s_m);
        let (still, impulse, resistance_kg) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        known.then_some(Self {
            by,
            vertex,
            target,
            target_velocity,
            stiffness_n_m,
            damping_n_s_m,
            still,
            resistance_kg,
            impulse,
        })
    }

    /// Adds its force and stiffness in a substep of `h` seconds to a system whose unknown is the velocity at its end (eq. 3).
    pub fn add(&mut self, position: DVec3, h: f64, system: &mut System) {
        self.resistance_kg = self.stiffness_n_m * (h * h) + self.damping_n_s_m * h;
        let apart = self.target + self.target_velocity * h - position;
        let force = apart * self.stiffness_n_m + self.target_velocity * self.damping_n_s_m;
        self.still = force * h;
        system.weigh(self.vertex, DMat3::from_diagonal(DVec3::splat(self.resistance_kg)));
        system.push(self.vertex as u32, force);
    }

    /// Books its impulse in a substep of `h` seconds that ended with `velocity`, and moves its other end on.
    pub fn book(&mut self, velocity: DVec3, h: f64) {
        self.impulse += self.still - velocity * self.resistance_kg;
        self.target += self.target_velocity * h;
    }
}
