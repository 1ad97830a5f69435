//! A mesh that can be drawn with any number of triangles: the totally ordered mesh of (GB99).
//!
//! In: a triangle mesh. Out: a [`Tom`], whose first n triangles are a coarser mesh for every n, with its error.
//! Never here: which count is right, the GPU. Theory: `docs/theory/multiresolution.md`.
//!
//! Vertices are taken away one position after the other, each put in the place of a neighbour, the cheapest by the quadric error
//! (GH97) first. Vertices and triangles are then sorted so that what goes first stands last: the mesh of a count is a prefix of
//! both lists, whose corners that are no longer there are followed to their substitutes. The substitute of each vertex is all
//! that is stored beside a plain indexed mesh: when a triangle is born follows from them.

mod build;
mod error;
mod quadric;
mod topology;
mod weld;

#[cfg(test)]
mod tests;

use super::{PrimitiveMesh, PrimitiveVertex};
pub use weld::TomError;

/// A vertex that stands at the same position as the one before it (a crease) has this bit beside its substitute.
const SAME_PLACE: u32 = 1 << 31;

/// A mesh of any number of triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct Tom {
    /// Corners, those that go last first; the normals of a crease are vertices of their own, side by side.
    vertices: Vec<PrimitiveVertex>,
    /// Vertex numbers of each triangle of the full mesh, those that go last first.
    triangles: Vec<[u32; 3]>,
    /// The vertex that takes each one's place, a lesser number. A vertex that never goes names itself, and so does the last one
    /// of a part that vanishes whole.
    substitutes: Vec<u32>,
    /// Triangles of the coarsest cut.
    least: u32,
    /// (triangles, error in metres), from coarse to fine.
    errors: Vec<(u32, f32)>,
}

/// One of the meshes that a [`Tom`] holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Cut {
    /// How many of the first vertices it uses.
    pub vertices: u32,
    /// How many of the first triangles it has.
    pub triangles: u32,
}

impl Tom {
    /// Orders a mesh.
    ///
    /// Triangles without area (two corners at one position) are left out, all others stay as they are.
    ///
    /// # Errors
    /// [`TomError`] where a triangle names a corner that is not there, a position is not finite or nothing is left.
    pub fn new(mesh: &PrimitiveMesh) -> Result<Self, TomError> {
        let welded = weld::Welded::new(mesh)?;
        let mut tom = build::ordered(welded);
        tom.least = tom.triangles.partition_point(|t| tom.birth(*t) == 0) as u32;
        tom.errors = error::table(&tom);
        Ok(tom)
    }

    /// The same mesh without its finest cuts: its full mesh is the cut of at most `triangles`, and errors are told against that.
    #[must_use]
    pub fn truncated(mut self, triangles: u32) -> Self {
        let cut = self.cut(triangles);
        let mut full = Vec::with_capacity(cut.triangles as usize);
        self.resolve(cut, &mut full);
        self.triangles = full;
        self.vertices.truncate(cut.vertices as usize);
        self.substitutes.truncate(cut.vertices as usize);
        self.errors = error::table(&self);
        self
    }

    /// The same mesh without the cuts that are coarser than the one of at most `triangles`.
    #[must_use]
    pub fn no_coarser(mut self, triangles: u32) -> Self {
        self.least = self.cut(triangles).triangles;
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
        (self.least, self.triangles.len() as u32)
    }

    /// The finest mesh of at most `triangles`; the coarsest where that has more.
    ///
    /// A vertex takes two triangles with it as a rule, so the cut has at most a few fewer than asked for.
    #[must_use]
    pub fn cut(&self, triangles: u32) -> Cut {
        let asked = triangles.max(self.least) as usize;
        let Some(next) = self.triangles.get(asked) else {
            return Cut { vertices: self.vertices.len() as u32, triangles: self.triangles.len() as u32 };
        };
        let vertices = self.birth(*next);
        let count = self.triangles[..asked].partition_point(|t| self.birth(*t) < vertices);
        Cut { vertices, triangles: count as u32 }
    }

    /// Vertex numbers of the triangles of `cut`, appended to `corners`; time proportional to their count.
    pub fn resolve(&self, cut: Cut, corners: &mut Vec<[u32; 3]>) {
        let standing = |corner: u32| self.standing(corner, cut.vertices);
        corners.extend(self.triangles[..cut.triangles as usize].iter().map(|t| t.map(standing)));
    }

    /// The vertex that stands for another in a cut of so many vertices; of a part that vanished, the last that it had.
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

    /// A vertex of a finer cut on its way to a coarser one: `share` 0 is where it is, 1 is where its substitute stands in a cut
    /// of so many vertices. A mesh drawn so at 1 covers what the coarser one covers: a change of cut need not be seen.
    #[must_use]
    pub fn morphed(&self, vertex: u32, coarser: u32, share: f32) -> PrimitiveVertex {
        let from = self.vertices[vertex as usize];
        let to = self.vertices[self.standing(vertex, coarser) as usize];
        let normal = from.normal.lerp(to.normal, share).try_normalize().unwrap_or(to.normal);
        PrimitiveVertex { core: from.core.lerp(to.core, share), normal, uv: from.uv.lerp(to.uv, share) }
    }

    /// How far the full mesh is from the cut of so many triangles, metres: the greatest distance of a sample of its vertices.
    /// It never falls as the count falls.
    #[must_use]
    pub fn error_m(&self, triangles: u32) -> f64 {
        error::at(&self.errors, triangles)
    }

    /// Bytes that it needs, and those of a plain indexed mesh of the same vertices and triangles.
    #[must_use]
    pub fn bytes(&self) -> (usize, usize) {
        let plain = size_of_val(&self.vertices[..]) + size_of_val(&self.triangles[..]);
        (plain + size_of_val(&self.substitutes[..]) + size_of_val(&self.errors[..]), plain)
    }

    fn substitute(&self, vertex: u32) -> u32 {
        self.substitutes[vertex as usize] & !SAME_PLACE
    }

    /// The first vertex that stands at the same position.
    fn first_here(&self, mut vertex: u32) -> u32 {
        while self.substitutes[vertex as usize] & SAME_PLACE != 0 {
            vertex -= 1;
        }
        vertex
    }

    /// A triangle is part of every cut of more vertices than this: 0 for one that never goes.
    ///
    /// Its last corner is followed to its substitute until two corners are at one position.
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
