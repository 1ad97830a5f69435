//! The linear system of one substep: forces, stiffness and mass of all vertices, and its factor.
//!
//! In: what each element adds. Out: velocities. Never here: what an element is. Theory: docs/theory/soft.md, eq. 1, 2.

use crate::envelope::Envelope;
use glam::{DMat3, DVec3};

/// A = (1 + h c) M + h² K, vertices that are held left out.
#[derive(Debug, Clone, Default)]
pub(super) struct System {
    matrix: Envelope<3>,
    /// Lowest vertex that each vertex is joined to.
    first: Vec<u32>,
    held: Vec<bool>,
    /// Force on each vertex at the start of the substep, N.
    pub forces: Vec<DVec3>,
    /// h², s²: what a stiffness counts.
    square: f64,
}

impl System {
    /// A system in which vertex i is joined to none lower than `first[i]`.
    pub fn new(first: Vec<u32>, held: Vec<bool>) -> Self {
        let mut matrix = Envelope::default();
        matrix.shape(&first);
        let forces = vec![DVec3::ZERO; held.len()];
        Self { matrix, first, held, forces, square: 0.0 }
    }

    /// How many vertices there are.
    pub const fn vertices(&self) -> usize {
        self.held.len()
    }

    /// Begins a substep of `h` seconds: no force, no stiffness.
    pub fn begin(&mut self, h: f64) {
        // the factor overwrote the matrix in place, of the same shape
        self.matrix.clear();
        self.forces.fill(DVec3::ZERO);
        self.square = h * h;
    }

    /// Adds a force on a vertex, N.
    pub fn push(&mut self, vertex: u32, force: DVec3) {
        self.forces[vertex as usize] += force;
    }

    /// Adds the stiffness −∂fᵢ/∂xⱼ, N/m, where `i` is not below `j`: the matrix is symmetric.
    pub fn stiffen(&mut self, i: u32, j: u32, stiffness: DMat3) {
        let (row, column) = (i as usize, j as usize);
        if i >= j && !self.held[row] && !self.held[column] {
            self.add((row, column), stiffness * self.square);
        }
    }

    /// Adds an inertia to a vertex, kg.
    pub fn weigh(&mut self, vertex: usize, inertia: DMat3) {
        if !self.held[vertex] {
            self.add((vertex, vertex), inertia);
        }
    }

    fn add(&mut self, at: (usize, usize), block: DMat3) {
        self.matrix.add_block(at, block.transpose().to_cols_array_2d());
    }

    /// Factors the matrix; `false` where it is not positive.
    pub fn factor(&mut self) -> bool {
        for vertex in (0..self.held.len()).filter(|&vertex| self.held[vertex]) {
            self.matrix.add_block((vertex, vertex), DMat3::IDENTITY.to_cols_array_2d());
        }
        self.matrix.factor()
    }

    /// Turns impulses, one a vertex (N·s), into the velocities they cause (m/s) by the factor (eq. 2).
    pub fn respond(&self, impulses: &mut [DVec3]) {
        respond(&self.matrix, &self.held, impulses);
    }

    /// The size of the inverse mass of a vertex by itself, 1/kg, before the matrix is factored.
    pub fn mobility(&self, vertex: usize) -> f64 {
        let trace: f64 = (0..3).map(|axis| self.matrix.diagonal(3 * vertex + axis)).sum();
        if self.held[vertex] { 0.0 } else { 3.0 / trace }
    }

    /// Writes the factor and who is held into `matrix` and `held`.
    pub fn write(&self, matrix: &mut Envelope<3>, held: &mut Vec<bool>) {
        matrix.copy_from(&self.matrix);
        held.clone_from(&self.held);
    }

    /// What a factorisation costs, multiplications.
    pub fn work(&self) -> usize {
        Envelope::<3>::work(&self.first)
    }
}

/// A⁻¹ on impulses, one a vertex; those that are held stay still.
pub(super) fn respond(factor: &Envelope<3>, held: &[bool], impulses: &mut [DVec3]) {
    impulses.iter_mut().zip(held).filter(|(_, held)| **held).for_each(|(impulse, _)| *impulse = DVec3::ZERO);
    factor.solve_vectors(impulses);
}
