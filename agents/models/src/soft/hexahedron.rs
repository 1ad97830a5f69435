//! A cell of a solid: eight vertices, linear elasticity in corotated axes, or another law of its mean deformation.
//!
//! In: corners at rest and now. Out: forces and stiffness. Theory: docs/theory/soft.md, eq. 10–14, 31: the incompatible modes of (TBW76)
//! let the cell bend without locking, and its forces are the exact gradient of its energy, so that they exert no net torque.

use super::deformation::{ConstantStrain, Deformation, first_turn, follow_turn, outer};
use super::material::{Lame, Law, Material};
use super::spec::SoftMaterial;
use super::system::System;
use glam::{DMat3, DQuat, DVec3};
use metachron_core::skyline_cholesky::{BlockIndex, SkylineCholesky};

/// Data common to all cells of one rest shape.
#[derive(Debug, Clone)]
pub(super) struct HexahedronKind {
    /// Corners at rest relative to the first, metres.
    rest: [DVec3; 8],
    /// Mean gradient of each corner's share, 1/m.
    gradients: [DVec3; 8],
    /// Stiffness between corners, N/m: without that of the mean deformation where a law has that.
    stiffness: Box<[[DMat3; 8]; 8]>,
    /// The law of the mean deformation; none where it is a part of the stiffness.
    law: Option<Law>,
    volume_m3: f64,
    /// The volume that belongs to each corner, m³.
    pub volumes_m3: [f64; 8],
}

/// A cell.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hexahedron {
    /// Its corners: bit 0 of a corner's place says whether it is the far one in x, bit 1 in y, bit 2 in z.
    pub vertices: [u32; 8],
    /// Index of its kind.
    pub kind: usize,
    /// The share of its volume that is matter, 0 … 1: less in cells that a surface cuts.
    pub fill: f64,
    /// The mass that it gives each corner, kg.
    pub mass_kg: [f64; 8],
    /// Rotation from rest.
    pub turn: DQuat,
}

/// Corners and incompatible modes.
const MODES: usize = 11;
/// Coordinate of the Gauss points along each axis.
const GAUSS: f64 = 0.577_350_269_189_625_8;
/// The place of a corner in the cell's own coordinates, −1 … 1.
fn corner(i: usize) -> DVec3 {
    let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    DVec3::new(sign(0), sign(1), sign(2))
}

/// Gradient of each corner's share in the cell's own coordinates at `at`.
fn slopes(at: DVec3) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        let c = corner(i);
        let f = DVec3::ONE + c * at;
        DVec3::new(c.x * f.y * f.z, f.x * c.y * f.z, f.x * f.y * c.z) * 0.125
    })
}

impl HexahedronKind {
    /// The kind of a cell with these corners at rest, metres.
    pub fn new(corners: [DVec3; 8], material: &SoftMaterial) -> Self {
        let Lame { mu, lambda } = Lame::of(material);
        let jacobian = |at: DVec3| slopes(at).iter().zip(&corners).fold(DMat3::ZERO, |j, (s, x)| j + outer(*x, *s));
        let middle = jacobian(DVec3::ZERO);
        let mut whole = [[DMat3::ZERO; MODES]; MODES];
        let (mut gradients, mut volumes_m3, mut volume) = ([DVec3::ZERO; 8], [0.0; 8], 0.0);
        let mut dilatation = Dilatation::none();
        for point in 0..8 {
            let at = corner(point) * GAUSS;
            let j = jacobian(at);
            let (weight, back) = (j.determinant(), j.inverse().transpose());
            let own = slopes(at).map(|s| back * s);
            // the corrected gradients of 1 − ξ² vanish on the mean: constant strains are exact in cells of any shape
            let scale = middle.determinant() / weight;
            let beyond =
                (0..3).map(|axis| middle.inverse().transpose() * (DVec3::AXES[axis] * (-2.0 * at[axis] * scale)));
            let all: Vec<DVec3> = own.into_iter().chain(beyond).collect();
            for (a, row) in whole.iter_mut().enumerate() {
                for (b, block) in row.iter_mut().enumerate() {
                    let (ga, gb) = (all[a], all[b]);
                    let round = DMat3::from_diagonal(DVec3::splat(mu * ga.dot(gb)));
                    *block += (outer(gb, ga) * mu + round) * weight;
                }
            }
            dilatation.meet(at, weight, &all);
            for i in 0..8 {
                gradients[i] += own[i] * weight;
                volumes_m3[i] += weight * ((DVec3::ONE + corner(i) * at) * 0.5).element_product();
            }
            volume += weight;
        }
        dilatation.add(lambda, &mut whole);
        let gradients = gradients.map(|g| g / volume);
        let rest = corners.map(|x| x - corners[0]);
        let mut stiffness = Box::new(condensed(&whole));
        let law = match Law::of(material) {
            Law::Corotational(_) => None,
            law @ Law::Ogden(_) => Some(law),
        };
        if law.is_some() {
            for (ga, row) in gradients.iter().zip(stiffness.iter_mut()) {
                for (gb, block) in gradients.iter().zip(row) {
                    let round = DMat3::from_diagonal(DVec3::splat(mu * ga.dot(*gb)));
                    *block -= (outer(*gb, *ga) * mu + round + outer(*ga, *gb) * lambda) * volume;
                }
            }
        }
        Self { rest, gradients, stiffness, law, volume_m3: volume, volumes_m3 }
    }

