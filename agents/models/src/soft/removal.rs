//! Removal of cells of a solid while it runs: what cutting is built upon.
//!
//! In: a body and which of its cells. Out: the body without them, and what went with them. Never here: which cells a cut meets.
//! Theory: docs/theory/soft.md, section 11.

use super::body::SoftBody;
use super::fe_mesh::{FeMesh, edges_of};
use super::spec::SoftError;
use glam::DVec3;
use metachron_geometry::narrow_phase::VoronoiRegions;
use metachron_geometry::{CollisionShape, ShapeKind, SurfaceShape, Tetrahedra, lone_faces};
use std::sync::Arc;

/// The faces of a cell whose corners' bits are x, y, z, counter-clockwise seen from outside.
const QUADS: [[usize; 4]; 6] = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

/// What went with the cells that were removed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RemovedCells {
    /// Their mass, kg.
    pub mass_kg: f64,
    /// Their momentum, kg·m/s.
    pub momentum: DVec3,
    /// How many triangles of the skin went with them.
    pub triangles: usize,
}

/// An element that fills a volume.
struct Cell<'a> {
    vertices: &'a [u32],
    /// The mass that it gives each vertex, kg.
    mass_kg: &'a [f64],
}

impl FeMesh {
    /// The cells of a cage or a lattice, or the tetrahedra.
    fn cells(&self) -> impl Iterator<Item = Cell<'_>> {
        let cells = self.hexahedra.iter().map(|cell| Cell { vertices: &cell.vertices, mass_kg: &cell.mass_kg });
        let all = self.tetrahedra.iter();
        cells.chain(all.map(|element| Cell { vertices: &element.vertices, mass_kg: &element.mass_kg }))
    }

    /// Removes cells; what no cell has any more is held, without mass.
    fn remove(&mut self, is_gone: &[bool]) {
        let mut gone = is_gone.iter();
        self.hexahedra.retain(|_| !gone.next().copied().unwrap_or_default());
        self.tetrahedra.retain(|_| !gone.next().copied().unwrap_or_default());
        let mut mass_kg = vec![0.0; self.rest.len()];
        for cell in self.cells() {
            cell.vertices.iter().zip(cell.mass_kg).for_each(|(vertex, mass)| mass_kg[*vertex as usize] += mass);
        }
        self.mass_kg = mass_kg;
        let is_alive: Vec<bool> = self.mass_kg.iter().map(|mass| *mass > 0.0).collect();
        self.held.iter_mut().zip(&is_alive).for_each(|(held, alive)| *held |= !alive);
        self.edges.retain(|ends| ends.iter().all(|vertex| is_alive[*vertex as usize]));
        self.stretched.retain(|ends| ends.iter().all(|vertex| is_alive[*vertex as usize]));
        self.rows.retain(|(row, _)| row.iter().all(|vertex| is_alive[*vertex as usize]));
    }

    /// The faces that one cell alone has, as triangles counter-clockwise seen from outside.
    fn outside(&self) -> Vec<[u32; 3]> {
        let quads = self.hexahedra.iter().flat_map(|cell| QUADS.map(|quad| quad.map(|at| cell.vertices[at])));
        let halves = quads.flat_map(|[a, b, c, d]| {
            // the diagonal of the least vertex: both cells at a face divide it alike
            if a.min(c) < b.min(d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
        });
        let corners = self.tetrahedra.iter().map(|element| element.vertices).collect();
        let tetrahedra = Tetrahedra { corners, ..Tetrahedra::default() };
        let mut faces = lone_faces(halves.collect());
        faces.extend(tetrahedra.boundary());
        faces
    }
}

impl SoftBody {
    /// How many cells there are of its cage or lattice, or tetrahedra; none of a sheet or a rope.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.mesh.cells().count()
    }

    /// The mean of the corners of a cell now, metres; `None` where there is no such cell.
    #[must_use]
    pub fn cell_middle(&self, cell: usize) -> Option<DVec3> {
        let cell = self.mesh.cells().nth(cell)?;
        let sum: DVec3 = cell.vertices.iter().map(|vertex| self.positions[*vertex as usize]).sum();
        Some(sum / cell.vertices.len() as f64)
    }

    /// Removes cells by their numbers between two steps, with the triangles of the skin in them; the cells that are left are numbered anew, in the
    /// same order. What is left moves on as it was, in as many pieces as there are; a body that has lost cells keeps its ε.
    ///
    /// # Errors
    /// [`SoftError::NoCell`] for a number without a cell, [`SoftError::AllCells`] where none would be left; nothing is changed then.
    pub fn remove_cells(&mut self, cells: &[usize]) -> Result<RemovedCells, SoftError> {
        let count = self.cells();
        let mut is_gone = vec![false; count];
        for &cell in cells {
            *is_gone.get_mut(cell).ok_or(SoftError::NoCell { cell, cells: count })? = true;
        }
        if !is_gone.contains(&false) {
            return Err(SoftError::AllCells);
        }
        let (mass_kg, momentum) = self.mesh.cells().zip(&is_gone).filter(|(_, gone)| **gone).fold(
            (0.0, DVec3::ZERO),
            |(mass_kg, momentum), (cell, _)| {
                let of = |(vertex, mass): (&u32, &f64)| self.velocities[*vertex as usize] * *mass;
                (
                    mass_kg + cell.mass_kg.iter().sum::<f64>(),
                    momentum + cell.vertices.iter().zip(cell.mass_kg).map(of).sum::<DVec3>(),
                )
            },
        );
        let embedded = self.skin_without(&is_gone);
        self.mesh.remove(&is_gone);
        for (velocity, mass) in self.velocities.iter_mut().zip(&self.mesh.mass_kg) {
            if *mass == 0.0 {
                *velocity = DVec3::ZERO;
            }
        }
        let before = self.skin_triangles();
        let triangles = embedded.unwrap_or_else(|| {
            let outside = self.mesh.outside();
            self.mesh.edges = edges_of(&outside);
            outside
        });
        self.set_skin(triangles);
        self.system = self.mesh.system(&self.positions);
        self.is_cut = true;
        self.woken();
        Ok(RemovedCells { mass_kg, momentum, triangles: before.saturating_sub(self.skin_triangles()) })
    }

    /// The triangles of an embedded skin that are in no cell that is gone, its points carried by what is left; `None` where its vertices are
    /// its skin.
    fn skin_without(&mut self, is_gone: &[bool]) -> Option<Vec<[u32; 3]>> {
        let skin = self.skin.as_mut()?;
        let ShapeKind::Surface(surface) = &self.form.kind else { return None };
        let kept = skin.without_cells(is_gone, &surface.triangles);
        Some(kept)
    }

    fn skin_triangles(&self) -> usize {
        if let ShapeKind::Surface(surface) = &self.form.kind { surface.triangles.len() } else { 0 }
    }

    fn set_skin(&mut self, triangles: Vec<[u32; 3]>) {
        let ShapeKind::Surface(before) = &self.form.kind else { return };
        let edges = edges_of(&triangles);
        let mut vertices: Vec<u32> = triangles.iter().flatten().copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        let surface = SurfaceShape {
            fans: VoronoiRegions::of(&edges, &triangles).into(),
            vertices: vertices.into(),
            edges: edges.into(),
            triangles: triangles.into(),
            ..before.clone()
        };
        let traits = self.form.traits;
        self.form =
            Arc::new(CollisionShape { traits, ..CollisionShape::new(ShapeKind::Surface(surface), self.form.friction) });
    }
}
