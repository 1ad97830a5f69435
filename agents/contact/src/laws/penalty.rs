//! Penalty contact: a spring and a damper where skins overlap, as in most engines.
//!
//! In: a place and how its two sides move. Out: the force on one side. Stable only below k = 0.55 μ/τ² for data of age τ.

use glam::DVec3;

/// Below this slip speed, m/s, friction is proportional to the slip.
const STICK_M_S: f64 = 1e-3;

/// A place where two surfaces touch, as one side of it sees the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Approach {
    /// Distance of the surfaces, metres; below zero they overlap.
    pub gap_m: f64,
    /// Unit normal, towards this side.
    pub normal: DVec3,
    /// Velocity of this side relative to the other, m/s.
    pub velocity_m_s: DVec3,
}

/// The force on the side that the normal points to, newtons: the stiffness times the depth, less the damping times
/// the separation speed, never attractive; friction opposes the slip.
#[must_use]
pub fn push_off_n(approach: Approach, stiffness_n_m: f64, damping_n_s_m: f64, friction: f64) -> DVec3 {
    let Approach { gap_m, normal, velocity_m_s: velocity } = approach;
    if gap_m >= 0.0 {
        return DVec3::ZERO;
    }
    let parting = velocity.dot(normal);
    let push = (-stiffness_n_m * gap_m - damping_n_s_m * parting).max(0.0);
    let slip = velocity - normal * parting;
    normal * push - slip * (friction * push / slip.length().max(STICK_M_S))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_penalty_pushes_and_never_pulls() {
        let force = |gap_m: f64, v: f64| {
            push_off_n(Approach { gap_m, normal: DVec3::Z, velocity_m_s: DVec3::Z * v }, 100.0, 10.0, 0.0).z
        };
        assert_eq!(force(0.01, -1.0), 0.0);
        assert_eq!(force(-0.01, 0.0), 1.0);
        assert_eq!(force(-0.01, -0.1), 2.0);
        assert_eq!(force(-0.01, 1.0), 0.0);
    }

    #[test]
    fn friction_is_coulombs_against_the_slip() {
        let slipping = Approach { gap_m: -0.01, normal: DVec3::Z, velocity_m_s: DVec3::X * 0.2 };
        let force = push_off_n(slipping, 100.0, 0.0, 0.5);
        assert!(force.distance(DVec3::new(-0.5, 0.0, 1.0)) < 1e-15); // rounding
    }
}
