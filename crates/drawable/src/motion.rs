//! The declared motion of an object that nothing simulates: it turns at a constant rate and swings along a line.
//!
//! In: a placement at time zero, a time. Out: the placement then, and its velocity. Never here: physics.

use crate::Placement;
use glam::{DQuat, DVec3};
use std::f64::consts::TAU;

/// A turn about an axis through a point that swings, as the domes of (MB97, §8) do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// A point of the axis at time zero, metres.
    pub about_m: DVec3,
    /// Angular velocity, rad/s.
    pub spin_rad_s: DVec3,
    /// Greatest offset of the swing, metres; at time zero it is 0 and grows.
    pub swing_m: DVec3,
    /// Swings per second, Hz.
    pub swing_hz: f64,
}

impl Motion {
    /// Placement and velocity, m/s, at the time `seconds` of an object that is at `rest` at time zero.
    #[must_use]
    pub fn at(&self, rest: &Placement, seconds: f64) -> (Placement, DVec3) {
        let turn = turn(self.spin_rad_s * seconds);
        let phase = TAU * self.swing_hz * seconds;
        let arm = turn * (rest.position - self.about_m);
        let position = self.about_m + arm + self.swing_m * libm::sin(phase);
        let velocity = self.spin_rad_s.cross(arm) + self.swing_m * (TAU * self.swing_hz * libm::cos(phase));
        (Placement { position, rotation: turn * rest.rotation, ..*rest }, velocity)
    }
}

/// The rotation by an angle about an axis, both of which are those of `vector`, radians.
fn turn(vector: DVec3) -> DQuat {
    let half = 0.5 * vector.length();
    let axis = vector.normalize_or_zero() * libm::sin(half);
    DQuat::from_xyzw(axis.x, axis.y, axis.z, libm::cos(half))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_turns_and_swings_keeps_its_distance_to_the_axis_and_moves_as_its_velocity_says() {
        let about_m = DVec3::new(1.0, 2.0, 0.5);
        let motion = Motion { about_m, spin_rad_s: DVec3::new(0.0, 0.3, 0.4), swing_m: DVec3::X * 2.0, swing_hz: 0.25 };
        let rest = Placement { position: DVec3::new(2.0, 2.0, 1.0), rotation: DQuat::from_rotation_x(0.4), scale: 3.0 };
        assert_eq!(motion.at(&rest, 0.0).0, rest);
        // a quarter of a swing is its greatest offset; a full turn by 0.5 rad/s takes 4π s
        let far = motion.at(&rest, 1.0).0.position - about_m - DVec3::X * 2.0;
        assert!((far.length() - rest.position.distance(about_m)).abs() < 1e-12);
        let round = motion.at(&rest, 4.0 * std::f64::consts::PI).0;
        assert!(round.rotation.angle_between(rest.rotation) < 1e-6 && round.scale == 3.0);
        let (h, t) = (1e-5, 1.7);
        let apart = motion.at(&rest, t + h).0.position - motion.at(&rest, t - h).0.position;
        assert!((apart / (2.0 * h)).distance(motion.at(&rest, t).1) < 1e-8);
    }
}
