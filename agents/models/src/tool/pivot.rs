//! The remote centre of motion of a tool: a fixed point that its shaft passes through wherever its tip is, as through a trocar.
//!
//! In: a pivot, tips, rotations. Out: tips within reach of it, rotations that put the shaft through it, how points of the tool move with
//! the tip. Never here: the goal of the tip, contacts.
//! Theory: docs/theory/coupling.md, eq. 9f to 9h.

use super::{Keyframe, ToolError, ToolSpec};
use crate::trajectory::PointMotion;
use glam::{DMat3, DQuat, DVec3};
use metachron_contact::solve::{Side, SideTerm};
use metachron_core::ToolState;
use metachron_geometry::ToolShape;
use std::ops::RangeInclusive;

/// A pivot, and how deep a tool can be inserted through it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pivot {
    at_m: DVec3,
    /// Allowed distances from the pivot to the tip, metres: those of the points of the shaft.
    least_m: f64,
    most_m: f64,
}

impl ToolSpec {
    /// The rotation at the start of its script, a unit quaternion: with a pivot the one that puts the shaft through it.
    #[must_use]
    pub fn start_rotation(&self) -> DQuat {
        let Some(key) = self.keyframes.first() else { return DQuat::IDENTITY };
        let rotation = key.rotation.normalize();
        self.pivot().map_or(rotation, |pivot| pivot.aligned(rotation, key.tip_m + self.starts_off_m))
    }

    /// Distances from the tip to the points of a tool's shaft, metres: how deep one with a pivot can be inserted.
    #[must_use]
    pub fn insertion_m() -> RangeInclusive<f64> {
        let shape = ToolShape::default();
        shape.shaft_from_m()..=shape.shaft_from_m() + shape.shaft_length_m
    }

    pub(super) fn pivot(&self) -> Option<Pivot> {
        let insertion_m = Self::insertion_m();
        self.pivot_m.map(|at_m| Pivot { at_m, least_m: *insertion_m.start(), most_m: *insertion_m.end() })
    }
}

impl Pivot {
    /// Whether the tool can be where a keyframe wants it.
    pub fn check(&self, index: usize, key: &Keyframe) -> Result<(), ToolError> {
        let (least_m, most_m) = (self.least_m, self.most_m);
        let depth_m = key.tip_m.distance(self.at_m);
        if (least_m..=most_m).contains(&depth_m) {
            return Ok(());
        }
        Err(ToolError::Unreachable { index, depth_m, least_m, most_m })
    }

    /// The keyframes with their rotations turned so that the shaft passes through the pivot: only the turn about the
    /// shaft is left of them. A rotation repeated from the keyframe before means no turn about it.
    pub fn thread(&self, keyframes: &[Keyframe]) -> Vec<Keyframe> {
        let mut given = None;
        let mut from = DQuat::IDENTITY;
        let threaded = keyframes.iter().map(|key| {
            if given.replace(key.rotation) != Some(key.rotation) {
                from = self.aligned(key.rotation.normalize(), key.tip_m);
            }
            Keyframe { rotation: self.aligned(from, key.tip_m), ..*key }
        });
        threaded.collect()
    }

    /// The nearest place to `tip` that the tool reaches through the pivot; `rotation` tells the way where the tip is at the pivot itself.
    pub fn within(&self, tip: DVec3, rotation: DQuat) -> DVec3 {
        let arm = tip - self.at_m;
        let depth_m = arm.length();
        if (self.least_m..=self.most_m).contains(&depth_m) || !depth_m.is_finite() {
            return tip;
        }
        let along = arm.try_normalize().unwrap_or(rotation * DVec3::Z);
        self.at_m + along * depth_m.clamp(self.least_m, self.most_m)
    }