    /// Whether two kinds are equal up to rounding.
    pub fn is_like(&self, other: &Self) -> bool {
        let size = self.rest[7].length();
        self.rest.iter().zip(&other.rest).all(|(a, b)| a.distance(*b) <= 1e-12 * size)
    }
}

/// The dilatation of a cell as far as it is linear in the cell's coordinates: no mode can undo its bilinear part in eight corners and
/// their modes, and near ν = ½ that would lock the cell.
struct Dilatation {
    volume: f64,
    /// Σ ξ w and Σ ξ ξᵀ w over the Gauss points.
    first: DVec3,
    second: DMat3,
    /// Σ g w of each mode, and Σ ξᵢ g w along each axis.
    mean: [DVec3; MODES],
    along: [[DVec3; MODES]; 3],
}

impl Dilatation {
    const fn none() -> Self {
        let none = [DVec3::ZERO; MODES];
        Self { volume: 0.0, first: DVec3::ZERO, second: DMat3::ZERO, mean: none, along: [none; 3] }
    }

    /// Counts a Gauss point at `at` with the gradients of all modes there.
    fn meet(&mut self, at: DVec3, weight: f64, gradients: &[DVec3]) {
        self.volume += weight;
        self.first += at * weight;
        self.second += outer(at, at) * weight;
        for (mode, gradient) in gradients.iter().enumerate() {
            self.mean[mode] += *gradient * weight;
            (0..3).for_each(|axis| self.along[axis][mode] += *gradient * (at[axis] * weight));
        }
    }

    /// Adds λ ∫ (P div)², P the projection onto linear functions, to the stiffness of all modes.
    fn add(mut self, lambda: f64, whole: &mut [[DMat3; MODES]; MODES]) {
        // linear functions without a mean
        let middle = self.first / self.volume;
        for (axis, along) in self.along.iter_mut().enumerate() {
            along.iter_mut().zip(&self.mean).for_each(|(along, mean)| *along -= *mean * middle[axis]);
        }
        let inverse = (self.second - outer(middle, middle) * self.volume).inverse();
        for (a, row) in whole.iter_mut().enumerate() {
            for (b, block) in row.iter_mut().enumerate() {
                *block += outer(self.mean[a], self.mean[b]) * (lambda / self.volume);
                for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                    *block += outer(self.along[i][a], self.along[j][b]) * (lambda * inverse.col(j)[i]);
                }
            }
        }
    }
}

/// The stiffness with the incompatible modes condensed out (eq. 11).
fn condensed(whole: &[[DMat3; MODES]; MODES]) -> [[DMat3; 8]; 8] {
    let mut inner = SkylineCholesky::<3>::default();
    inner.shape(&[0, 0, 0]);
    for a in 0..3 {
        for b in 0..=a {
            inner.add_block(BlockIndex { row: a, column: b }, whole[8 + a][8 + b].transpose().to_cols_array_2d());
        }
    }
    let mut left: [[DMat3; 8]; 8] = std::array::from_fn(|i| std::array::from_fn(|j| whole[i][j]));
    if !inner.factor() {
        return left; // a cell without volume keeps its own stiffness
    }
    for j in 0..8 {
        let mut columns = [[0.0; 9]; 3];
        for (axis, column) in columns.iter_mut().enumerate() {
            (0..3).for_each(|a| column[3 * a..3 * a + 3].copy_from_slice(&whole[8 + a][j].col(axis).to_array()));
            inner.solve(column);
        }
        for (i, row) in left.iter_mut().enumerate() {
            for a in 0..3 {
                let answer = DMat3::from_cols_array_2d(&columns.map(|c| [c[3 * a], c[3 * a + 1], c[3 * a + 2]]));
                row[j] -= whole[i][8 + a] * answer;
            }
        }
    }
    left
}

