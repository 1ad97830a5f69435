//! A tetrahedron of a solid: four vertices, one strain.
//!
//! In: corners at rest and now. Out: forces and stiffness. Never here: material laws. Theory: docs/theory/soft.md, section 9.

use super::deformation::{ConstantStrain, Deformation, first_turn, follow_turn};
use super::material::{Law, Material};
use super::system::System;
use glam::{DMat3, DQuat, DVec3};

/// A tetrahedron.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tetrahedron {
    pub vertices: [u32; 4],
    /// Gradient of each vertex's share, 1/m.
    gradients: [DVec3; 4],
    /// Volume at rest, m³.
    pub volume_m3: f64,
    /// The mass that it gives each corner, kg.
    pub mass_kg: [f64; 4],
    /// Index of its material.
    pub material: usize,
    /// Rotation from rest.
    pub turn: DQuat,
}

impl Tetrahedron {
    /// A tetrahedron with these corners at rest, metres, and this density, kg/m³; its volume must not vanish.
    pub fn new(vertices: [u32; 4], corners: [DVec3; 4], material: usize, density: f64) -> Self {
        let [a, b, c, d] = corners;
        let sides = DMat3::from_cols(b - a, c - a, d - a);
        let shares = sides.inverse().transpose();
        let gradients = [-(shares.x_axis + shares.y_axis + shares.z_axis), shares.x_axis, shares.y_axis, shares.z_axis];
        let volume_m3 = sides.determinant() / 6.0;
        let mass_kg = [0.25 * volume_m3 * density; 4];
        Self { vertices, gradients, volume_m3, mass_kg, material, turn: DQuat::IDENTITY }
    }

    const fn strain(&self) -> ConstantStrain<'_, 4> {
        ConstantStrain { vertices: self.vertices, gradients: &self.gradients, volume_m3: self.volume_m3 }
    }

    /// Forgets its rotation, which is found anew from these positions.
    pub fn begin_turn(&mut self, positions: &[DVec3]) {
        self.turn = first_turn(self.strain().gradient(positions));
    }

    /// Updates its rotation; returns how it is deformed.
    pub fn follow(&mut self, positions: &[DVec3]) -> Deformation {
        let f = self.strain().gradient(positions);
        follow_turn(&mut self.turn, f);
        Deformation::of(f, self.turn)
    }

    /// Adds its forces and stiffness.
    pub fn add(&self, law: &Law, deformation: &Deformation, system: &mut System) {
        self.strain().add(law, deformation, system, |_, _| DMat3::ZERO);
    }

    /// Elastic energy, J.
    pub fn energy_j(&self, law: &Law, deformation: &Deformation) -> f64 {
        law.respond(deformation.stretches).energy * self.volume_m3
    }
}