    /// `rotation` turned on the shortest way so that the shaft of a tool with this tip passes through the pivot.
    pub fn aligned(&self, rotation: DQuat, tip: DVec3) -> DQuat {
        let Some(along) = (tip - self.at_m).try_normalize() else { return rotation };
        let axis = rotation * DVec3::Z;
        let cos = axis.dot(along);
        // glam's takes turns of less than 3e-8 rad for none
        let arc = if cos > 0.0 {
            DQuat::from_vec4(axis.cross(along).extend(1.0 + cos)).normalize()
        } else {
            DQuat::from_rotation_arc(axis, along)
        };
        (arc * rotation).normalize()
    }

    /// How the spin of the tool follows from the velocity v of its tip: ω = a × v / l for the axis a and the depth l (eq. 9f).
    fn turning(&self, tip: DVec3) -> DMat3 {
        let arm = tip - self.at_m;
        // −v × a / l, by the map of a spin v at an arm
        SideTerm::spin(0, arm * -arm.length_squared().recip()).map
    }

    /// The spin that the velocity `tip_m_s` of the tip gives it, rad/s.
    pub fn spin_rad_s(&self, tip: DVec3, tip_m_s: DVec3) -> DVec3 {
        self.turning(tip) * tip_m_s
    }

    /// The spin as a share of the velocity of the tip.
    pub fn turns(&self, tip: DVec3) -> Side {
        Side::new(0, &[SideTerm { block: 0, map: self.turning(tip) }]).unwrap_or(Side::FIXED)
    }

    /// How the point `arm_m` from the tip moves with the tip: v + ω × r (eq. 9g).
    pub fn side(&self, tip: DVec3, arm_m: DVec3) -> Side {
        let map = DMat3::IDENTITY + SideTerm::spin(0, arm_m).map * self.turning(tip);
        Side::new(0, &[SideTerm { block: 0, map }]).unwrap_or(Side::FIXED)
    }

    /// The largest speed of a point at most `reach_m` from the tip whose speed is `tip_m_s`, m/s.
    pub fn speed_bound(&self, tip: DVec3, tip_m_s: f64, reach_m: f64) -> f64 {
        tip_m_s * (1.0 + reach_m / tip.distance(self.at_m))
    }