/// The state of a cell at one moment.
struct Bent {
    /// Its rotation.
    turn: DMat3,
    /// Displacement of each corner, in the axes of rest.
    by: [DVec3; 8],
    /// Elastic force of the stiffness on these displacements, in the same axes, N.
    force: [DVec3; 8],
}

impl Hexahedron {
    const fn strain<'a>(&self, kind: &'a HexahedronKind) -> ConstantStrain<'a, 8> {
        ConstantStrain { vertices: self.vertices, gradients: &kind.gradients, volume_m3: kind.volume_m3 * self.fill }
    }

    /// Forgets the rotation of the cell, which is found anew from these positions.
    pub fn begin_turn(&mut self, kind: &HexahedronKind, positions: &[DVec3]) {
        self.turn = first_turn(self.strain(kind).gradient(positions));
    }

    /// Updates the rotation of the cell; returns how it is deformed on the mean.
    pub fn follow(&mut self, kind: &HexahedronKind, positions: &[DVec3]) -> MeanDeformation {
        let f = self.strain(kind).gradient(positions);
        let firm = follow_turn(&mut self.turn, f);
        MeanDeformation { f, firm }
    }

    /// How it is deformed on the mean; updates its rotation.
    pub fn deformation(&mut self, kind: &HexahedronKind, positions: &[DVec3]) -> Deformation {
        let MeanDeformation { f, .. } = self.follow(kind, positions);
        Deformation::of(f, self.turn)
    }

    fn bent(&self, kind: &HexahedronKind, positions: &[DVec3]) -> Bent {
        let turn = DMat3::from_quat(self.turn);
        let back = turn.transpose();
        let origin = positions[self.vertices[0] as usize];
        let by: [DVec3; 8] =
            std::array::from_fn(|i| back * (positions[self.vertices[i] as usize] - origin) - kind.rest[i]);
        let force = std::array::from_fn(|i| {
            kind.stiffness[i].iter().zip(by).map(|(block, u)| *block * u).sum::<DVec3>() * self.fill
        });
        Bent { turn, by, force }
    }

    /// Adds its forces and stiffness at these positions; `mean` is the result of [`Self::follow`] (eq. 13, 14, 31).
    pub fn add(&self, kind: &HexahedronKind, positions: &[DVec3], mean: &MeanDeformation, system: &mut System) {
        let Bent { turn, force, .. } = self.bent(kind, positions);
        let origin = positions[self.vertices[0] as usize];
        let arms = self.vertices.map(|vertex| positions[vertex as usize] - origin);
        let torque: DVec3 = arms.iter().zip(force).map(|(arm, f)| arm.cross(turn * f)).sum();
        let turning = mean.firm * torque;
        let filled = turn * self.fill;
        for (i, &row) in self.vertices.iter().enumerate() {
            system.push(row, turning.cross(turn * kind.gradients[i]) - turn * force[i]);
        }
        let bending = |i: usize, j: usize| filled * kind.stiffness[i][j] * turn.transpose();
        if let Some(law) = &kind.law {
            let deformation = Deformation::of(mean.f, self.turn);
            return self.strain(kind).add(law, &deformation, system, bending);
        }
        for (i, &row) in self.vertices.iter().enumerate() {
            for (j, &column) in self.vertices.iter().enumerate().filter(|(_, column)| row >= **column) {
                system.stiffen(row, column, bending(i, j));
            }
        }
    }

    /// Elastic energy, J; `mean` is the result of [`Self::follow`].
    pub fn energy_j(&self, kind: &HexahedronKind, positions: &[DVec3], mean: &MeanDeformation) -> f64 {
        let Bent { by, force, .. } = self.bent(kind, positions);
        let bending = 0.5 * by.iter().zip(force).map(|(u, f)| u.dot(f)).sum::<f64>();
        let stretching = kind.law.as_ref().map_or(0.0, |law| {
            let stretches = Deformation::of(mean.f, self.turn).stretches;
            law.respond(stretches).energy * kind.volume_m3 * self.fill
        });
        bending + stretching
    }
}

/// The mean deformation of a cell.
#[derive(Debug, Clone, Copy)]
pub(super) struct MeanDeformation {
    f: DMat3,
    /// The map from a change of F to a further rotation.
    firm: DMat3,
}
