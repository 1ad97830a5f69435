//! A mesh with unique positions: collapses act on positions; the normals and texture coordinates at a position are its wedges.
//!
//! In: a mesh as given. Out: positions, wedges, triangles with an area. Never here: order.

use glam::Vec3;
use metachron_geometry::{PrimitiveMesh, PrimitiveVertex};
use std::collections::BTreeMap;

/// Flag in the substitute of a vertex at the same position as the one before it (a crease).
pub(super) const SAME_PLACE: u32 = 1 << 31;

/// Reasons why a mesh cannot be ordered.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ProgressiveMeshError {
    /// A position is not finite.
    #[error("vertex {vertex} is not finite")]
    NotFinite {
        /// Index of the vertex, from 0.
        vertex: usize,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error("triangle {triangle} refers to vertex {corner}, but the mesh has only {vertices} vertices")]
    BadCorner {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// The vertex it refers to.
        corner: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// No triangle has three corners at different positions.
    #[error("none of the {triangles} triangles of the mesh has three different corners")]
    Empty {
        /// Number of triangles.
        triangles: usize,
    },
    /// More vertices or triangles than can be indexed.
    #[error("the mesh has {count} vertices or triangles; at most {} are supported", ProgressiveMeshError::MOST)]
    TooLarge {
        /// Number of vertices or triangles, whichever is greater.
        count: usize,
    },
}

impl ProgressiveMeshError {
    /// Most vertices, and most triangles.
    pub const MOST: usize = 1 << 30;
}

/// A mesh with unique positions.
#[derive(Debug, Default)]
pub(super) struct Welded {
    /// Positions.
    pub places: Vec<Vec3>,
    /// Every distinct combination of position, normal and texture coordinates that a triangle uses.
    pub wedges: Vec<PrimitiveVertex>,
    /// The position of each wedge.
    pub place_of: Vec<u32>,
    /// Wedges of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Welded {
    pub fn new(mesh: &PrimitiveMesh) -> Result<Self, ProgressiveMeshError> {
        check(mesh)?;
        let mut welded = Self::default();
        let (mut places, mut wedges) = (BTreeMap::new(), BTreeMap::new());
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.vertices[i as usize].core + Vec3::ZERO);
            if a == b || b == c || c == a {
                continue;
            }
            let triangle = t.map(|i| welded.wedge(mesh.vertices[i as usize], &mut places, &mut wedges));
            welded.triangles.push(triangle);
        }
        if welded.triangles.is_empty() {
            return Err(ProgressiveMeshError::Empty { triangles: mesh.triangles.len() });
        }
        Ok(welded)
    }

    fn wedge(
        &mut self,
        vertex: PrimitiveVertex,
        places: &mut BTreeMap<[u32; 3], u32>,
        wedges: &mut BTreeMap<[u32; 8], u32>,
    ) -> u32 {
        // adding zero makes -0.0 equal to 0.0
        let core = vertex.core + Vec3::ZERO;
        let (p, n) = (core.to_array().map(f32::to_bits), (vertex.normal + Vec3::ZERO).to_array().map(f32::to_bits));
        let uv = vertex.uv.to_array().map(f32::to_bits);
        let place = *places.entry(p).or_insert_with(|| {
            self.places.push(core);
            self.places.len() as u32 - 1
        });
        *wedges.entry([p[0], p[1], p[2], n[0], n[1], n[2], uv[0], uv[1]]).or_insert_with(|| {
            self.wedges.push(PrimitiveVertex { core, ..vertex });
            self.place_of.push(place);
            self.wedges.len() as u32 - 1
        })
    }
}

fn check(mesh: &PrimitiveMesh) -> Result<(), ProgressiveMeshError> {
    let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
    if vertices.max(triangles) > ProgressiveMeshError::MOST {
        return Err(ProgressiveMeshError::TooLarge { count: vertices.max(triangles) });
    }
    if let Some(vertex) = mesh.vertices.iter().position(|v| !v.core.is_finite()) {
        return Err(ProgressiveMeshError::NotFinite { vertex });
    }
    for (triangle, t) in mesh.triangles.iter().enumerate() {
        if let Some(&corner) = t.iter().find(|i| **i as usize >= vertices) {
            return Err(ProgressiveMeshError::BadCorner { triangle, corner, vertices });
        }
    }
    Ok(())
}
