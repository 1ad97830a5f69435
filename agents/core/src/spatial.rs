//! Six by six matrices: the algebra of a rigid body's velocity and spin.
//!
//! In: forces and stiffnesses at points of a body. Out: matrices on (linear, angular) about its centre of mass. Never here:
//! the springs or contacts that the points belong to.

use glam::{DMat3, DVec3};

/// A linear and an angular part about a body's centre of mass: velocities (m/s, rad/s) or forces (N, N·m).
pub type Twist = [DVec3; 2];

/// How a rigid body resists: the inverse of its mass and of its inertia about its centre of mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseMass {
    /// Inverse of the mass, 1/kg, ≥ 0.
    pub linear_per_kg: f64,
    /// Inverse of the inertia tensor in world axes, 1/(kg·m²).
    pub angular_per_kg_m2: DMat3,
}

/// A matrix that maps one [`Twist`] to another, rows first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mat6(pub [[f64; 6]; 6]);

impl Mat6 {
    /// The zero matrix.
    pub const ZERO: Self = Self([[0.0; 6]; 6]);

    /// The mass (kg) and the inertia tensor (kg·m²) of a body.
    #[must_use]
    pub fn mass(mass_kg: f64, inertia: DMat3) -> Self {
        let mut whole = Self::ZERO;
        for i in 0..3 {
            whole.0[i][i] = mass_kg;
            (0..3).for_each(|j| whole.0[3 + i][3 + j] = inertia.col(j)[i]);
        }
        whole
    }

    /// Adds Gᵀ m G: the matrix `m` at a point `r` from the centre, carried over to the centre, G = (1, −r×).
    pub fn add_point(&mut self, r: DVec3, m: DMat3) {
        // the rows of Gᵀ: forces stay as they are, torques are r × force
        let rows: [DVec3; 6] = std::array::from_fn(|i| match i {
            0..3 => DVec3::AXES[i],
            _ => DVec3::AXES[i - 3].cross(r),
        });
        for (i, row) in rows.iter().enumerate() {
            for (j, column) in rows.iter().enumerate() {
                self.0[i][j] += row.dot(m * *column);
            }
        }
    }

    /// Adds stiffness against rotation across the arm `r`; about every axis where the arm has zero length.
    pub fn add_turning(&mut self, r: DVec3, stiffness: f64) {
        let axis = r.normalize_or_zero();
        for i in 0..3 {
            for j in 0..3 {
                let unit = if i == j { 1.0 } else { 0.0 };
                self.0[3 + i][3 + j] += stiffness * (unit - axis[i] * axis[j]);
            }
        }
    }

    /// Adds `other` times `factor`.
    pub fn add(&mut self, other: &Self, factor: f64) {
        for (row, with) in self.0.iter_mut().flatten().zip(other.0.iter().flatten()) {
            *row += with * factor;
        }
    }

    /// This matrix times `x`.
    #[must_use]
    pub fn times(&self, x: Twist) -> Twist {
        let x = flat(x);
        let row = |i: usize| (0..6).map(|j| self.0[i][j] * x[j]).sum::<f64>();
        let whole: [f64; 6] = std::array::from_fn(row);
        of_flat(whole)
    }

    /// Solves this matrix · x = `right`, by LDLᵀ without pivots: the matrix must be symmetric and positive definite.
    #[must_use]
    pub fn solve(&self, right: Twist) -> Twist {
        of_flat(self.factored().solved(flat(right)))
    }

    /// The inverse; the matrix must be symmetric and positive definite.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let factor = self.factored();
        let mut inverse = Self::ZERO;
        for j in 0..6 {
            let column = factor.solved(std::array::from_fn(|i| if i == j { 1.0 } else { 0.0 }));
            (0..6).for_each(|i| inverse.0[i][j] = column[i]);
        }
        inverse
    }

    /// The columns of L with L Lᵀ = this matrix, which must be symmetric and positive semidefinite; zero columns
    /// are left out.
    pub fn roots(&self) -> impl Iterator<Item = Twist> {
        let (mut left, mut roots) = (self.0, [[0.0; 6]; 6]);
        let largest = (0..6).map(|i| self.0[i][i]).fold(0.0, f64::max);
        for (j, root) in roots.iter_mut().enumerate() {
            // a pivot below that is rounding
            if left[j][j] <= 1e-12 * largest {
                continue;
            }
            let scale = left[j][j].sqrt().recip();
            (j..6).for_each(|i| root[i] = left[i][j] * scale);
            for i in j..6 {
                (j..6).for_each(|k| left[i][k] -= root[i] * root[k]);
            }
        }
        roots.into_iter().filter(|root| root.iter().any(|x| *x != 0.0)).map(of_flat)
    }

    /// L below and D on the diagonal.
    fn factored(&self) -> Self {
        let mut a = self.0;
        for j in 0..6 {
            let d = a[j][j] - (0..j).map(|k| a[j][k] * a[j][k] * a[k][k]).sum::<f64>();
            a[j][j] = d;
            for i in j + 1..6 {
                let sum: f64 = (0..j).map(|k| a[i][k] * a[j][k] * a[k][k]).sum();
                a[i][j] = (a[i][j] - sum) / d;
            }
        }
        Self(a)
    }

    fn solved(&self, mut x: [f64; 6]) -> [f64; 6] {
        let a = &self.0;
        for i in 0..6 {
            x[i] -= (0..i).map(|k| a[i][k] * x[k]).sum::<f64>();
        }
        for i in (0..6).rev() {
            x[i] = x[i] / a[i][i] - (i + 1..6).map(|k| a[k][i] * x[k]).sum::<f64>();
        }
        x
    }

    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.0.iter().flatten().all(|x| x.is_finite())
    }
}

fn flat([a, b]: Twist) -> [f64; 6] {
    [a.x, a.y, a.z, b.x, b.y, b.z]
}

fn of_flat(x: [f64; 6]) -> Twist {
    [DVec3::new(x[0], x[1], x[2]), DVec3::new(x[3], x[4], x[5])]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn held() -> Mat6 {
        let mut whole = Mat6::mass(2.0, DMat3::from_diagonal(DVec3::new(0.1, 0.2, 0.3)));
        whole.add_point(DVec3::new(0.1, -0.2, 0.3), DMat3::IDENTITY * 40.0);
        whole.add_turning(DVec3::new(0.1, -0.2, 0.3), 0.5);
        whole
    }

    #[test]
    fn a_solution_satisfies_its_system_and_the_inverse_gives_the_same() {
        let right = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(-0.3, 0.2, 0.1)];
        let x = held().solve(right);
        let (back, same) = (held().times(x), held().inverse().times(right));
        for i in 0..2 {
            assert!((back[i] - right[i]).length() < 1e-12, "{back:?}"); // rounding of numbers near 10
            assert!((same[i] - x[i]).length() < 1e-12, "{same:?} is not {x:?}");
        }
    }

    #[test]
    fn a_force_at_a_point_does_the_work_that_its_twist_does() {
        let (r, k) = (DVec3::new(0.3, -0.1, 0.2), 7.0);
        let mut whole = Mat6::ZERO;
        whole.add_point(r, DMat3::IDENTITY * k);
        let moved = [DVec3::new(1.0, 0.5, -2.0), DVec3::new(0.2, -0.4, 0.1)];
        let force = whole.times(moved);
        let point = moved[0] + moved[1].cross(r);
        let work = force[0].dot(moved[0]) + force[1].dot(moved[1]);
        assert!((work - k * point.length_squared()).abs() < 1e-12); // rounding of numbers near 40
    }
}
