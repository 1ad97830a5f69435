//! Solids as parry shapes, for rapier3d and the contact queries of a mesh or a hull.
//!
//! In: a [`Solid`]. Out: a `SharedShape` in the same axes, single precision. Never here: the pose or the mass of the solid.

use super::solid::{COMPOUND_PARTS_MAX, CompoundPart};
use crate::surfaces::topology::is_closed;
use crate::{Aabb, Solid};
use glam::{DVec3, Vec3};
use rapier3d::parry::math::{Pose, Rotation};
use rapier3d::parry::shape::{SharedShape, TriMeshFlags};
use rapier3d::parry::transformation::try_convex_hull;
use std::f32::consts::FRAC_PI_2;

/// Reasons why a solid is not a valid shape.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// A length that must be above zero is zero or negative, or is not finite.
    #[error("{what} is {value_m} m; it must be finite and above zero")]
    BadLength {
        /// The length's name.
        what: &'static str,
        /// The value given, metres.
        value_m: f64,
    },
    /// A corner of a hull or mesh is not finite.
    #[error("point {index} is not finite")]
    BadPoint {
        /// Index of the point, from 0.
        index: usize,
    },
    /// The points of a hull enclose no volume.
    #[error("the hull of {points} points encloses no volume: {why}")]
    FlatHull {
        /// Number of points.
        points: usize,
        /// The finding.
        why: String,
    },
    /// A mesh has no triangle with an area.
    #[error("none of the {triangles} triangles of the mesh has an area above zero")]
    EmptyMesh {
        /// Number of triangles given.
        triangles: usize,
    },
    /// A compound without parts, or with too many.
    #[error("a compound has {parts} parts; expected 1 to {COMPOUND_PARTS_MAX}")]
    BadParts {
        /// How many it has.
        parts: usize,
    },
    /// A compound with a part that cannot be.
    #[error("part {index} of the compound {why}")]
    BadPart {
        /// Number of the part, from 0.
        index: usize,
        /// The fault of the part.
        why: String,
    },
    /// A triangle refers to a corner that does not exist.
    #[error("triangle {triangle} refers to point {corner}, but the mesh has only {points} points")]
    BadCorner {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The corner it refers to.
        corner: u32,
        /// Number of corners.
        points: usize,
    },
}

/// Triangles over points, counter-clockwise seen from outside.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Triangles {
    /// Corners, metres.
    pub points: Vec<DVec3>,
    /// Corner indices of each triangle; none is degenerate.
    pub triangles: Vec<[u32; 3]>,
}

impl Triangles {
    /// The volume that a closed surface encloses, m³; negative where its triangles face inwards.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        // about a point near the surface: far from the origin the differences would lose digits
        let near = self.points[self.triangles[0][0] as usize];
        let corners = self.triangles.iter().map(|t| t.map(|i| self.points[i as usize] - near));
        corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    /// Whether it is closed with outward triangles: only then it has an inside with mass.
    #[must_use]
    pub fn encloses(&self) -> bool {
        is_closed(self) && self.volume_m3() > 0.0
    }
}

/// A mesh whose hull has at most this many times its volume counts as convex.
const HULL_EXCESS: f64 = 1.02;
/// Below this fraction of its longest edge's square a triangle's area counts as zero (single precision resolves 1e-7).
const AREA_SHARE_MIN: f64 = 1e-9;
/// Below this fraction of its size cubed a hull's volume counts as zero.
const VOLUME_SHARE_MIN: f64 = 1e-6;

