//! The other end of a link.
//!
//! In: where a point of another agent is expected. Out: the spring to it. Never here: what the spring gives, which depends on how
//! its near end moves. Theory: docs/theory/coupling.md, eq. 9; rod.md, eq. 35, 36.

use crate::Link;
use glam::{DMat3, DVec3};

/// The other end of a link at the start of a substep.
#[derive(Debug, Clone, Copy)]
pub struct Far {
    /// Where it is, metres.
    pub point: DVec3,
    /// Its velocity without this link, m/s.
    pub velocity: DVec3,
    /// Its inverse mass there, 1/kg.
    pub inverse_mass: DMat3,
}

/// A link as a linear spring about where its two ends are.
#[derive(Debug, Clone, Copy)]
pub struct LinkSpring {
    /// Where it pulls its near end to, metres.
    pub target: DVec3,
    /// N/m.
    pub stiffness: DMat3,
    /// N·s/m.
    pub damping: DMat3,
}

impl Far {
    /// The spring of `link` for a near end at `point`.
    #[must_use]
    pub fn spring(&self, link: &Link, point: DVec3) -> LinkSpring {
        let (k, d) = (link.stiffness_n_m, link.damping_n_s_m);
        let way = point - self.point;
        let distance = way.length();
        if link.rest_m <= 0.0 || distance <= 0.0 {
            return LinkSpring { target: self.point, stiffness: round(k), damping: round(d) };
        }
        let along = way / distance;
        let outer = DMat3::from_cols(along * along.x, along * along.y, along * along.z);
        // a spring in compression has no stiffness across: it would have less than none
        let across = k * (1.0 - link.rest_m / distance).max(0.0);
        LinkSpring {
            target: self.point + along * link.rest_m,
            stiffness: round(across) + outer * (k - across),
            damping: outer * d,
        }
    }
}

fn round(scale: f64) -> DMat3 {
    DMat3::from_diagonal(DVec3::splat(scale))
}
