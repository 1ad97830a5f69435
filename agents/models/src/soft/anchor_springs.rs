//! External springs at vertices of a soft body: of the user and of tools. Implicit in the step.
//!
//! In: pulls. Out: forces and stiffness in the system, and the impulse of each spring. Never here: vertices that never move.
//! Theory: docs/theory/soft.md, eq. 4.

use super::system::System;
use glam::DVec3;
use metachron_contact::AnchorSpring;
use metachron_core::{AgentId, Anchor};
use metachron_geometry::Carried;

/// A spring on one vertex.
#[derive(Debug, Clone, Copy)]
pub(super) struct VertexSpring {
    /// The pulling agent; `None` for a user spring.
    pub by: Option<AgentId>,
    /// The nodes that carry the point that it pulls at.
    pub at: Carried,
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
    /// The vertex that a pull on a body of `count` vertices is at; `None` where it has no such vertex.
    pub fn vertex_of(pull: &AnchorSpring, count: usize) -> Option<u32> {
        let Anchor::Vertex(vertex) = pull.anchor else { return None };
        ((vertex as usize) < count).then_some(vertex)
    }

    /// The spring of a pull on the point carried so; `None` where it is not finite.
    pub fn new(pull: &AnchorSpring, at: Carried) -> Option<Self> {
        let AnchorSpring { by, target, target_velocity, stiffness_n_m, damping_n_s_m, .. } = *pull;
        let fair = |c: f64| c.is_finite() && c >= 0.0;
        let finite = target.is_finite() && target_velocity.is_finite();
        let known = finite && fair(stiffness_n_m) && fair(damping_n_s_m);
        let (still, impulse, resistance_kg) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        known.then_some(Self {
            by,
            at,
            target,
            target_velocity,
            stiffness_n_m,
            damping_n_s_m,
            still,
            resistance_kg,
            impulse,
        })
    }

    /// Adds its force and stiffness in a substep of `h` seconds to a system whose unknown is the velocity at its end (eq. 4).
    pub fn add(&mut self, positions: &[DVec3], h: f64, system: &mut System) {
        self.resistance_kg = self.stiffness_n_m * (h * h) + self.damping_n_s_m * h;
        let apart = self.target + self.target_velocity * h - self.at.mean(positions);
        let force = apart * self.stiffness_n_m + self.target_velocity * self.damping_n_s_m;
        self.still = force * h;
        for (node, weight) in self.at.terms() {
            system.push(node as u32, force * weight);
            for (other, share) in self.at.terms() {
                system.resist([node, other], self.resistance_kg * weight * share);
            }
        }
    }

    /// Books its impulse in a substep of `h` seconds that ended with these velocities, and moves its other end on.
    pub fn book(&mut self, velocities: &[DVec3], h: f64) {
        let velocity = self.at.mean(velocities);
        self.impulse += self.still - velocity * self.resistance_kg;
        self.target += self.target_velocity * h;
    }
}
