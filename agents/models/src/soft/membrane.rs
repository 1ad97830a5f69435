//! Membrane element of a sheet: a triangle that resists stretch and shear.
//!
//! In: vertices. Out: forces and stiffness. Never here: bending ([`crate::soft::bending`]). Theory: docs/theory/soft.md, eq. 5, 6:
//! St. Venant–Kirchhoff in the plane.

use super::deformation::outer;
use super::spec::SoftMaterial;
use super::system::System;
use glam::{DMat2, DMat3, DVec2, DVec3};

/// A triangle of constant strain.
#[derive(Debug, Clone, Copy)]
pub(super) struct Membrane {
    vertices: [u32; 3],
    /// Gradient of each vertex's share over the flat sheet, 1/m.
    gradients: [DVec2; 3],
    /// Volume at rest, m³.
    volume_m3: f64,
    /// The mass that it gives each vertex, kg.
    mass_kg: [f64; 3],
    /// Plane stress: μ and λ, Pa.
    lame_pa: [f64; 2],
}

/// The strain of a triangle.
struct Strained {
    /// The two columns of F.
    columns: [DVec3; 2],
    /// E = (FᵀF − 1)/2: xx, yy, xy.
    strain: [f64; 3],
}

impl Membrane {
    /// A triangle whose flat corners are `flat`, metres, `thickness_m` thick.
    pub fn new(vertices: [u32; 3], flat: [DVec2; 3], thickness_m: f64, material: &SoftMaterial) -> Self {
        let SoftMaterial { young_pa, poisson, .. } = *material;
        let sides = DMat2::from_cols(flat[1] - flat[0], flat[2] - flat[0]);
        let inverse = sides.inverse();
        let (b, c) = (inverse.row(0), inverse.row(1));
        let volume_m3 = 0.5 * sides.determinant().abs() * thickness_m;
        let lame_pa = [0.5 * young_pa / (1.0 + poisson), young_pa * poisson / (1.0 - poisson * poisson)];
        let mass_kg = [volume_m3 * material.density_kg_m3 / 3.0; 3];
        Self { vertices, gradients: [-b - c, b, c], volume_m3, mass_kg, lame_pa }
    }

    /// Its vertices.
    pub const fn vertices(&self) -> &[u32; 3] {
        &self.vertices
    }

    /// The mass that it gives each vertex, kg.
    pub const fn mass_kg(&self) -> &[f64; 3] {
        &self.mass_kg
    }

    fn strained(&self, positions: &[DVec3]) -> Strained {
        let [a, b, c] = self.vertices.map(|vertex| positions[vertex as usize]);
        let (u, v, [_, gu, gv]) = (b - a, c - a, self.gradients);
        let columns = [u * gu.x + v * gv.x, u * gu.y + v * gv.y];
        let [x, y] = columns;
        Strained { columns, strain: [0.5 * (x.dot(x) - 1.0), 0.5 * (y.dot(y) - 1.0), 0.5 * x.dot(y)] }
    }

    fn stress(&self, [xx, yy, xy]: [f64; 3]) -> [f64; 3] {
        let [mu, lambda] = self.lame_pa;
        let spread = lambda * (xx + yy);
        [2.0 * mu * xx + spread, 2.0 * mu * yy + spread, 2.0 * mu * xy]
    }

    /// Adds its forces and stiffness at these positions (eq. 5, 6).
    pub fn add(&self, positions: &[DVec3], system: &mut System) {
        let Strained { columns: [x, y], strain } = self.strained(positions);
        let stress = self.stress(strain);
        let pulled = self.gradients.map(|g| times(stress, g));
        let moved = self.gradients.map(|g| x * g.x + y * g.y);
        for (vertex, pull) in self.vertices.into_iter().zip(pulled) {
            system.push(vertex, (x * pull.x + y * pull.y) * -self.volume_m3);
        }
        let taut = tension(stress);
        let [mu, lambda] = self.lame_pa;
        let square = outer(x, x) + outer(y, y);
        for (i, &row) in self.vertices.iter().enumerate() {
            for (j, &column) in self.vertices.iter().enumerate().filter(|(_, column)| row >= **column) {
                let (gi, gj) = (self.gradients[i], self.gradients[j]);
                let tight = gi.dot(times(taut, gj));
                let block = DMat3::from_diagonal(DVec3::splat(tight))
                    + square * (mu * gi.dot(gj))
                    + outer(moved[j], moved[i]) * mu
                    + outer(moved[i], moved[j]) * lambda;
                system.stiffen(row, column, block * self.volume_m3);
            }
        }
    }

    /// The von Mises stress in its plane, Pa.
    pub fn von_mises_pa(&self, positions: &[DVec3]) -> f64 {
        let [xx, yy, xy] = self.stress(self.strained(positions).strain);
        (xx * xx - xx * yy + yy * yy + 3.0 * xy * xy).sqrt()
    }

    /// Elastic energy, J.
    pub fn energy_j(&self, positions: &[DVec3]) -> f64 {
        let strain = self.strained(positions).strain;
        let stress = self.stress(strain);
        0.5 * self.volume_m3 * (strain[0] * stress[0] + strain[1] * stress[1] + 2.0 * strain[2] * stress[2])
    }
}

fn times([xx, yy, xy]: [f64; 3], v: DVec2) -> DVec2 {
    DVec2::new(xx * v.x + xy * v.y, xy * v.x + yy * v.y)
}

/// The tensile part of a stress: compression has negative stiffness across.
fn tension([xx, yy, xy]: [f64; 3]) -> [f64; 3] {
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let radius = half.hypot(xy);
    let (high, low) = ((mean + radius).max(0.0), (mean - radius).max(0.0));
    if radius == 0.0 {
        return [high, high, 0.0];
    }
    let (middle, spread) = (0.5 * (high + low), 0.5 * (high - low) / radius);
    [middle + half * spread, middle - half * spread, xy * spread]
}
