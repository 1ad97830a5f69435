//! The normals of a skin: one at each vertex of a sheet, and of a solid one for each surface that meets there.
//!
//! In: vertices and triangles. Out: normals, and the surfaces that share none of them. Never here: corners, levels.

use glam::DVec3;
use metachron_core::SoftState;
use metachron_geometry::SurfaceShape;

/// Triangles of a solid that share a vertex are shaded as one surface where the cosine between them is at least this, 60°: the bends of a
/// soft body stay smooth, the edges of its shape stay sharp.
const SMOOTH_COS: f64 = 0.5;

/// The surfaces that meet at each vertex of a solid: the first has the vertex's number, others are stored after all vertices.
#[derive(Debug, Default)]
pub(super) struct Faces {
    pub(super) all: Vec<Face>,
    /// Corners of each triangle, by face.
    pub(super) triangles: Vec<[u32; 3]>,
}

/// One surface at a vertex.
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    pub(super) vertex: u32,
    /// The normal of its first triangle; zero until that is known.
    first: DVec3,
    /// The area-weighted sum of its triangles' normals.
    pub(super) sum: DVec3,
    /// The next surface at this vertex.
    next: Option<u32>,
}

impl Faces {
    /// Finds the surfaces of a solid as it is now.
    pub(super) fn find(&mut self, form: &SurfaceShape, soft: &SoftState) {
        let empty = |vertex| Face { vertex, first: DVec3::ZERO, sum: DVec3::ZERO, next: None };
        self.all.clear();
        self.all.extend((0..soft.positions.len() as u32).map(empty));
        self.triangles.clear();
        for triangle in form.triangles.iter() {
            let [a, b, c] = triangle.map(|vertex| soft.positions[vertex as usize]);
            let normal = (b - a).cross(c - a);
            let faces = triangle.map(|vertex| self.face(vertex, normal.normalize_or_zero()));
            faces.iter().for_each(|face| self.all[*face as usize].sum += normal);
            self.triangles.push(faces);
        }
    }

    /// The surface at `vertex` that a triangle with this normal belongs to; a degenerate triangle belongs to the first.
    fn face(&mut self, vertex: u32, normal: DVec3) -> u32 {
        let mut at = vertex;
        loop {
            let face = &mut self.all[at as usize];
            if face.first == DVec3::ZERO {
                face.first = normal;
            }
            if normal == DVec3::ZERO || face.first.dot(normal) >= SMOOTH_COS {
                return at;
            }
            match face.next {
                Some(next) => at = next,
                None => break,
            }
        }
        let new = self.all.len() as u32;
        self.all[at as usize].next = Some(new);
        self.all.push(Face { vertex, first: normal, sum: DVec3::ZERO, next: None });
        new
    }
}

/// The mean normal at every vertex of a sheet, weighted by area.
pub(super) fn vertex_normals(form: &SurfaceShape, soft: &SoftState, normals: &mut Vec<DVec3>) {
    normals.clear();
    normals.resize(soft.positions.len(), DVec3::ZERO);
    for triangle in form.triangles.iter() {
        let [a, b, c] = triangle.map(|vertex| soft.positions[vertex as usize]);
        let normal = (b - a).cross(c - a);
        triangle.iter().for_each(|vertex| normals[*vertex as usize] += normal);
    }
    normals.iter_mut().for_each(|normal| *normal = normal.normalize_or(DVec3::Z));
}
