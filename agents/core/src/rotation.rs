//! Rotations as users give them, and the shortest turn between two.

use glam::{DQuat, DVec3};

/// The rotation that a quaternion of any length stands for, of length 1; `None` of one that is not finite or has no length. All rotations that
/// users give are read so.
#[must_use]
pub fn unit_rotation(given: DQuat) -> Option<DQuat> {
    let scale = given.length_recip();
    (given.is_finite() && scale.is_normal()).then(|| given * scale)
}

/// The shortest turn that leads `from` one rotation `to` another, as a rotation vector in world axes, radians, of length at most π; exactly
/// zero between equal ones.
#[must_use]
pub fn shortest_turn(from: DQuat, to: DQuat) -> DVec3 {
    let turned = to * from.conjugate();
    let shorter = if turned.w < 0.0 { -turned } else { turned };
    if from == to { DVec3::ZERO } else { shorter.to_scaled_axis() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quaternion_of_any_length_is_a_rotation_unless_it_has_none() {
        let turn = DQuat::from_rotation_x(0.7);
        for length in [1e-6, 0.4, 1.0, 3.0, 1e6] {
            assert!(unit_rotation(turn * length).unwrap().abs_diff_eq(turn, 1e-15), "{length}"); // a few roundings
        }
        for bad in [DQuat::from_array([0.0; 4]), turn * f64::NAN, turn * f64::INFINITY, turn * 1e-200, turn * 1e200] {
            assert_eq!(unit_rotation(bad), None, "{bad}");
        }
    }

    #[test]
    fn the_turn_leads_from_one_to_the_other_and_never_the_long_way() {
        let from = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.2, 2.0);
        for angle in [0.0, 1e-9, 1.0, 3.1, 3.2, 6.0] {
            let to = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), angle) * from;
            for to in [to, -to] {
                let turn = shortest_turn(from, to);
                assert!(turn.length() <= std::f64::consts::PI, "{angle}: {turn}");
                let there = DQuat::from_scaled_axis(turn) * from;
                assert!(there.dot(to).abs() > 1.0 - 1e-15, "{angle}: {there} is not {to}"); // a few roundings
            }
        }
        assert_eq!(shortest_turn(from, from), DVec3::ZERO);
    }
}
