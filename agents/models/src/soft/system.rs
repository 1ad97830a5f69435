//! The linear system of one substep: forces, stiffness and mass of all vertices, and its factor.
//!
//! In: the contributions of each element. Out: velocities. Never here: the elements themselves. Theory: docs/theory/soft.md, eq. 1, 2.

use glam::{DMat3, DVec3};
use metachron_contact::cluster::{Block, Response, SparseFactor};
use metachron_core::PlainLoop;

/// A = (1 + h c) M + h² K, vertices that are held left out.
#[derive(Debug, Default)]
pub(super) struct System {
    factor: SparseFactor,
    /// The row of each vertex; none for held ones. Rows rise with the vertices.
    rows: Vec<Option<u32>>,
    /// How many vertices move.
    moving: usize,
    /// Force on each vertex at the start of the substep, N.
    pub forces: Vec<DVec3>,
    /// The lower half of the matrix as blocks of moving vertices, as they were added.
    blocks: Vec<Block>,
    /// h², s²: the factor of every stiffness.
    square: f64,
}

impl System {
    /// A system of vertices of which some are held.
    pub fn new(held: &[bool]) -> Self {
        let mut next = 0..;
        let rows = held.iter().map(|&held| if held { None } else { next.next() }).collect();
        let moving = held.iter().filter(|held| !**held).count();
        Self { rows, moving, forces: vec![DVec3::ZERO; held.len()], ..Self::default() }
    }

    /// Begins a substep of `h` seconds: no force, no stiffness.
    pub fn begin(&mut self, h: f64) {
        self.blocks.clear();
        self.forces.fill(DVec3::ZERO);
        self.square = h * h;
    }

    /// Adds a force on a vertex, N.
    pub fn push(&mut self, vertex: u32, force: DVec3) {
        self.forces[vertex as usize] += force;
    }

    /// Adds the stiffness −∂fᵢ/∂xⱼ, N/m, where `i` is not below `j`: the matrix is symmetric.
    pub fn stiffen(&mut self, i: u32, j: u32, stiffness: DMat3) {
        if i >= j {
            self.add(i as usize, j as usize, stiffness * self.square);
        }
    }

    /// Adds an inertia to a vertex, kg.
    pub fn weigh(&mut self, vertex: usize, inertia: DMat3) {
        self.add(vertex, vertex, inertia);
    }

    fn add(&mut self, i: usize, j: usize, value: DMat3) {
        if let (Some(row), Some(column)) = (self.rows[i], self.rows[j]) {
            self.blocks.push(Block { row: row as usize, column: column as usize, value });
        }
    }

    /// Takes up where the matrix that was added has blocks.
    pub fn shape(&mut self) {
        self.factor.shape(self.moving, &self.blocks);
    }

    /// Factors the matrix; `false` where it is not positive.
    pub fn factor(&mut self) -> bool {
        // members of a cluster begin side by side: a factor is one thread's
        self.factor.factor(self.moving, &self.blocks, &PlainLoop).is_ok()
    }

    /// The factor.
    pub const fn answer(&self) -> &SparseFactor {
        &self.factor
    }

    /// Replaces impulses, one for each vertex (N·s), by the velocities they cause (m/s) by the factor (eq. 2); held vertices stay still.
    pub fn respond(&self, impulses: &mut [DVec3]) {
        let rows = || self.rows.iter().enumerate().filter_map(|(vertex, row)| Some((vertex, (*row)? as usize)));
        rows().for_each(|(vertex, row)| impulses[row] = impulses[vertex]);
        self.factor.respond(&mut impulses[..self.moving]);
        for (vertex, row) in self.rows.iter().enumerate().rev() {
            impulses[vertex] = row.map_or(DVec3::ZERO, |row| impulses[row as usize]);
        }
    }

    /// The lower half of the matrix, in blocks of moving vertices; entries with one place add up.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The row of each vertex among those that move; none for held ones.
    pub fn rows(&self) -> &[Option<u32>] {
        &self.rows
    }

    /// Cost of a factorisation, multiplications.
    pub fn work(&self) -> f64 {
        self.factor.cost()
    }
}
