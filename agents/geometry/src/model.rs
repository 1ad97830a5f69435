//! What can be drawn with any number of triangles and where it stands; and one mesh for many of them (a proxy).
//!
//! In: meshes and foliage with their places. Out: counts, a ball around each, a coarse mesh of all. Never here: looks, the GPU.

use super::{Foliage, PrimitiveMesh, PrimitiveVertex, Rung, Tom, TomError, hull_mesh};
use glam::{DQuat, DVec3};
use std::sync::Arc;

/// What is drawn with any number of triangles; copies share it.
#[derive(Debug, Clone)]
pub enum Model {
    /// A mesh of any number of triangles.
    Mesh(Arc<Tom>),
    /// Pieces in rungs.
    Foliage(Arc<Foliage>),
}

/// Where a model stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Where its axes start, metres.
    pub position: DVec3,
    /// How it is turned.
    pub rotation: DQuat,
    /// What its coordinates are multiplied by to be metres, > 0.
    pub scale: f64,
}

/// A ball that holds a model, and the model's surface, in its own coordinates.
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
    /// A point of the model in the world, metres.
    #[must_use]
    pub fn place(&self, point: DVec3) -> DVec3 {
        self.position + self.rotation * (point * self.scale)
    }
}

impl Model {
    /// The fewest triangles that are drawn of it, and all.
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

    /// How large it is at its finest.
    #[must_use]
    pub fn extent(&self) -> Extent {
        let mesh = self.mesh(u32::MAX);
        let places = || mesh.vertices.iter().map(|v| v.core.as_dvec3());
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

    /// Its mesh of at most so many triangles (its fewest where that is more); pieces as a prefix of their mesh.
    fn mesh(&self, triangles: u32) -> PrimitiveMesh {
        match self {
            Self::Mesh(tom) => {
                let cut = tom.cut(triangles);
                let mut corners = Vec::with_capacity(cut.triangles as usize);
                tom.resolve(cut, &mut corners);
                PrimitiveMesh { vertices: tom.vertices()[..cut.vertices as usize].to_vec(), triangles: corners }
            }
            Self::Foliage(foliage) => {
                let Some(Rung::Mesh(mesh)) = foliage.rungs().last() else { return PrimitiveMesh::default() };
                let count = mesh.triangles.len().min(triangles as usize);
                PrimitiveMesh { vertices: mesh.vertices.clone(), triangles: mesh.triangles[..count].to_vec() }
            }
        }
    }

    /// Its part of a proxy: of pieces the hull around them.
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

/// How many times the proxy's triangles its members bring along before they are thinned together.
const RICHER: u32 = 8;

/// One mesh of at most `triangles` triangles for all `parts`, made of coarse meshes of each, in coordinates about `origin`.
///
/// # Errors
/// [`TomError`] where the parts have no triangle that can be drawn.
pub fn proxy(parts: &[(Model, Placement)], origin: DVec3, triangles: u32) -> Result<Tom, TomError> {
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
    Ok(Tom::new(&mesh)?.truncated(triangles))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Generator, TreeSpec, generate, tree};

    fn ball() -> Model {
        Model::Mesh(Arc::new(Tom::new(&generate(Generator::Sphere, 0, 500)).unwrap()))
    }

    #[test]
    fn extent_of_a_sphere_is_the_spheres() {
        let extent = ball().extent();
        // chords of a grid of 7 cells a quarter turn
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
