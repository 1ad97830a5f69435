//! A straight piece of a rope: a spring along its length, with no stiffness against bending.
//!
//! In: two vertices. Out: forces and stiffness. Theory: docs/theory/soft.md, eq. 9.

use super::system::System;
use glam::{DMat3, DVec3};

/// A piece of a rope.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bar {
    /// Its ends.
    pub ends: [u32; 2],
    /// Length at rest, metres.
    pub rest_m: f64,
    /// Axial stiffness EA, N.
    pub ea_n: f64,
}

impl Bar {
    /// Adds its forces and stiffness at these positions.
    pub fn add(&self, positions: &[DVec3], system: &mut System) {
        let [a, b] = self.ends;
        let way = positions[b as usize] - positions[a as usize];
        let length = way.length();
        // without a length it has no direction; entries are added all the same, as their order is the matrix's structure
        let along = if length == 0.0 { DVec3::ZERO } else { way / length };
        let k = self.ea_n / self.rest_m;
        let force = along * (k * (length - self.rest_m));
        system.push(a, force);
        system.push(b, -force);
        // across the piece only tension adds stiffness: in compression it would be negative
        let across = k * (1.0 - self.rest_m / length).max(0.0);
        let outer = DMat3::from_cols(along * along.x, along * along.y, along * along.z);
        let stiffness = outer * (k - across) + DMat3::from_diagonal(DVec3::splat(across));
        system.stiffen(a, a, stiffness);
        system.stiffen(b, b, stiffness);
        system.stiffen(a, b, -stiffness);
        system.stiffen(b, a, -stiffness);
    }

    /// By which share of its length at rest it is longer.
    pub fn strain(&self, positions: &[DVec3]) -> f64 {
        let [a, b] = self.ends.map(|end| positions[end as usize]);
        (a.distance(b) - self.rest_m) / self.rest_m
    }

    /// Elastic energy, J.
    pub fn energy_j(&self, positions: &[DVec3]) -> f64 {
        let [a, b] = self.ends.map(|end| positions[end as usize]);
        let longer = a.distance(b) - self.rest_m;
        0.5 * self.ea_n / self.rest_m * longer * longer
    }
}
