//! The tube's linear system: symmetric, 3×3 blocks, each row coupled to the two before it; factor, solve, inverse blocks.
//!
//! In: [`Row`]s in the interleaved order x₀, φ₀, x₁, φ₁, … x_N ("slots": node k is slot 2k, segment k slot 2k + 1).
//! Pairs (φ_k, x_{k+1}) of it are the 6×6 blocks of a block-tridiagonal matrix.
//! Out: L D Lᵀ without square roots in O(N), one answer A⁻¹ r in O(N), the blocks of A⁻¹ inside the band in O(N).
//! Never here: what the numbers mean, allocation once the sizes settle. Theory: docs/theory/rod.md, eq. 15–18.

use super::sym3::Sym3;
use glam::{DMat3, DVec3};

/// One block row of the system's lower half.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// The block on the diagonal.
    pub diag: Sym3,
    /// The block that couples this slot (rows) to the one before it (columns).
    pub near: DMat3,
    /// The block that couples this slot to the one two before it: node to node, segment to segment, hence symmetric.
    pub far: Sym3,
}

/// One block row of the factor.
#[derive(Debug, Clone, Copy)]
struct Factored {
    /// Inverse of the pivot D_i.
    inverse: Sym3,
    /// L(i, i − 1).
    near: DMat3,
    /// L(i, i − 2).
    far: DMat3,
}

impl Row {
    /// Nothing at all. (No `Default`: that of a `DMat3` is the identity.)
    pub const ZERO: Self = Self { diag: Sym3::ZERO, near: DMat3::ZERO, far: Sym3::ZERO };
}

impl Factored {
    const ZERO: Self = Self { inverse: Sym3::ZERO, near: DMat3::ZERO, far: DMat3::ZERO };
}

/// The factor of A. It answers impulses with velocities: this is the seam at which contacts work ([`crate::rod`]).
#[derive(Debug, Clone, Default)]
pub struct Factor {
    rows: Vec<Factored>,
}

/// The blocks of A⁻¹ inside the band.
#[derive(Debug, Clone, Default)]
pub struct InverseBlocks {
    /// A⁻¹(i, i).
    pub diag: Vec<Sym3>,
    /// A⁻¹(i + 1, i); one entry fewer.
    pub near: Vec<DMat3>,
    /// A⁻¹(i + 2, i); two entries fewer.
    pub far: Vec<DMat3>,
}

impl Factor {
    /// How many slots the matrix had; none before the first.
    pub fn slots(&self) -> usize {
        self.rows.len()
    }

    /// How much memory it takes, bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.rows[..])
    }

    /// Takes over another factor, into the storage that is here.
    pub fn copy_from(&mut self, other: &Self) {
        self.rows.clone_from(&other.rows);
    }

    /// The size of the inverse of each slot's pivot: a scale, not the inverse mass itself.
    pub fn scales(&self) -> impl Iterator<Item = f64> {
        self.rows.iter().map(|row| row.inverse.d.element_sum() / 3.0)
    }

    /// Forgets the matrix.
    pub fn forget(&mut self) {
        self.rows.clear();
    }

    /// Factors the matrix; returns the first slot whose pivot is not positive definite, where there is one (eq. 16).
    pub fn factor(&mut self, rows: &[Row]) -> Result<(), usize> {
        self.rows.resize(rows.len(), Factored::ZERO);
        let (mut before, mut last) = (Sym3::ZERO, Sym3::ZERO); // pivots' inverses of rows i − 2, i − 1
        let mut last_near = DMat3::ZERO; // A(i − 1, i − 2) after elimination
        for (i, (row, out)) in rows.iter().zip(&mut self.rows).enumerate() {
            let far = row.far.times(&before);
            let changed = row.near - far * last_near.transpose();
            let near = last.after(&changed);
            let pivot = row.diag.minus_product(&far, &row.far.full()).minus_product(&near, &changed);
            let inverse = pivot.inverse().ok_or(i)?;
            *out = Factored { inverse, near, far };
            (before, last, last_near) = (last, inverse, changed);
        }
        Ok(())
    }

    /// Turns the right side r into A⁻¹ r, in place (eq. 17): impulses, one a slot, into the velocities they cause.
    pub fn solve(&self, r: &mut [DVec3]) {
        let (mut before, mut last) = (DVec3::ZERO, DVec3::ZERO);
        for (row, r) in self.rows.iter().zip(r.iter_mut()) {
            let y = minus(*r - row.far * before, &row.near, last);
            *r = row.inverse * y;
            (before, last) = (last, y);
        }
        let (mut after, mut next) = (DVec3::ZERO, DVec3::ZERO); // rows' answers i + 2, i + 1 …
        let (mut near, mut far, mut far_next) = (DMat3::ZERO, DMat3::ZERO, DMat3::ZERO); // … and their L
        for (row, r) in self.rows.iter().zip(r.iter_mut()).rev() {
            let y = minus(*r - transposed(&far, after), &near.transpose(), next);
            *r = y;
            (after, next) = (next, y);
            (near, far, far_next) = (row.near, far_next, row.far);
        }
    }

    /// The blocks of A⁻¹ inside the band, in one sweep from the last row (eq. 18).
    pub fn inverse_blocks(&self, into: &mut InverseBlocks) {
        let n = self.rows.len();
        into.diag.resize(n, Sym3::ZERO);
        into.near.resize(n.saturating_sub(1), DMat3::ZERO);
        into.far.resize(n.saturating_sub(2), DMat3::ZERO);
        for j in (0..n).rev() {
            let mut diag = self.rows[j].inverse;
            if j + 1 < n {
                let l1 = self.rows[j + 1].near;
                let mut z1 = -(into.diag[j + 1].full() * l1);
                if j + 2 < n {
                    let l2 = self.rows[j + 2].far;
                    z1 -= into.near[j + 1].transpose() * l2;
                    let z2 = -(into.near[j + 1] * l1) - into.diag[j + 2].full() * l2;
                    into.far[j] = z2;
                    diag = diag.minus_product(&l2.transpose(), &z2.transpose());
                }
                into.near[j] = z1;
                diag = diag.minus_product(&l1.transpose(), &z1.transpose());
            }
            into.diag[j] = diag;
        }
    }
}

