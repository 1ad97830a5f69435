//! A mesh that can be drawn with any number of triangles: the totally ordered mesh of (GB99).
//!
//! In: a triangle mesh. Out: a [`ProgressiveMesh`], whose first n triangles are a coarser mesh for every n, with its error.
//! Never here: the choice of the count, the GPU. Theory: `docs/theory/multiresolution.md`.
//!
//! Vertices are removed one position after another, each collapsed onto a neighbour, the cheapest by the quadric error (GH97) first.
//! Vertices and triangles are then sorted in reverse order of removal: the mesh of a count is a prefix of both lists, whose removed corners
//! are replaced by following their substitutes. The substitute of each vertex is the only data stored in addition to a plain indexed mesh:
//! the birth of a triangle follows from them.
//!
//! The last part of several that are left alone is a shard of the thing; where the box around all is nearer, that is the coarsest mesh
//! instead (`hull_box.rs`).

mod build;
mod error;
mod hull_box;
mod quadric;
mod topology;
mod weld;

#[cfg(test)]
mod tests;

use metachron_geometry::{PrimitiveMesh, PrimitiveVertex};
use std::sync::OnceLock;
pub use weld::ProgressiveMeshError;
use weld::SAME_PLACE;

/// Forms of which the loss is measured (`likeness.rs`): from the fewest triangles to all in equal ratios.
pub const FORMS: usize = 9;

/// A mesh of any number of triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct ProgressiveMesh {
    /// Corners in reverse order of removal; the normals of a crease are separate, consecutive vertices.
    vertices: Vec<PrimitiveVertex>,
    /// Vertex indices of each triangle of the full mesh, in reverse order of removal.
    triangles: Vec<[u32; 3]>,
    /// The vertex that replaces each one, of lower index. A vertex that is never removed refers to itself, and so does the last one of a
    /// part that vanishes entirely.
    substitutes: Vec<u32>,
    coarsest: Cut,
    /// Fewer triangles than these are drawn as the coarsest cut.
    least: u32,
    /// (triangles, error in metres), from coarse to fine.
    errors: Vec<(u32, f32)>,
    /// [`crate::Model::losses`], once they are asked for.
    pub(crate) losses: OnceLock<[f32; FORMS]>,
}

/// One of the meshes of a [`ProgressiveMesh`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Cut {
    /// Number of vertices used, from the first.
    pub vertices: u32,
    /// Number of triangles, from the first.
    pub triangles: u32,
}

impl ProgressiveMesh {
    /// Computes the order of a mesh.
    ///
    /// Triangles without area (two corners at one position) are left out, all others are unchanged.
    ///
    /// # Errors
    /// [`ProgressiveMeshError`] where a triangle refers to a missing vertex, a position is not finite or no triangle is left.
    pub fn new(mesh: &PrimitiveMesh) -> Result<Self, ProgressiveMeshError> {
        let welded = weld::Welded::new(mesh)?;
        Ok(Self::boxed(&welded).unwrap_or_else(|| build::ordered(&welded, &[])))
    }

    /// The order of a mesh of several parts that ends in a box; `None` where its coarsest cut would be none, or one that is further than the
    /// last part itself.
    fn boxed(welded: &weld::Welded) -> Option<Self> {
        let mut tom = build::ordered(welded, &hull_box::corners(welded)?);
        let of_part = error::distance(&tom, hull_box::TRIANGLES);
        let mut faces = Vec::with_capacity(hull_box::TRIANGLES as usize);
        tom.resolve(tom.coarsest, &mut faces);
        let Self { vertices, triangles, substitutes, .. } = &mut tom;
        tom.coarsest.vertices = hull_box::prepend(hull_box::Order { vertices, triangles, substitutes }, &faces)?;
        tom.least = hull_box::TRIANGLES + 1;
        let of_box = error::distance(&tom, hull_box::TRIANGLES);
        let finer = tom.errors.iter().find(|row| f64::from(row.1) < of_box);
        tom.least = finer.map_or(tom.triangles.len() as u32, |row| row.0);
        tom.errors = error::table(&tom);
        (of_box < of_part && tom.least <= hull_box::NEXT_MOST).then_some(tom)
    }

    /// The same mesh without its finest cuts: its full mesh is the cut of at most `triangles`, and errors are relative to that.
    #[must_use]
    pub fn truncated(mut self, triangles: u32) -> Self {
        let cut = self.cut(triangles);
        let mut full = Vec::with_capacity(cut.triangles as usize);
        self.resolve(cut, &mut full);
        self.triangles = full;
        self.vertices.truncate(cut.vertices as usize);
        self.substitutes.truncate(cut.vertices as usize);
        self.errors = error::table(&self);
        self.losses = OnceLock::new();
        self
    }

