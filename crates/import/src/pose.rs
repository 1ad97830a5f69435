//! Positions with rotations.
//!
//! In: numbers of files. Out: [`Pose`]s, and the angles that scenes write. Never here: the objects at these places.

use glam::{DMat3, DQuat, DVec3};

/// Axes in other axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pose {
    /// Metres.
    pub(crate) position: DVec3,
    pub(crate) rotation: DQuat,
}

impl Pose {
    pub(crate) const IDENTITY: Self = Self { position: DVec3::ZERO, rotation: DQuat::IDENTITY };

    /// A pose of the axes of `self`, in the axes that `self` is in.
    pub(crate) fn then(self, inner: Self) -> Self {
        Self { position: self.point(inner.position), rotation: (self.rotation * inner.rotation).normalize() }
    }

    pub(crate) fn point(self, point: DVec3) -> DVec3 {
        self.position + self.rotation * point
    }

    pub(crate) fn inverse(self) -> Self {
        let rotation = self.rotation.conjugate();
        Self { position: rotation * -self.position, rotation }
    }
}

/// Rotation about the fixed x, then y, then z axis, radians.
pub(crate) fn fixed_angles(x: f64, y: f64, z: f64) -> DQuat {
    DQuat::from_rotation_z(z) * DQuat::from_rotation_y(y) * DQuat::from_rotation_x(x)
}

/// The angles about the fixed x, then y, then z axis that make a rotation, degrees.
///
/// The second comes from an arc tangent: an arc sine would lose half of the digits near a right angle, which robots are full of.
pub(crate) fn fixed_angles_deg(rotation: DQuat) -> DVec3 {
    let m = DMat3::from_quat(rotation);
    let across = m.x_axis.x.hypot(m.x_axis.y);
    let y = (-m.x_axis.z).atan2(across);
    // where the second is a right angle, the first and third turn about one axis: the third is none then
    let (x, z) = if across < 1e-9 {
        ((-m.z_axis.y).atan2(m.y_axis.y), 0.0)
    } else {
        (m.y_axis.z.atan2(m.z_axis.z), m.x_axis.y.atan2(m.x_axis.x))
    };
    DVec3::new(x.to_degrees(), y.to_degrees(), z.to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn angles_make_their_rotation_again_also_at_right_angles() {
        for [x, y, z] in
            [[0.3, -1.2, 2.0], [-2.0, FRAC_PI_2, 0.7], [0.4, -FRAC_PI_2, 1.0], [0.0, 0.0, 3.0], [0.1, 1.5706, 0.2]]
        {
            let rotation = fixed_angles(x, y, z);
            let deg = fixed_angles_deg(rotation);
            let back = fixed_angles(deg.x.to_radians(), deg.y.to_radians(), deg.z.to_radians());
            assert!(back.angle_between(rotation) < 1e-7, "{x} {y} {z}: {deg}"); // angle_between has half of the digits
            assert!((back * DVec3::ONE).distance(rotation * DVec3::ONE) < 2e-9, "{x} {y} {z}: {deg}"); // the bound above
        }
    }
}
