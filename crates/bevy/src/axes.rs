//! The one place where axes change: Bevy has y up, metachron z.
//!
//! In: positions, directions and rotations in one of the two. Out: the same in the other, a quarter turn about x away.
//! Both are right-handed and in metres. Never here: anything that moves.

use bevy_math::{Quat, Vec3};
use glam::{DQuat, DVec3};

/// A point or direction in Bevy's axes: (x, y, z) becomes (x, z, −y).
#[must_use]
pub fn to_bevy(v: DVec3) -> Vec3 {
    Vec3::new(v.x as f32, v.z as f32, -v.y as f32)
}

/// A point or direction in metachron's axes: (x, y, z) becomes (x, −z, y).
#[must_use]
pub fn to_metachron(v: Vec3) -> DVec3 {
    DVec3::new(f64::from(v.x), -f64::from(v.z), f64::from(v.y))
}

/// A rotation in Bevy's axes. The axes of the body turn likewise: metachron's capsule along its z is Bevy's along its y.
#[must_use]
pub fn rotation_to_bevy(q: DQuat) -> Quat {
    Quat::from_xyzw(q.x as f32, q.z as f32, -q.y as f32, q.w as f32)
}

/// A rotation in metachron's axes.
#[must_use]
pub fn rotation_to_metachron(q: Quat) -> DQuat {
    DQuat::from_xyzw(f64::from(q.x), -f64::from(q.z), f64::from(q.y), f64::from(q.w))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn up_stays_up_and_right_hands_stay_right() {
        assert_eq!(to_bevy(DVec3::Z), Vec3::Y);
        assert_eq!(to_bevy(DVec3::X).cross(to_bevy(DVec3::Y)), to_bevy(DVec3::Z));
        assert_eq!(to_metachron(to_bevy(DVec3::new(1.0, 2.0, 3.0))), DVec3::new(1.0, 2.0, 3.0));
    }

    #[test]
    fn a_turned_point_is_the_same_in_both() {
        let (q, p) = (DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 0.8), DVec3::new(0.3, 0.1, -0.7));
        assert!(to_bevy(q * p).distance(rotation_to_bevy(q) * to_bevy(p)) < 1e-6); // f32
        assert!((rotation_to_metachron(rotation_to_bevy(q)) - q).length() < 1e-6);
    }
}
