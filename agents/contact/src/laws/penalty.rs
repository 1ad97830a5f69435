//! Penalty contact: a spring and a damper where skins overlap, as in most engines.
//!
//! In: a place and how its two sides move. Out: the force on one side. Stable only below k = 0.55 μ/τ² for data of age τ.

use glam::DVec3;

/// Below this slip speed, m/s, friction is proportional to the slip.
const STICK_M_S: f64 = 1e-3;

/// The force on the side that `normal` points to, newtons: `stiffness` (N/m) times the depth, less `damping` (N·s/m) times
/// the separation speed, never attractive; friction opposes the slip.
///
/// `velocity` is that side's velocity relative to the other, m/s; `gap_m` is below zero where the two overlap.
#[must_use]
pub fn push_off_n(
    (gap_m, normal, velocity): (f64, DVec3, DVec3),
    (stiffness, damping): (f64, f64),
    friction: f64,
) -> DVec3 {
    if gap_m >= 0.0 {
        return DVec3::ZERO;
    }
    let parting = velocity.dot(normal);
    let push = (-stiffness * gap_m - damping * parting).max(0.0);
    let slip = velocity - normal * parting;
    normal * push - slip * (friction * push / slip.length().max(STICK_M_S))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_penalty_pushes_and_never_pulls() {
        let force = |gap: f64, v: f64| push_off_n((gap, DVec3::Z, DVec3::Z * v), (100.0, 10.0), 0.0).z;
        assert_eq!(force(0.01, -1.0), 0.0);
        assert_eq!(force(-0.01, 0.0), 1.0);
        assert_eq!(force(-0.01, -0.1), 2.0);
        assert_eq!(force(-0.01, 1.0), 0.0);
    }

    #[test]
    fn friction_is_coulombs_against_the_slip() {
        let force = push_off_n((-0.01, DVec3::Z, DVec3::X * 0.2), (100.0, 0.0), 0.5);
        assert!(force.distance(DVec3::new(-0.5, 0.0, 1.0)) < 1e-15); // rounding
    }
}
