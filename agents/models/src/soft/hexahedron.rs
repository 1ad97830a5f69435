//! A cell of a solid: eight vertices, linear elasticity in corotated axes.
//!
//! In: corners at rest and now. Out: forces and stiffness. Theory: docs/theory/soft.md, eq. 10–14: the incompatible modes of (TBW76)
//! let the cell bend without locking, and its forces are the exact gradient of its energy, so that they exert no net torque.

use super::spec::SoftMatter;
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
    /// Stiffness between corners, N/m.
    stiffness: Box<[[DMat3; 8]; 8]>,
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
    /// Rotation from rest.
    pub turn: DQuat,
}

/// Corners and incompatible modes.
const MODES: usize = 11;
/// Coordinate of the Gauss points along each axis.
const GAUSS: f64 = 0.577_350_269_189_625_8;
/// Most Newton iterations for a cell's rotation: it needs three, more where a cell is turned inside out.
const TURN_TRIES: usize = 30;

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

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
    pub fn new(corners: [DVec3; 8], matter: &SoftMatter) -> Self {
        let SoftMatter { young_pa, poisson, .. } = *matter;
        let mu = 0.5 * young_pa / (1.0 + poisson);
        let lambda = young_pa * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
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
        Self { rest, gradients, stiffness: Box::new(condensed(&whole)), volumes_m3 }
    }

    /// Whether two kinds are equal up to rounding.
    pub fn is_like(&self, other: &Self) -> bool {
        let size = self.rest[7].length();
        self.rest.iter().zip(&other.rest).all(|(a, b)| a.distance(*b) <= 1e-12 * size)
    }
}

/// The dilatation of a cell as far as it is linear in the cell's coordinates: what is bilinear of it in eight corners and their modes no mode
/// can undo, and near ν = ½ it would lock the cell.
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
    /// Updates the rotation of the cell, by Newton's method on the trace of RᵀF from the last rotation on (eq. 12); returns the matrix
    /// that maps a change of F to a further rotation.
    pub fn follow(&mut self, kind: &HexahedronKind, positions: &[DVec3]) -> DMat3 {
        let mut f = DMat3::ZERO;
        for (vertex, gradient) in self.vertices.iter().zip(&kind.gradients) {
            f += outer(positions[*vertex as usize] - positions[self.vertices[0] as usize], *gradient);
        }
        let mut firm = DMat3::ZERO;
        for _ in 0..TURN_TRIES {
            let h = f * DMat3::from_quat(self.turn).transpose();
            let twist = DVec3::new(h.y_axis.z - h.z_axis.y, h.z_axis.x - h.x_axis.z, h.x_axis.y - h.y_axis.x);
            let trace = h.x_axis.x + h.y_axis.y + h.z_axis.z;
            let slope = DMat3::from_diagonal(DVec3::splat(trace)) - (h + h.transpose()) * 0.5;
            let minor = slope.x_axis.x * slope.y_axis.y - slope.x_axis.y * slope.y_axis.x;
            let solid = slope.x_axis.x > 0.0 && minor > 0.0 && slope.determinant() > 1e-9;
            firm = if solid { slope.inverse() } else { DMat3::ZERO };
            let by = if solid { firm * twist } else { twist / (trace.abs() + 1.0) };
            if by.length_squared() < 1e-28 || !by.is_finite() {
                break;
            }
            self.turn = (DQuat::from_scaled_axis(by.clamp_length_max(1.0)) * self.turn).normalize();
        }
        firm
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

    /// Adds its forces and stiffness at these positions; `firm` is the result of [`Self::follow`] (eq. 13, 14).
    pub fn add(&self, kind: &HexahedronKind, positions: &[DVec3], firm: DMat3, system: &mut System) {
        let Bent { turn, force, .. } = self.bent(kind, positions);
        let origin = positions[self.vertices[0] as usize];
        let arms = self.vertices.map(|vertex| positions[vertex as usize] - origin);
        let torque: DVec3 = arms.iter().zip(force).map(|(arm, f)| arm.cross(turn * f)).sum();
        let turning = firm * torque;
        let filled = turn * self.fill;
        for (i, &row) in self.vertices.iter().enumerate() {
            system.push(row, turning.cross(turn * kind.gradients[i]) - turn * force[i]);
            for (j, &column) in self.vertices.iter().enumerate().filter(|(_, column)| row >= **column) {
                system.stiffen(row, column, filled * kind.stiffness[i][j] * turn.transpose());
            }
        }
    }

    /// Elastic energy, J.
    pub fn energy_j(&self, kind: &HexahedronKind, positions: &[DVec3]) -> f64 {
        let Bent { by, force, .. } = self.bent(kind, positions);
        0.5 * by.iter().zip(force).map(|(u, f)| u.dot(f)).sum::<f64>()
    }
}