    /// The same mesh without the cuts that are coarser than the one of at most `triangles`.
    #[must_use]
    pub fn no_coarser(mut self, triangles: u32) -> Self {
        self.coarsest = self.cut(triangles);
        self.least = self.least.max(self.coarsest.triangles);
        self.losses = OnceLock::new();
        self
    }

    /// The vertices, in the order in which cuts use them.
    #[must_use]
    pub fn vertices(&self) -> &[PrimitiveVertex] {
        &self.vertices
    }

    /// Triangles of the coarsest and of the full mesh.
    #[must_use]
    pub fn range(&self) -> (u32, u32) {
        (self.coarsest.triangles, self.triangles.len() as u32)
    }

    /// The finest mesh of at most `triangles`; the coarsest where that has more.
    ///
    /// A vertex usually removes two triangles with it, so the cut has at most a few fewer than requested; where the coarsest is a box, also
    /// the next finer ones that are further from the full mesh are left out.
    #[must_use]
    pub fn cut(&self, triangles: u32) -> Cut {
        if triangles < self.least {
            return self.coarsest;
        }
        let asked = triangles as usize;
        let Some(next) = self.triangles.get(asked) else {
            return Cut { vertices: self.vertices.len() as u32, triangles: self.triangles.len() as u32 };
        };
        let vertices = self.birth(*next);
        let count = self.triangles[..asked].partition_point(|t| self.birth(*t) < vertices);
        Cut { vertices, triangles: count as u32 }
    }

    /// Vertex indices of the triangles of `cut`, appended to `corners`; time proportional to their count.
    pub fn resolve(&self, cut: Cut, corners: &mut Vec<[u32; 3]>) {
        let standing = |corner: u32| self.standing(corner, cut.vertices);
        corners.extend(self.triangles[..cut.triangles as usize].iter().map(|t| t.map(standing)));
    }

    /// The vertex that represents another in a cut of `vertices`; for a part that vanished, its last vertex.
    #[must_use]
    pub fn standing(&self, mut vertex: u32, vertices: u32) -> u32 {
        while vertex >= vertices {
            match self.substitute(vertex) {
                last if last == vertex => break,
                next => vertex = next,
            }
        }
        vertex
    }

    /// A vertex of a finer cut morphed to a coarser one of `coarser` vertices: at `share` 0 at its own position, at 1 at its substitute's.
    /// A mesh morphed to 1 covers the same surface as the coarser one, so a change of cut is invisible there.
    #[must_use]
    pub fn morphed(&self, vertex: u32, coarser: u32, share: f32) -> PrimitiveVertex {
        let from = self.vertices[vertex as usize];
        let to = self.vertices[self.standing(vertex, coarser) as usize];
        let normal = from.normal.lerp(to.normal, share).try_normalize().unwrap_or(to.normal);
        PrimitiveVertex { core: from.core.lerp(to.core, share), normal, uv: from.uv.lerp(to.uv, share) }
    }

    /// Distance of the full mesh from the cut of `triangles`, metres: the greatest of a sample of its vertices.
    /// The error never decreases as the count decreases.
    #[must_use]
    pub fn error_m(&self, triangles: u32) -> f64 {
        error::at(&self.errors, if triangles < self.least { self.coarsest.triangles } else { triangles })
    }

    /// Bytes of its storage, and those of a plain indexed mesh of the same vertices and triangles.
    #[must_use]
    pub fn bytes(&self) -> (usize, usize) {
        let plain = size_of_val(&self.vertices[..]) + size_of_val(&self.triangles[..]);
        (plain + size_of_val(&self.substitutes[..]) + size_of_val(&self.errors[..]), plain)
    }

    fn substitute(&self, vertex: u32) -> u32 {
        self.substitutes[vertex as usize] & !SAME_PLACE
    }

    /// The first vertex at the same position.
    fn first_here(&self, mut vertex: u32) -> u32 {
        while self.substitutes[vertex as usize] & SAME_PLACE != 0 {
            vertex -= 1;
        }
        vertex
    }

    /// A triangle is part of every cut of more vertices than this: 0 for one that is never removed.
    ///
    /// Its last corner is replaced by its substitute until two corners coincide.
    fn birth(&self, mut t: [u32; 3]) -> u32 {
        loop {
            t.sort_unstable();
            let next = self.substitute(t[2]);
            if next == t[2] {
                return 0;
            }
            let place = self.vertices[next as usize].core;
            if t[..2].iter().any(|&other| self.vertices[other as usize].core == place) {
                return self.first_here(t[2]);
            }
            t[2] = next;
        }
    }
}