impl Solid {
    /// The same solid as a parry shape, in the solid's own axes (single precision).
    ///
    /// A plane is a half space with its normal along +z; a cylinder is a compound of one rotated part, because parry's axis is y. A closed
    /// mesh is oriented (it has an inside), an open one is a sheet.
    ///
    /// # Errors
    /// [`ShapeError`] for a length that is not above zero, a point that is not finite, a hull without volume, a mesh without area and a
    /// triangle that refers to a missing corner.
    pub fn to_shared_shape(&self) -> Result<SharedShape, ShapeError> {
        self.check()?;
        Ok(match self {
            Self::Ball { radius_m } => SharedShape::ball(*radius_m as f32),
            Self::Box { half_extents_m: half } => SharedShape::cuboid(half.x as f32, half.y as f32, half.z as f32),
            Self::Capsule { radius_m, half_height_m } => {
                SharedShape::capsule_z(*half_height_m as f32, *radius_m as f32)
            }
            Self::Cylinder { radius_m, half_height_m } => {
                let along_y = SharedShape::cylinder(*half_height_m as f32, *radius_m as f32);
                let turn = Pose::from_parts(Vec3::ZERO, Rotation::from_axis_angle(Vec3::X, FRAC_PI_2));
                SharedShape::compound(vec![(turn, along_y)])
            }
            Self::Plane => SharedShape::halfspace(Vec3::Z),
            Self::Hull { points_m } => {
                let points: Vec<Vec3> = points_m.iter().map(|p| p.as_vec3()).collect();
                hull_triangles(points_m)?;
                SharedShape::convex_hull(&points).ok_or_else(|| flat(points_m, "the faces of the hull do not close"))?
            }
            Self::Compound { parts } => {
                let mut all = Vec::with_capacity(parts.len());
                for CompoundPart { solid, position_m, rotation, .. } in parts.iter() {
                    let (shape, turned) = (solid.to_moving_shape()?, rotation.as_quat());
                    let turn = Rotation::from_xyzw(turned.x, turned.y, turned.z, turned.w);
                    let pose = Pose::from_parts(position_m.as_vec3(), turn);
                    match shape.as_compound() {
                        Some(within) => {
                            all.extend(within.shapes().iter().map(|(at, shape)| (pose * *at, shape.clone())))
                        }
                        None => all.push((pose, shape)),
                    }
                }
                SharedShape::compound(all)
            }
            Self::Mesh { points_m, triangles } => {
                let mesh = mesh_triangles(points_m, triangles)?;
                let flags = if is_closed(&mesh) { TriMeshFlags::ORIENTED } else { TriMeshFlags::empty() };
                let points = mesh.points.iter().map(|p| p.as_vec3()).collect();
                SharedShape::trimesh_with_flags(points, mesh.triangles, flags | TriMeshFlags::FIX_INTERNAL_EDGES)
                    .map_err(|_| ShapeError::EmptyMesh { triangles: triangles.len() })?
            }
        })
    }

    /// The shape of a moving solid: that of [`Self::to_shared_shape`], but a mesh as its convex parts.
    ///
    /// A closed mesh that is not convex is divided (V-HACD, 64³ voxels, concavity 0.01): corners in hollows are rounded by about a
    /// sixty-fourth of its size. Any other mesh counts as its hull.
    ///
    /// # Errors
    /// As [`Self::to_shared_shape`].
    pub(crate) fn to_moving_shape(&self) -> Result<SharedShape, ShapeError> {
        let Self::Mesh { points_m, triangles } = self else { return self.to_shared_shape() };
        let mesh = mesh_triangles(points_m, triangles)?;
        if mesh.encloses() && hull_triangles(points_m)?.volume_m3() > HULL_EXCESS * mesh.volume_m3() {
            let points: Vec<_> = mesh.points.iter().map(|p| p.as_vec3()).collect();
            return Ok(SharedShape::convex_decomposition(&points, &mesh.triangles));
        }
        Self::Hull { points_m: points_m.clone() }.to_shared_shape()
    }

    /// The volume that it encloses, m³: of an open mesh that of its hull, zero of a plane, of a compound the sum over its parts.
    ///
    /// # Errors
    /// [`ShapeError`] as of [`Self::to_shared_shape`].
    pub fn volume_m3(&self) -> Result<f64, ShapeError> {
        use std::f64::consts::PI;
        Ok(match self {
            Self::Ball { radius_m } => 4.0 / 3.0 * PI * radius_m.powi(3),
            Self::Box { half_extents_m } => 8.0 * half_extents_m.element_product(),
            Self::Capsule { radius_m: r, half_height_m: h } => PI * r * r * (4.0 / 3.0 * r + 2.0 * h),
            Self::Cylinder { radius_m: r, half_height_m: h } => PI * r * r * 2.0 * h,
            Self::Plane => 0.0,
            Self::Compound { parts } => {
                let volumes = parts.iter().map(|part| part.solid.volume_m3());
                volumes.sum::<Result<f64, _>>()?
            }
            Self::Hull { points_m } => hull_triangles(points_m)?.volume_m3(),
            Self::Mesh { points_m, triangles } => {
                let mesh = mesh_triangles(points_m, triangles)?;
                if mesh.encloses() { mesh.volume_m3() } else { hull_triangles(points_m)?.volume_m3() }
            }
        })
    }

