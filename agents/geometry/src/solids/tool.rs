//! The shape of a grasping tool: jaws, hinge, clevis and shaft as sized primitives in the tool's own axes.
//!
//! In: the opening of the jaws and the size of the shaft. Out: parts to draw. Never here: motion or grasping.
//! The point between the jaws is the origin, jaws point along +z, the shaft runs along −z.

use crate::surfaces::mesh::creased_mesh;
use crate::{Primitive, PrimitiveMesh, Rounding};
use glam::{DQuat, DVec3, Vec3};

/// Dimensions of a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolShape {
    /// Radius of the shaft, metres, > 0. Everything near the tip is proportional to it.
    pub shaft_radius_m: f64,
    /// Length of the shaft, metres, > 0.
    pub shaft_length_m: f64,
}

impl Default for ToolShape {
    /// A laparoscopic grasper: 5 mm across, 30 cm long.
    fn default() -> Self {
        Self { shaft_radius_m: 2.5e-3, shaft_length_m: 0.3 }
    }
}

/// One part of a tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolPart {
    /// The shape.
    pub primitive: Primitive,
    /// The size.
    pub size: Rounding,
    /// Position in the tool's axes, metres.
    pub position: DVec3,
    /// Rotation from the part's axes to the tool's.
    pub rotation: DQuat,
}

/// Swing of each jaw from shut to wide open, radians.
const JAW_SWING_RAD: f64 = 0.52;
/// Length of the jaws in shaft radii.
const JAW_LENGTH: f64 = 8.0;
/// Fraction of the jaws' length behind the point between them.
const JAW_BEHIND: f64 = 0.75;
/// Distance from the hinge to the shaft in shaft radii.
const RING_BEHIND: f64 = 4.0;

impl ToolShape {
    /// No point of it is farther from the point between its jaws, metres.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        // behind the jaws come clevis and ring, then the shaft; wide open jaws reach five radii to the side
        let Self { shaft_radius_m: r, shaft_length_m } = *self;
        (10.0 * r + shaft_length_m).hypot(5.0 * r)
    }

    /// Distance from the point between the jaws to the front end of the shaft, metres: jaws, clevis and ring are within it.
    #[must_use]
    pub fn shaft_from_m(&self) -> f64 {
        (JAW_BEHIND * JAW_LENGTH + RING_BEHIND) * self.shaft_radius_m
    }

    /// The parts of the tool with its jaws `jaw` open (0 shut … 1 wide open).
    #[must_use]
    pub fn parts(&self, jaw: f64) -> [ToolPart; 6] {
        let r = self.shaft_radius_m;
        let hinge = DVec3::new(0.0, 0.0, -JAW_BEHIND * JAW_LENGTH * r);
        let swing = JAW_SWING_RAD * jaw.clamp(0.0, 1.0);
        let length = (JAW_LENGTH * r) as f32;
        let jaw_at = |rotation| ToolPart {
            primitive: Primitive::Jaw,
            size: Rounding { extents: Vec3::splat(length), radius_m: 0.0 },
            position: hinge,
            rotation,
        };
        let round = |radius: f64, half: f64, position: DVec3, rotation: DQuat| {
            let rim = 0.15 * radius;
            let (across, along) = ((radius - rim) as f32, (half - rim) as f32);
            ToolPart {
                primitive: Primitive::Cylinder,
                size: Rounding { extents: Vec3::new(across, across, along), radius_m: rim as f32 },
                position,
                rotation,
            }
        };
        let across = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
        let straight = DQuat::IDENTITY;
        let behind = |distance: f64| hinge - DVec3::Z * (distance * r);
        let shaft = 0.5 * self.shaft_length_m;
        let half_turn = DQuat::from_rotation_z(std::f64::consts::PI);
        [
            jaw_at(DQuat::from_rotation_y(swing)),
            jaw_at(DQuat::from_rotation_y(-swing) * half_turn),
            round(0.55 * r, 1.02 * r, hinge, across),
            round(0.82 * r, 1.5 * r, behind(1.6), straight),
            round(1.12 * r, 0.7 * r, behind(3.6), straight),
            round(r, shaft, behind(RING_BEHIND) - DVec3::Z * shaft, straight),
        ]
    }

    /// The velocity of the point `local_m` of the skin, in the tool's axes, while the jaws open by `rate_per_s` of their way a second, m/s.
    #[must_use]
    pub fn opening_m_s(&self, local_m: DVec3, rate_per_s: f64) -> DVec3 {
        let hinge = DVec3::new(0.0, 0.0, -JAW_BEHIND * JAW_LENGTH * self.shaft_radius_m);
        let arm = local_m - hinge;
        // a point behind the hinge is on no jaw; one jaw is on either side of the middle
        let swing = if arm.z > 0.0 { JAW_SWING_RAD * rate_per_s * local_m.x.signum() } else { 0.0 };
        (DVec3::Y * swing).cross(arm)
    }

    /// Triangles of the tool at level `n`.
    #[must_use]
    pub const fn triangles(n: u8) -> u32 {
        2 * Primitive::Jaw.triangles(n) + 4 * Primitive::Cylinder.triangles(n)
    }
}

