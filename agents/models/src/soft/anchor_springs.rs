//! External springs at vertices of a soft body: user springs, tools, links. Implicit in the step.
//!
//! In: pulls and links. Out: forces and stiffness in the system, and the impulse of each spring. Never here: vertices that never move.
//! Theory: docs/theory/soft.md, eq. 3, 4; docs/theory/coupling.md, eq. 9.

use super::system::System;
use glam::{DMat3, DVec3};
use metachron_contact::AnchorSpring;
use metachron_contact::{Far, Link, Pulled};
use metachron_core::{AgentId, Anchor};

/// A spring on one vertex.
#[derive(Debug, Clone, Copy)]
pub(super) struct VertexSpring {
    /// The pulling agent; `None` for a user spring.
    pub by: Option<AgentId>,
    /// Which vertex.
    pub vertex: usize,
    /// The link that it belongs to, if the other end yields.
    pub link: Option<Link>,
    /// Position of the other end at the start of the substep, metres, and its velocity, m/s.
    target: DVec3,
    target_velocity: DVec3,
    /// Stiffness, N/m, and damping, N·s/m.
    stiffness: DMat3,
    damping: DMat3,
    /// Factor by which the force is reduced because the other end yields.
    ease: DMat3,
    /// The impulse of the substep for a vertex at rest, N·s, and its decrease per velocity of the vertex, kg.
    still: DVec3,
    eased: DMat3,
    /// The increase of that impulse per velocity of the far end, kg, and the response of the far end to all links to the same agent as if
    /// they were at one point, 1/kg.
    reach: DMat3,
    yields: DMat3,
    /// Difference between that response and the expected motion of the far end, m/s.
    predicted: DVec3,
    /// The impulse of the last substep, and of the step, N·s.
    pub given: DVec3,
    pub impulse: DVec3,
}

impl VertexSpring {
    /// The tie of a pull; `None` where it has no such vertex or is not finite.
    pub fn of_pull(pull: &AnchorSpring, count: usize) -> Option<Self> {
        let finite = pull.target.is_finite() && pull.target_velocity.is_finite();
        let tie = Self::at(pull.anchor, pull.stiffness_n_m, pull.damping_n_s_m, count)?;
        let (target, target_velocity) = (pull.target, pull.target_velocity);
        finite.then_some(Self { by: pull.by, target, target_velocity, ..tie })
    }

    /// The tie of a link, whose far end is set later ([`VertexSpring::aim`]).
    pub fn of_link(link: &Link, count: usize) -> Option<Self> {
        let tie = Self::at(link.here, link.stiffness_n_m, link.damping_n_s_m, count)?;
        Some(Self { by: Some(link.other), link: Some(*link), ..tie })
    }

    fn at(anchor: Anchor, stiffness_n_m: f64, damping_n_s_m: f64, count: usize) -> Option<Self> {
        let Anchor::Vertex(vertex) = anchor else { return None };
        let fair = |c: f64| c.is_finite() && c >= 0.0;
        let known = (vertex as usize) < count && fair(stiffness_n_m) && fair(damping_n_s_m);
        known.then(|| Self {
            by: None,
            vertex: vertex as usize,
            link: None,
            target: DVec3::ZERO,
            target_velocity: DVec3::ZERO,
            stiffness: round(stiffness_n_m),
            damping: round(damping_n_s_m),
            ease: DMat3::IDENTITY,
            still: DVec3::ZERO,
            eased: DMat3::ZERO,
            reach: DMat3::ZERO,
            yields: DMat3::ZERO,
            predicted: DVec3::ZERO,
            given: DVec3::ZERO,
            impulse: DVec3::ZERO,
        })
    }

    /// Sets the state of a link's far end for a substep of `h` seconds that begins with this end at `point`; `shared`
    /// links in all pull at that agent.
    pub fn aim(&mut self, far: &Far, point: DVec3, h: f64, shared: usize) {
        let Some(link) = self.link else { return };
        let spring = far.spring(&link, point);
        (self.stiffness, self.damping) = (spring.stiffness, spring.damping);
        (self.target, self.target_velocity) = (spring.target, far.velocity);
        let resistance = self.stiffness * (h * h) + self.damping * h;
        self.yields = far.inverse_mass * shared as f64;
        self.ease = (DMat3::IDENTITY + resistance * self.yields).inverse();
    }

    /// The impulse of the last substep; `None` where no agent receives it.
    pub fn pulled(&self) -> Option<Pulled> {
        self.by.map(|by| Pulled { by, link: self.link, given: self.given })
    }

    /// The error of `predicted`, m/s, where the links to the far end's agent change its velocity by `move_m_s` and this end has this
    /// velocity (eq. 4a).
    pub fn prediction_error(&self, move_m_s: DVec3, velocity: DVec3) -> DVec3 {
        move_m_s + self.yields * self.impulse_at(velocity) - self.predicted
    }

    /// Increases `predicted` by `more`, m/s; returns the additional impulse.
    pub fn add_prediction(&mut self, more: DVec3) -> DVec3 {
        self.predicted += more;
        let impulse = self.reach * more;
        self.still += impulse;
        impulse
    }

    /// The impulse that it gives if this end has this velocity after the substep.
    pub fn impulse_at(&self, velocity: DVec3) -> DVec3 {
        self.still - self.eased * velocity
    }

    /// Adds its force and stiffness in a substep of `h` seconds to a system whose unknown is the velocity at its end (eq. 3).
    pub fn add(&mut self, position: DVec3, h: f64, system: &mut System) {
        let eased = self.ease * (self.stiffness * (h * h) + self.damping * h);
        self.eased = (eased + eased.transpose()) * 0.5;
        (self.reach, self.predicted) = (eased, DVec3::ZERO);
        let apart = self.target + self.target_velocity * h - position;
        let force = self.ease * (self.stiffness * apart + self.damping * self.target_velocity);
        self.still = force * h;
        system.weigh(self.vertex, self.eased);
        system.push(self.vertex as u32, force);
    }

    /// Books its impulse in a substep of `h` seconds that ended with `velocity`, and moves a driven end on.
    pub fn book(&mut self, velocity: DVec3, h: f64) {
        self.given = self.impulse_at(velocity);
        self.impulse += self.given;
        self.target += self.target_velocity * h;
    }
}

fn round(value: f64) -> DMat3 {
    DMat3::from_diagonal(DVec3::splat(value))
}