    /// Checks that every length of the solid is finite and above zero, and every point finite.
    pub fn check(&self) -> Result<(), ShapeError> {
        let length = |what, value_m: f64| {
            let good = value_m.is_finite() && value_m > 0.0;
            if good { Ok(()) } else { Err(ShapeError::BadLength { what, value_m }) }
        };
        match self {
            Self::Ball { radius_m } => length("the radius", *radius_m),
            Self::Box { half_extents_m: half } => {
                half.to_array().into_iter().try_for_each(|h| length("a half extent", h))
            }
            Self::Capsule { radius_m, half_height_m } | Self::Cylinder { radius_m, half_height_m } => {
                length("the radius", *radius_m)?;
                length("the half height", *half_height_m)
            }
            Self::Plane => Ok(()),
            Self::Compound { parts } => check_parts(parts),
            Self::Hull { points_m } | Self::Mesh { points_m, .. } => {
                // single precision must represent them too
                let bad = points_m.iter().position(|p| !p.as_vec3().is_finite());
                bad.map_or(Ok(()), |index| Err(ShapeError::BadPoint { index }))
            }
        }
    }
}

/// The largest coordinate of a part, metres.
const PLACE_MAX_M: f64 = 1e6;
/// The densities of parts against each other: those of the lightest and the heaviest material that a scene file takes.
const DENSITY_RANGE: (f64, f64) = (1e-9, 1e9);

fn check_parts(parts: &[CompoundPart]) -> Result<(), ShapeError> {
    if !(1..=COMPOUND_PARTS_MAX).contains(&parts.len()) {
        return Err(ShapeError::BadParts { parts: parts.len() });
    }
    for (index, CompoundPart { solid, position_m, rotation, density }) in parts.iter().enumerate() {
        let bad = |why: String| Err(ShapeError::BadPart { index, why });
        if matches!(solid, Solid::Plane | Solid::Compound { .. }) {
            return bad("is a plane or a compound itself".to_owned());
        }
        if !(position_m.is_finite() && position_m.abs().max_element() <= PLACE_MAX_M) {
            return bad(format!("is at {position_m}; expected within {PLACE_MAX_M} m along each axis"));
        }
        if !rotation.is_normalized() {
            return bad(format!("is turned by {rotation}; expected a quaternion of length 1"));
        }
        if !(DENSITY_RANGE.0..=DENSITY_RANGE.1).contains(density) {
            return bad(format!("has a density of {density} against others; expected 1e-9 to 1e9"));
        }
        solid.check().or_else(|error| bad(format!("cannot be: {error}")))?;
    }
    Ok(())
}

fn flat(points: &[DVec3], why: impl Into<String>) -> ShapeError {
    ShapeError::FlatHull { points: points.len(), why: why.into() }
}

/// The faces of the convex hull of `points`.
pub fn hull_triangles(points: &[DVec3]) -> Result<Triangles, ShapeError> {
    if points.len() < 4 {
        return Err(flat(points, "a hull needs at least four points"));
    }
    let Aabb { low, high } = Aabb::of(points);
    let size = (high - low).max_element();
    let single: Vec<Vec3> = points.iter().map(|p| p.as_vec3()).collect();
    let (corners, triangles) = try_convex_hull(&single).map_err(|e| flat(points, e.to_string()))?;
    let corners: Vec<DVec3> = corners.iter().map(|p| p.as_dvec3()).collect();
    let volume: f64 =
        triangles.iter().map(|t| t.map(|i| corners[i as usize] - low)).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum();
    if volume > VOLUME_SHARE_MIN * size.powi(3) {
        mesh_triangles(&corners, &triangles)
    } else {
        Err(flat(points, "all points lie in one plane"))
    }
}

