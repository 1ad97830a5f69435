//! Models that can be drawn with any number of triangles, their placement, and one mesh for many of them (a proxy).
//!
//! In: meshes and foliage with their placements. Out: counts, a bounding ball of each, a coarse mesh of all. Never here: appearance, the
//! GPU.

use crate::{Foliage, ProgressiveMesh, ProgressiveMeshError};
use glam::{DQuat, DVec3};
use metachron_geometry::{PrimitiveMesh, PrimitiveVertex, hull_mesh};
use std::sync::Arc;

/// Geometry drawn with any number of triangles; copies share it.
#[derive(Debug, Clone)]
pub enum Model {
    /// A mesh of any number of triangles.
    Mesh(Arc<ProgressiveMesh>),
    /// Foliage: pieces as strokes and in full.
    Foliage(Arc<Foliage>),
}

/// Pose and scale of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Origin of its axes, metres.
    pub position: DVec3,
    /// Rotation from its axes to the world's.
    pub rotation: DQuat,
    /// Factor from its coordinates to metres, > 0.
    pub scale: f64,
}

/// A bounding ball of a model and the model's surface area, in its own coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Extent {
    /// Centre of the ball.
    pub centre: DVec3,
    /// Its radius.
    pub radius: f64,
    /// Area of all triangles.
    pub area: f64,
}

impl Placement {
    /// The position of a point of the model in the world, metres.
    #[must_use]
    pub fn place(&self, point: DVec3) -> DVec3 {
        self.position + self.rotation * (point * self.scale)
    }
}

impl Model {
    /// The fewest triangles that can be drawn of it, and all.
    #[must_use]
    pub fn range(&self) -> (u32, u32) {
        match self {
            Self::Mesh(tom) => tom.range(),
            Self::Foliage(foliage) => foliage.range(),
        }
    }

    /// Whether both share their data.
    #[must_use]
    pub fn is(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Mesh(a), Self::Mesh(b)) => Arc::ptr_eq(a, b),
            (Self::Foliage(a), Self::Foliage(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }

    /// Its size at its finest.
    #[must_use]
    pub fn extent(&self) -> Extent {
        let mesh = self.mesh(u32::MAX);
        let places = || mesh.triangles.iter().flatten().map(|&i| mesh.vertices[i as usize].core.as_dvec3());
        let (Some(low), Some(high)) = (places().reduce(DVec3::min), places().reduce(DVec3::max)) else {
            return Extent::default();
        };
        let centre = 0.5 * (low + high);
        let area = mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| mesh.vertices[i as usize].core.as_dvec3());
            0.5 * (b - a).cross(c - a).length()
        });
        Extent { centre, radius: places().map(|p| p.distance(centre)).fold(0.0, f64::max), area: area.sum() }
    }

    /// Its mesh of at most `triangles` (its fewest where that is more); foliage as a prefix of its mesh.
    pub(crate) fn mesh(&self, triangles: u32) -> PrimitiveMesh {
        match self {
            Self::Mesh(tom) => {
                let cut = tom.cut(triangles);
                let mut corners = Vec::with_capacity(cut.triangles as usize);
                tom.resolve(cut, &mut corners);
                PrimitiveMesh { vertices: tom.vertices()[..cut.vertices as usize].to_vec(), triangles: corners }
            }
            Self::Foliage(foliage) => {
                let mesh = foliage.mesh();
                let count = mesh.triangles.len().min(triangles as usize);
                PrimitiveMesh { vertices: mesh.vertices.clone(), triangles: mesh.triangles[..count].to_vec() }
            }
        }
    }

    /// Its part of a proxy: for foliage the convex hull of the pieces.
    fn coarse(&self, triangles: u32) -> PrimitiveMesh {
        match self {
            Self::Mesh(_) => self.mesh(triangles),
            Self::Foliage(_) => {
                let points: Vec<DVec3> = self.mesh(u32::MAX).vertices.iter().map(|v| v.core.as_dvec3()).collect();
                hull_mesh(&points).unwrap_or_default()
            }
        }
    }
}

/// Triangles of all members together before they are simplified as one, as a multiple of the proxy's.
const RICHER: u32 = 8;

/// One mesh of at most `triangles` triangles for all `parts`, made of coarse meshes of each, in coordinates about `origin`.
///
/// # Errors
/// [`ProgressiveMeshError`] where the parts have no triangle that can be drawn.
pub fn proxy(
    parts: &[(Model, Placement)],
    origin: DVec3,
    triangles: u32,
) -> Result<ProgressiveMesh, ProgressiveMeshError> {
    let share = (RICHER * triangles).div_ceil(parts.len().max(1) as u32).max(4);
    let mut mesh = PrimitiveMesh::default();
    for (model, at) in parts {
        let first = mesh.vertices.len() as u32;
        let own = model.coarse(share);
        mesh.vertices.extend(own.vertices.iter().map(|v| PrimitiveVertex {
            core: (at.place(v.core.as_dvec3()) - origin).as_vec3(),
            normal: (at.rotation * v.normal.as_dvec3()).as_vec3(),
            uv: v.uv,
        }));
        mesh.triangles.extend(own.triangles.iter().map(|t| t.map(|i| first + i)));
    }
    Ok(ProgressiveMesh::new(&mesh)?.truncated(triangles))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate;
    use crate::{Generator, TreeSpec, tree};

    fn ball() -> Model {
        Model::Mesh(Arc::new(ProgressiveMesh::new(&generate(Generator::Sphere, 0, 500)).unwrap()))
    }

    #[test]
    fn extent_of_a_sphere_is_the_spheres() {
        let extent = ball().extent();
        // chords of a grid with 7 cells per quarter turn
        assert!(extent.centre.length() < 1e-6 && (extent.radius - 1.0).abs() < 1e-6, "{extent:?}");
        assert!((extent.area / (4.0 * std::f64::consts::PI) - 1.0).abs() < 0.02, "{extent:?}");
    }

    #[test]
    fn a_proxy_stands_where_its_parts_stand_with_the_triangles_asked_for() {
        let [trunk, leaves] =
            tree(&TreeSpec { seed: 1, height_m: 4.0, branches: 20, leaves: 50, prefix: false }).map(Arc::new);
        let row: Vec<(Model, Placement)> = (0..12)
            .map(|i| {
                let position = DVec3::X * (3.0 * f64::from(i));
                let model =
                    [ball(), Model::Foliage(trunk.clone()), Model::Foliage(leaves.clone())][i as usize % 3].clone();
                (model, Placement { position, rotation: DQuat::IDENTITY, scale: 0.5 })
            })
            .collect();
        let origin = DVec3::X * 16.5;
        let tom = proxy(&row, origin, 300).unwrap();
        assert!(tom.range().1 <= 300 && tom.range().1 > 250, "{:?}", tom.range());
        let places = || tom.vertices().iter().map(|v| v.core.as_dvec3() + origin);
        assert!(places().all(|p| p.x > -1.5 && p.x < 36.0 && p.y.abs() < 4.0));
        assert!(places().any(|p| p.x < 1.0) && places().any(|p| p.x > 31.0));
    }
}
