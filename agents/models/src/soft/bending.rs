//! Bending element of a sheet that is flat at rest: a few vertices that resist bending out of the plane.
//!
//! In: vertices in a row, a cross or a square. Out: forces and stiffness. Never here: stretching ([`super::membrane`]).
//! Theory: docs/theory/soft.md, eq. 7, 8: second differences on the grid; their squares do not change when the sheet turns.

use super::system::System;
use glam::{DMat3, DVec3};

/// One squared sum of positions.
#[derive(Debug, Clone, Copy)]
pub(super) struct BendingElement {
    vertices: [u32; 5],
    /// Weight of each vertex in the curvature, 1/m²; zero for unused ones.
    weights: [f64; 5],
    /// Stiffness of the squared curvature, N·m³.
    stiffness: f64,
}

impl BendingElement {
    /// ½ `stiffness` |Σ w x|² over at most five vertices.
    pub fn new(terms: &[(u32, f64)], stiffness: f64) -> Self {
        let mut fold = Self { vertices: [terms[0].0; 5], weights: [0.0; 5], stiffness };
        for (i, &(vertex, weight)) in terms.iter().enumerate() {
            (fold.vertices[i], fold.weights[i]) = (vertex, weight);
        }
        fold
    }

    fn bent(&self, positions: &[DVec3]) -> DVec3 {
        self.vertices.into_iter().zip(self.weights).map(|(vertex, w)| positions[vertex as usize] * w).sum()
    }

    /// Adds its forces and stiffness at these positions (eq. 7).
    pub fn add(&self, positions: &[DVec3], system: &mut System) {
        let bent = self.bent(positions);
        let terms = || self.vertices.into_iter().zip(self.weights).filter(|(_, w)| *w != 0.0);
        for (row, wi) in terms() {
            system.push(row, bent * (-self.stiffness * wi));
            for (column, wj) in terms() {
                system.stiffen(row, column, DMat3::from_diagonal(DVec3::splat(self.stiffness * wi * wj)));
            }
        }
    }

    /// Elastic energy, J.
    pub fn energy_j(&self, positions: &[DVec3]) -> f64 {
        0.5 * self.stiffness * self.bent(positions).length_squared()
    }
}