/// The triangles of a mesh with a non-zero area.
pub fn mesh_triangles(points: &[DVec3], triangles: &[[u32; 3]]) -> Result<Triangles, ShapeError> {
    let mut kept = Vec::with_capacity(triangles.len());
    for (triangle, &corners) in triangles.iter().enumerate() {
        if let Some(&corner) = corners.iter().find(|&&c| c as usize >= points.len()) {
            return Err(ShapeError::BadCorner { triangle, corner, points: points.len() });
        }
        let [a, b, c] = corners.map(|i| points[i as usize]);
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        if (b - a).cross(c - a).length() > AREA_SHARE_MIN * longest {
            kept.push(corners);
        }
    }
    if kept.is_empty() {
        return Err(ShapeError::EmptyMesh { triangles: triangles.len() });
    }
    Ok(Triangles { points: points.to_vec(), triangles: kept })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners() -> Vec<DVec3> {
        (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1))).collect()
    }

    fn distance(solid: &Solid, point: Vec3) -> f32 {
        solid.to_shared_shape().unwrap().distance_to_local_point(point, false)
    }

    #[test]
    fn every_solid_keeps_its_axes() {
        let one = |solid: &Solid, point: Vec3, expected: f32| {
            let got = distance(solid, point);
            assert!((got - expected).abs() < 1e-5, "{solid:?}: {got}, not {expected}"); // f32: tens of roundings near 4
        };
        let up = Vec3::Z * 4.0;
        one(&Solid::Ball { radius_m: 1.0 }, up, 3.0);
        one(&Solid::Box { half_extents_m: DVec3::new(1.0, 2.0, 3.0) }, up, 1.0);
        one(&Solid::Capsule { radius_m: 1.0, half_height_m: 2.0 }, up, 1.0);
        one(&Solid::Cylinder { radius_m: 1.0, half_height_m: 2.0 }, up, 2.0);
        one(&Solid::Cylinder { radius_m: 1.0, half_height_m: 2.0 }, Vec3::new(3.0, 0.0, 1.9), 2.0);
        one(&Solid::Plane, up, 4.0);
        one(&Solid::Hull { points_m: corners().into() }, up, (9.0_f32).sqrt());
    }

    #[test]
    fn a_hull_without_volume_is_refused() {
        let flat = corners().into_iter().map(|p| p * DVec3::new(1.0, 1.0, 0.0)).collect::<Vec<_>>();
        for points_m in [vec![], corners()[..3].to_vec(), vec![DVec3::ONE; 9], flat] {
            let error = Solid::Hull { points_m: points_m.into() }.to_shared_shape().unwrap_err();
            assert!(matches!(error, ShapeError::FlatHull { .. }), "{error}");
        }
    }

    #[test]
    fn a_mesh_without_area_or_with_a_missing_corner_is_refused() {
        let mesh = |triangles: Vec<[u32; 3]>| Solid::Mesh { points_m: corners().into(), triangles: triangles.into() };
        let refused = |triangles| mesh(triangles).to_shared_shape().unwrap_err();
        assert_eq!(refused(vec![]), ShapeError::EmptyMesh { triangles: 0 });
        assert_eq!(refused(vec![[0, 0, 1]]), ShapeError::EmptyMesh { triangles: 1 });
        assert_eq!(refused(vec![[0, 1, 2], [0, 1, 8]]), ShapeError::BadCorner { triangle: 1, corner: 8, points: 8 });
        assert!(mesh(vec![[0, 1, 2], [0, 1, 1]]).to_shared_shape().is_ok());
    }

    #[test]
    fn a_length_or_point_that_is_no_number_is_refused() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = Solid::Ball { radius_m: bad }.to_shared_shape().unwrap_err();
            assert!(matches!(error, ShapeError::BadLength { .. }), "{error}");
        }
        let points_m = vec![DVec3::ZERO, DVec3::splat(1e39)].into();
        assert_eq!(Solid::Hull { points_m }.to_shared_shape().unwrap_err(), ShapeError::BadPoint { index: 1 });
    }
}
