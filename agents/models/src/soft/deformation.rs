//! The deformation of an element: its rotation, its principal stretches, and the response of a material.
//!
//! In: the gradient F. Out: stresses and stiffness. Never here: elements, material laws. Theory: docs/theory/soft.md, eq. 12, 28–30.

use super::material::{Material, StretchResponse};
use crate::symmetric::principal_axes;
use glam::{DMat3, DQuat, DVec3};

/// Most Newton iterations for a rotation: it needs three, more where the element is turned inside out.
const TURN_TRIES: usize = 30;
/// Stretches nearer to each other than this are equal: a difference quotient of them would be rounding.
const EQUAL: f64 = 1e-6;

pub(super) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Where to begin with a rotation of which nothing is known: none, or the half turn about the axis by which `f` is nearest to one. No rotation is
/// farther from all four than a third of a turn, and none is where Newton's method finds no way on, half a turn away.
pub(super) fn first_turn(f: DMat3) -> DQuat {
    let [x, y, z] = [f.x_axis.x, f.y_axis.y, f.z_axis.z];
    // traces of RᵀF
    let halves = [(x - y - z, DVec3::X), (y - z - x, DVec3::Y), (z - x - y, DVec3::Z)];
    let none = (x + y + z, DQuat::IDENTITY);
    let nearer = |best: (f64, DQuat), (trace, axis): (f64, DVec3)| {
        if trace > best.0 { (trace, DQuat::from_vec4(axis.extend(0.0))) } else { best }
    };
    halves.into_iter().fold(none, nearer).1
}

/// Moves a rotation to the one nearest to `f`, by Newton's method on the trace of RᵀF from where it is (eq. 12); returns the matrix that
/// maps a change of F to a further rotation.
pub(super) fn follow_turn(turn: &mut DQuat, f: DMat3) -> DMat3 {
    let mut firm = DMat3::ZERO;
    for _ in 0..TURN_TRIES {
        let h = f * DMat3::from_quat(*turn).transpose();
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
        *turn = (DQuat::from_scaled_axis(by.clamp_length_max(1.0)) * *turn).normalize();
    }
    firm
}

/// A deformation F = L Λ Rᵀ.
pub(super) struct Deformation {
    /// L: the principal axes in the world.
    left: DMat3,
    /// R: the principal axes at rest.
    right: DMat3,
    /// Λ, of which one is negative where F turns matter inside out.
    pub stretches: [f64; 3],
}

impl Deformation {
    /// The deformation `f` whose rotation is `turn`.
    pub fn of(f: DMat3, turn: DQuat) -> Self {
        let turn = DMat3::from_quat(turn);
        let stretch = turn.transpose() * f;
        let axes = principal_axes((stretch + stretch.transpose()) * 0.5);
        Self { left: turn * axes.axes, right: axes.axes, stretches: axes.values.to_array() }
    }

    /// The stress of Piola and Kirchhoff, Pa (eq. 28).
    pub fn stress(&self, response: &StretchResponse) -> DMat3 {
        self.left * DMat3::from_diagonal(DVec3::from_array(response.slope)) * self.right.transpose()
    }

    /// The von Mises stress of Cauchy, Pa (eq. 28): that of matter which has no volume left is not finite.
    pub fn von_mises_pa(&self, material: &impl Material) -> f64 {
        let volume: f64 = self.stretches.iter().product();
        let slope = material.respond(self.stretches).slope;
        let [a, b, c] = [0, 1, 2].map(|k| slope[k] * self.stretches[k] / volume);
        (0.5 * ((a - b).powi(2) + (b - c).powi(2) + (c - a).powi(2))).sqrt()
    }

    /// The stiffness of a unit of volume: how much stress changes with F, without its negative part (eq. 29, 30).
    pub fn stiffness(&self, response: &StretchResponse) -> [Mode; 9] {
        let StretchResponse { slope, curvature, .. } = response;
        let [l, r] = [&self.left, &self.right];
        let mut modes = [Mode { stiffness_pa: 0.0, shape: DMat3::ZERO }; 9];
        let stretching = principal_axes(DMat3::from_cols_array_2d(curvature));
        for (axis, mode) in modes.iter_mut().take(3).enumerate() {
            let shares = DMat3::from_diagonal(stretching.axes.col(axis));
            *mode = Mode { stiffness_pa: stretching.values[axis].max(0.0), shape: *l * shares * r.transpose() };
        }
        for (at, [i, j]) in [[0, 1], [1, 2], [2, 0]].into_iter().enumerate() {
            let (apart, sum) = (self.stretches[i] - self.stretches[j], self.stretches[i] + self.stretches[j]);
            let alike = if apart.abs() > EQUAL {
                (slope[i] - slope[j]) / apart
            } else {
                0.5 * (curvature[i][i] + curvature[j][j]) - curvature[i][j]
            };
            // only matter without any width has no sum
            let across = if sum.abs() > EQUAL { (slope[i] + slope[j]) / sum } else { 0.0 };
            let [a, b] = [outer(l.col(i), r.col(j)), outer(l.col(j), r.col(i))];
            let half = std::f64::consts::FRAC_1_SQRT_2;
            modes[3 + 2 * at] = Mode { stiffness_pa: alike.max(0.0), shape: (a + b) * half };
            modes[4 + 2 * at] = Mode { stiffness_pa: across.max(0.0), shape: (a - b) * half };
        }
        modes
    }
}

/// A change of F of length 1, and how stiffly a unit of volume resists it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mode {
    /// Pa, ≥ 0.
    pub stiffness_pa: f64,
    pub shape: DMat3,
}

/// An element whose F is the same all over: the forces and stiffness of a material at its vertices.
pub(super) struct ConstantStrain<'a, const N: usize> {
    pub vertices: [u32; N],
    /// Gradient of each vertex's share, 1/m.
    pub gradients: &'a [DVec3; N],
    /// Its volume at rest, m³.
    pub volume_m3: f64,
}

impl<const N: usize> ConstantStrain<'_, N> {
    /// F at these positions.
    pub fn gradient(&self, positions: &[DVec3]) -> DMat3 {
        let origin = positions[self.vertices[0] as usize];
        let terms = self.vertices.iter().zip(self.gradients);
        terms.fold(DMat3::ZERO, |f, (vertex, g)| f + outer(positions[*vertex as usize] - origin, *g))
    }

    /// Adds the forces and the stiffness of `material` at these positions, of which `turn` is the rotation; block by block with the stiffness
    /// `beside` between two of its vertices, N/m.
    pub fn add(
        &self,
        material: &impl Material,
        deformation: &Deformation,
        system: &mut super::system::System,
        beside: impl Fn(usize, usize) -> DMat3,
    ) {
        let response = material.respond(deformation.stretches);
        let stress = deformation.stress(&response) * self.volume_m3;
        let modes = deformation.stiffness(&response);
        let moved = modes.map(|mode| self.gradients.map(|g| mode.shape * g));
        for (i, &row) in self.vertices.iter().enumerate() {
            system.push(row, -(stress * self.gradients[i]));
            for (j, &column) in self.vertices.iter().enumerate().filter(|(_, column)| row >= **column) {
                let parts = modes.iter().zip(&moved).filter(|(mode, _)| mode.stiffness_pa > 0.0);
                let block = parts.fold(DMat3::ZERO, |sum, (mode, by)| {
                    sum + outer(by[i], by[j] * (mode.stiffness_pa * self.volume_m3))
                });
                system.stiffen(row, column, block + beside(i, j));
            }
        }
    }
}