    /// Where the tip has to be for the point `local_m` of the tool, in its own axes, to be at `wanted`: a point behind the pivot moves
    /// the tip the other way, as a handle does (eq. 9h).
    pub fn tip_for(&self, tool: &ToolState, local_m: DVec3, wanted: PointMotion) -> PointMotion {
        let depth_m = tool.tip.distance(self.at_m) + local_m.z;
        let arm = wanted.position - (tool.rotation * local_m.with_z(0.0)) - self.at_m;
        let facing = if depth_m < 0.0 { -1.0 } else { 1.0 };
        let along = (arm * facing).try_normalize().unwrap_or(tool.rotation * DVec3::Z);
        let held_m = facing * arm.length();
        let tip_depth_m = (held_m - local_m.z).clamp(self.least_m, self.most_m);
        // nearer to the pivot the lever would be without bound
        let lever = tip_depth_m / held_m.abs().max(self.least_m) * facing;
        let inward = along * wanted.velocity.dot(along);
        let velocity = inward + (wanted.velocity - inward) * lever;
        PointMotion { position: self.at_m + along * tip_depth_m, velocity }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIVOT: Pivot = Pivot { at_m: DVec3::new(0.1, -0.2, 0.3), least_m: 0.025, most_m: 0.325 };

    #[test]
    fn the_shaft_passes_through_the_pivot_and_is_inserted_by_its_distance_from_the_tip() {
        let tip = DVec3::new(0.14, -0.17, 0.18);
        let rotation = PIVOT.aligned(DQuat::from_rotation_y(2.0) * DQuat::from_rotation_z(0.7), tip);
        // the pivot in the tool's axes: on the shaft, √(0.04² + 0.03² + 0.12²) = 0.13 m behind the tip
        let local = rotation.conjugate() * (PIVOT.at_m - tip);
        assert!(local.distance(DVec3::NEG_Z * 0.13) < 1e-15, "{local}"); // rounding
    }

    #[test]
    fn a_point_on_the_shaft_moves_across_it_by_its_lever_about_the_pivot() {
        let tip = PIVOT.at_m + DVec3::NEG_Z * 0.2;
        let v = DVec3::new(0.3, -0.1, 0.05);
        for behind_m in [0.0, 0.05, 0.2, 0.3] {
            let moves = PIVOT.side(tip, DVec3::Z * behind_m).velocity(&[v]);
            // at the depth s of 0.2 m: s/l across, all along; at the pivot only along, behind it the other way
            let lever = 1.0 - behind_m / 0.2;
            assert!(moves.distance(DVec3::new(0.3 * lever, -0.1 * lever, 0.05)) < 1e-15, "{behind_m}: {moves}");
        }
    }

    #[test]
    fn the_map_of_a_point_is_how_the_pose_changes_with_the_tip() {
        let tip = DVec3::new(0.14, -0.17, 0.18);
        let rotation = PIVOT.aligned(DQuat::from_rotation_x(1.0), tip);
        let (local, v, h) = (DVec3::new(0.004, -0.002, -0.06), DVec3::new(0.4, 0.2, -0.3), 1e-6);
        let at = |t: f64| {
            let tip = tip + v * t;
            tip + PIVOT.aligned(rotation, tip) * local
        };
        let central = (at(h) - at(-h)) / (2.0 * h);
        let moves = PIVOT.side(tip, rotation * local).velocity(&[v]);
        assert!(moves.distance(central) < 1e-9, "{moves} and {central}"); // rounding of 0.1 m over 2e-6 s, and h²
        let turned = PIVOT.aligned(rotation, tip + v * h) * PIVOT.aligned(rotation, tip - v * h).conjugate();
        let spin = turned.to_scaled_axis() / (2.0 * h);
        assert!(PIVOT.spin_rad_s(tip, v).distance(spin) < 1e-7, "{spin}"); // the same, over a lever of 0.13 m
    }

    #[test]
    fn a_handle_outside_leads_the_tip_the_other_way() {
        let tip = PIVOT.at_m + DVec3::NEG_Z * 0.1;
        let rotation = PIVOT.aligned(DQuat::IDENTITY, tip);
        let (velocity, spin, jaw) = (DVec3::ZERO, DVec3::ZERO, 1.0);
        let (grasp, admits, force_n, is_idle) = (None, None, 0.0, false);
        let tool = ToolState { tip, led: tip, rotation, velocity, spin, jaw, grasp, admits, force_n, is_idle };
        for local_z in [-0.3, -0.05] {
            let local_m = DVec3::new(0.001, 0.0, local_z);
            let wanted = tip + rotation * local_m + DVec3::X * 1e-4;
            let led = PIVOT.tip_for(&tool, local_m, PointMotion { position: wanted, velocity: DVec3::X });
            let moved = (led.position - tip) / 1e-4;
            // levers of 0.1 m over −0.2 m and over 0.05 m
            let lever = 0.1 / (0.1 + local_z);
            assert!((moved.x - lever).abs() < 2e-2 * lever.abs(), "{moved}, lever {lever}");
            assert!(led.velocity.distance(DVec3::X * lever) < 1e-2, "{}", led.velocity);
        }
    }

    #[test]
    fn a_tip_beyond_reach_is_brought_back_along_the_shaft() {
        let rotation = DQuat::from_rotation_x(std::f64::consts::PI);
        let cases = [
            (DVec3::X * 0.4, DVec3::X * 0.325),
            (DVec3::Y * 0.01, DVec3::Y * 0.025),
            (DVec3::ZERO, DVec3::NEG_Z * 0.025),
        ];
        for (off, expected) in cases {
            let kept = PIVOT.within(PIVOT.at_m + off, rotation);
            assert!(kept.distance(PIVOT.at_m + expected) < 1e-15, "{off}: {kept}");
        }
        let inside = PIVOT.at_m + DVec3::new(0.1, 0.1, 0.0);
        assert_eq!(PIVOT.within(inside, rotation), inside);
    }
}