/// Corners around one section of a jaw at level n.
const fn jaw_corners(n: u8) -> u32 {
    4 + 2 * (n / 2) as u32
}

/// Sections along a jaw at level n.
const fn jaw_sections(n: u8) -> u32 {
    3 + (n as u32) * 2
}

/// Triangles of a jaw at level `n`: its skin and its two ends.
pub(crate) const fn jaw_triangles(n: u8) -> u32 {
    let (corners, sections) = (jaw_corners(n), jaw_sections(n));
    2 * corners * (sections - 1) + 2 * (corners - 2)
}

/// A jaw 1 long along z: a half round that tapers to the tip, flat with teeth on the biting side (−x).
pub(crate) fn jaw(n: u8) -> PrimitiveMesh {
    let (corners, sections) = (jaw_corners(n), jaw_sections(n));
    let mut points = Vec::new();
    for section in 0..sections {
        let z = f64::from(section) / f64::from(sections - 1);
        let width = 0.115 * (1.0 - 0.55 * z * z) * if section + 1 == sections { 0.55 } else { 1.0 };
        let thickness = 0.10 * (1.0 - 0.6 * z) * if section + 1 == sections { 0.6 } else { 1.0 };
        // teeth: the bite of every other section is recessed
        let bite = if section % 2 == 1 && section + 1 < sections { 0.014 } else { 0.0 };
        for corner in 0..corners {
            let angle = std::f64::consts::PI * f64::from(corner) / f64::from(corners - 1);
            let (sin, cos) = (libm::sin(angle), libm::cos(angle));
            points.push(DVec3::new(bite + thickness * sin, -width * cos, z));
        }
    }
    let mut triangles = Vec::new();
    for section in 0..sections - 1 {
        for corner in 0..corners {
            let next = (corner + 1) % corners;
            let (a, b) = (section * corners + corner, section * corners + next);
            let (c, d) = (a + corners, b + corners);
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    let end = (sections - 1) * corners;
    for corner in 1..corners - 1 {
        triangles.push([0, corner + 1, corner]);
        triangles.push([end, end + corner, end + corner + 1]);
    }
    creased_mesh(&points, &triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shut_jaws_meet_between_them_and_open_ones_do_not() {
        let shape = ToolShape::default();
        let tip = |jaw: f64, part: usize| {
            let part = shape.parts(jaw)[part];
            part.position + part.rotation * DVec3::Z * f64::from(part.size.extents.z)
        };
        assert!((tip(0.0, 0) - tip(0.0, 1)).length() < 1e-12);
        // each jaw swings by 0.52 rad over 20 mm
        let gap = 2.0 * 8.0 * shape.shaft_radius_m * 0.52_f64.sin();
        assert!((tip(1.0, 0).distance(tip(1.0, 1)) - gap).abs() < 1e-6);
        // the first jaw opens towards +x
        assert!(tip(1.0, 0).x > 0.0);
    }

    #[test]
    fn jaw_faces_point_out() {
        let mesh = jaw(4);
        let volume: f32 = mesh
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| mesh.vertices[i as usize].core);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        assert!(volume > 0.0, "{volume}");
    }
}
