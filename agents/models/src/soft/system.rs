//! The linear system of one substep: forces, stiffness and mass of all vertices, and its factor.
//!
//! In: the contributions of each element. Out: velocities. Never here: the elements themselves. Theory: docs/theory/soft.md, eq. 1, 2.

use glam::{DMat3, DVec3};
use metachron_contact::cluster::{Block, Response};
use metachron_core::skyline_cholesky::{BlockIndex, SkylineCholesky};

/// A = (1 + h c) M + h² K, vertices that are held left out.
#[derive(Debug, Clone, Default)]
pub(super) struct System {
    matrix: Factor,
    /// Lowest row that each row is joined to.
    first: Vec<u32>,
    /// Force on each vertex at the start of the substep, N.
    pub forces: Vec<DVec3>,
    /// The lower half of the matrix as blocks of moving vertices, as they were added.
    blocks: Vec<Block>,
    /// h², s²: the factor of every stiffness.
    square: f64,
}

/// The matrix of the moving vertices, and then its factor.
#[derive(Debug, Clone, Default)]
pub(super) struct Factor {
    matrix: SkylineCholesky<3>,
    /// The row of each vertex; none for held ones. Rows rise with the vertices.
    rows: Vec<Option<u32>>,
}

impl System {
    /// A system in which each moving vertex i is joined to no moving vertex lower than `first[i]`.
    pub fn new(first: &[u32], held: &[bool]) -> Self {
        let mut next = 0..;
        let rows: Vec<Option<u32>> = held.iter().map(|&held| if held { None } else { next.next() }).collect();
        let first: Vec<u32> =
            rows.iter().zip(first).filter_map(|(row, first)| row.and(rows[*first as usize])).collect();
        let mut matrix = SkylineCholesky::default();
        matrix.shape(&first);
        Self {
            matrix: Factor { matrix, rows },
            first,
            forces: vec![DVec3::ZERO; held.len()],
            blocks: vec![],
            square: 0.0,
        }
    }

    /// Begins a substep of `h` seconds: no force, no stiffness.
    pub fn begin(&mut self, h: f64) {
        // the factor overwrote the matrix in place, of the same shape
        self.matrix.matrix.clear();
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

    fn add(&mut self, i: usize, j: usize, block: DMat3) {
        let Factor { matrix, rows } = &mut self.matrix;
        if let (Some(row), Some(column)) = (rows[i], rows[j]) {
            self.blocks.push(Block { row: row as usize, column: column as usize, value: block });
            matrix.add_block(
                BlockIndex { row: row as usize, column: column as usize },
                block.transpose().to_cols_array_2d(),
            );
        }
    }

    /// Factors the matrix; `false` where it is not positive.
    pub fn factor(&mut self) -> bool {
        self.matrix.matrix.factor()
    }

    /// The factor.
    pub const fn answer(&self) -> &Factor {
        &self.matrix
    }

    /// Replaces impulses, one for each vertex (N·s), by the velocities they cause (m/s) by the factor (eq. 2).
    pub fn respond(&self, impulses: &mut [DVec3]) {
        self.matrix.respond_at(impulses);
    }

    /// The lower half of the matrix, in blocks of moving vertices; entries with one place add up.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The row of each vertex among those that move; none for held ones.
    pub fn rows(&self) -> &[Option<u32>] {
        &self.matrix.rows
    }

    /// Cost of a factorisation, multiplications.
    pub fn work(&self) -> usize {
        SkylineCholesky::<3>::work(&self.first)
    }
}

impl Response for Factor {
    /// One impulse for each moving vertex.
    fn respond(&self, impulses: &mut [DVec3]) {
        self.matrix.solve_vectors(impulses);
    }
}

impl Factor {
    /// A⁻¹ on impulses, one for each vertex; held vertices stay still.
    pub fn respond_at(&self, impulses: &mut [DVec3]) {
        let rows = || self.rows.iter().enumerate().filter_map(|(vertex, row)| Some((vertex, (*row)? as usize)));
        rows().for_each(|(vertex, row)| impulses[row] = impulses[vertex]);
        self.matrix.solve_vectors(&mut impulses[..self.matrix.rows() / 3]);
        for (vertex, row) in self.rows.iter().enumerate().rev() {
            impulses[vertex] = row.map_or(DVec3::ZERO, |row| impulses[row as usize]);
        }
    }
}