/// v − m w, summed in pairs: each row waits for the one before it, so the way from `w` is kept short.
#[inline]
fn minus(v: DVec3, m: &DMat3, w: DVec3) -> DVec3 {
    (v - m.x_axis * w.x) - (m.y_axis * w.y + m.z_axis * w.z)
}

#[inline]
fn transposed(m: &DMat3, v: DVec3) -> DVec3 {
    DVec3::new(m.x_axis.dot(v), m.y_axis.dot(v), m.z_axis.dot(v))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A positive definite band matrix of `n` rows with entries of about one, from a fixed sequence.
    fn example(n: usize) -> Vec<Row> {
        let mut seed = 1_u64;
        let mut next = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut vector = move || DVec3::new(next(), next(), next());
        (0..n)
            .map(|i| {
                let mut row = Row { diag: Sym3::diagonal(DVec3::splat(6.0)), ..Row::ZERO };
                row.diag += Sym3::outer(vector(), 1.0);
                row.near = if i > 0 { DMat3::from_cols(vector(), vector(), vector()) } else { DMat3::ZERO };
                row.far = if i > 1 { Sym3::outer(vector(), 1.0) } else { Sym3::ZERO };
                row
            })
            .collect()
    }

    fn multiply(rows: &[Row], v: &[DVec3]) -> Vec<DVec3> {
        let mut out = vec![DVec3::ZERO; rows.len()];
        for (i, row) in rows.iter().enumerate() {
            out[i] += row.diag * v[i];
            if i > 0 {
                out[i] += row.near * v[i - 1];
                out[i - 1] += row.near.transpose() * v[i];
            }
            if i > 1 {
                out[i] += row.far * v[i - 2];
                out[i - 2] += row.far * v[i];
            }
        }
        out
    }

    #[test]
    fn a_solve_undoes_the_matrix() {
        let rows = example(17);
        let mut factor = Factor::default();
        factor.factor(&rows).unwrap();
        let x: Vec<_> = (0..17).map(|i| DVec3::new(i as f64, 1.0, -0.5 * i as f64)).collect();
        let mut r = multiply(&rows, &x);
        factor.solve(&mut r);
        for (got, want) in r.iter().zip(&x) {
            assert!((*got - *want).length() < 1e-12, "{got} is not {want}"); // 17 of 3e-16, condition below 100
        }
    }

    #[test]
    fn the_inverse_blocks_are_those_of_the_columns() {
        let rows = example(9);
        let mut factor = Factor::default();
        factor.factor(&rows).unwrap();
        let mut blocks = InverseBlocks::default();
        factor.inverse_blocks(&mut blocks);
        for i in 0..9 {
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                let mut column = vec![DVec3::ZERO; 9];
                column[i] = axis;
                factor.solve(&mut column);
                let close = |got: DVec3, at: usize| assert!((got - column[at]).length() < 1e-14, "{i} {at}");
                close(blocks.diag[i] * axis, i);
                if i + 1 < 9 {
                    close(blocks.near[i] * axis, i + 1);
                }
                if i + 2 < 9 {
                    close(blocks.far[i] * axis, i + 2);
                }
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_is_refused_at_its_slot() {
        let mut rows = example(5);
        rows[3].diag = Sym3::diagonal(DVec3::new(1.0, -1.0, 1.0));
        assert_eq!(Factor::default().factor(&rows), Err(3));
        rows[3].diag = Sym3::diagonal(DVec3::NAN);
        assert_eq!(Factor::default().factor(&rows), Err(3));
    }
}
