//! Removal of cells of a solid or a sheet while it runs: the ground of cutting.
//!
//! In: a body and which of its cells. Out: the body without them, and the matter in them. Never here: the cutting tool.
//! Theory: docs/theory/soft.md, section 11.

use super::body::SoftBody;
use super::carrier::Carrier;
use super::division::form;
use super::fe_mesh::{FeMesh, edges_of};
use super::spec::{SoftError, SoftMaterial, SoftShape};
use glam::DVec3;
use metachron_contact::Carving;
use metachron_core::Removed;
use metachron_geometry::narrow_phase::VoronoiRegions;
use metachron_geometry::{ShapeKind, SurfaceShape, Tetrahedra, lone_faces};

/// The faces of a cell whose corners' bits are x, y, z, counter-clockwise seen from outside.
const QUADS: [[usize; 4]; 6] = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

/// An element that has matter.
struct Cell<'a> {
    vertices: &'a [u32],
    /// The mass that it gives each vertex, kg.
    mass_kg: &'a [f64],
}

impl FeMesh {
    /// The cells of a cage or a lattice, the tetrahedra, or the triangles of a sheet.
    fn cells(&self) -> impl Iterator<Item = Cell<'_>> {
        let cells = self.hexahedra.iter().map(|cell| Cell { vertices: &cell.vertices, mass_kg: &cell.mass_kg });
        let all = self.tetrahedra.iter();
        let solid = cells.chain(all.map(|element| Cell { vertices: &element.vertices, mass_kg: &element.mass_kg }));
        let sheet = self.membranes.iter();
        solid.chain(sheet.map(|element| Cell { vertices: element.vertices(), mass_kg: element.mass_kg() }))
    }

    /// Removes cells of a body of `shape`; a vertex without any cell is held, without mass.
    fn remove(&mut self, is_gone: &[bool], shape: &SoftShape, material: &SoftMaterial) {
        let mut gone = is_gone.iter().copied();
        let mut is_left = || !gone.next().unwrap_or_default();
        self.hexahedra.retain(|_| is_left());
        self.tetrahedra.retain(|_| is_left());
        let is_left: Vec<bool> = self.membranes.iter().map(|_| is_left()).collect();
        if !is_left.is_empty() {
            let mut left = is_left.iter();
            self.membranes.retain(|_| left.next() == Some(&true));
            let mut left = is_left.iter();
            self.triangles.retain(|_| left.next() == Some(&true));
            self.list_edges();
            self.bend_anew(shape, material);
        }
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

    /// The faces that one cell alone has, as triangles counter-clockwise seen from outside; of a sheet all that are left.
    fn outside(&self) -> Vec<[u32; 3]> {
        if !self.is_solid() {
            return self.triangles.clone();
        }
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
    /// How many cells there are of its cage or lattice, tetrahedra, or triangles of a sheet; none of a rope.
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

    /// Removes the cells whose middles are in a region between two steps; `None`, and no change, where there are none and where none would be
    /// left.
    pub(super) fn remove_within(&mut self, carving: &Carving) -> Option<Removed> {
        let is_within = |cell: &usize| self.cell_middle(*cell).is_some_and(|middle| carving.holds(middle));
        let cells: Vec<usize> = (0..self.cells()).filter(is_within).collect();
        if cells.is_empty() { None } else { self.remove_cells(&cells).ok() }
    }

    /// Removes cells by their numbers between two steps, with the triangles of the skin in them; the cells that are left are numbered anew, in the
    /// same order. The rest moves on as it was, in as many pieces as there are; a body that has lost cells keeps its ε.
    ///
    /// # Errors
    /// [`SoftError::NoCell`] for a number without a cell, [`SoftError::AllCells`] where none would be left; nothing is changed then.
    pub fn remove_cells(&mut self, cells: &[usize]) -> Result<Removed, SoftError> {
        let count = self.cells();
        let mut is_gone = vec![false; count];
        for &cell in cells {
            *is_gone.get_mut(cell).ok_or(SoftError::NoCell { cell, cells: count })? = true;
        }
        if !is_gone.contains(&false) {
            return Err(SoftError::AllCells);
        }
        let before = self.skin_triangles();
        let went = self.mesh.cells().zip(&is_gone).filter(|(_, gone)| **gone).map(|(cell, _)| {
            let of = |(vertex, mass): (&u32, &f64)| self.velocities[*vertex as usize] * *mass;
            let momentum = cell.vertices.iter().zip(cell.mass_kg).map(of).sum();
            Removed { cells: 1, triangles: 0, mass_kg: cell.mass_kg.iter().sum(), momentum }
        });
        let went = went.fold(Removed::default(), Removed::and);
        self.leave_out(&is_gone);
        for (velocity, mass) in self.velocities.iter_mut().zip(&self.mesh.mass_kg) {
            if *mass == 0.0 {
                *velocity = DVec3::ZERO;
            }
        }
        self.hang();
        self.woken();
        let triangles = (before as i64 - self.skin_triangles() as i64) as i32;
        let went = Removed { triangles, ..went };
        self.removed = self.removed.and(went);
        Ok(went)
    }

    /// Takes cells out of the mesh and of the skin, by their numbers among the cells that are left.
    pub(super) fn leave_out(&mut self, is_gone: &[bool]) {
        let Self { skin, mesh, form, spec, .. } = self;
        let shape = skin.as_ref().and_then(|skin| skin.carrier.lattice()).unwrap_or(&spec.shape);
        mesh.remove(is_gone, shape, &spec.material);
        let triangles = match (skin, &form.kind) {
            (Some(skin), ShapeKind::Surface(surface)) => {
                let is_left: Vec<bool> = mesh.mass_kg.iter().map(|mass| *mass > 0.0).collect();
                let triangles = skin.without_cells(is_gone, &is_left, &surface.triangles);
                if let Carrier::Cage(cage) = &skin.carrier {
                    mesh.hang(cage);
                }
                triangles
            }
            _ => {
                let outside = mesh.outside();
                mesh.edges = edges_of(&outside);
                outside
            }
        };
        self.set_skin(triangles);
        self.system = self.mesh.system(&self.positions);
        let mut again = is_gone.iter().copied();
        self.gone.resize(self.gone.len().max(is_gone.len()), false);
        self.gone.iter_mut().filter(|gone| !**gone).for_each(|gone| *gone = again.next().unwrap_or_default());
    }

    pub(super) fn skin_triangles(&self) -> usize {
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
        self.form = form(&self.spec, surface);
    }
}
