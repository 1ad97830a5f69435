//! Symmetric systems of numbers in which each row couples to the two before it: three at once, one in each component of a vector.
//!
//! In: rows. Out: the factor L D Lᵀ in O(N), answers A⁻¹ r in O(N). Never here: the meaning of the numbers. Theory:
//! docs/theory/rod.md, eq. 16, 17.

use glam::DVec3;

/// One row of the lower half of three independent systems.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandRow {
    /// The entries on the diagonal.
    pub diag: DVec3,
    /// The entries that couple the row to the one before it.
    pub near: DVec3,
    /// The entries that couple it to the one before that.
    pub far: DVec3,
}

impl BandRow {
    /// All zero.
    pub const ZERO: Self = Self { diag: DVec3::ZERO, near: DVec3::ZERO, far: DVec3::ZERO };
}

/// The factor; `diag` of its rows holds the inverse pivots.
#[derive(Debug, Clone, Default)]
pub struct BandFactor {
    rows: Vec<BandRow>,
}

impl BandFactor {
    /// Factors a positive definite matrix.
    ///
    /// # Errors
    /// A row whose pivot is not positive.
    pub fn factor(&mut self, rows: &[BandRow]) -> Result<(), usize> {
        self.rows.clear();
        let (mut before, mut last, mut last_near) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        for (at, row) in rows.iter().enumerate() {
            let far = row.far * before;
            let changed = row.near - far * last_near;
            let near = changed * last;
            let pivot = row.diag - far * row.far - near * changed;
            // NaN fails the comparison
            if !(pivot.min_element() > 0.0 && pivot.is_finite()) {
                return Err(at);
            }
            let diag = pivot.recip();
            self.rows.push(BandRow { diag, near, far });
            (before, last, last_near) = (last, diag, changed);
        }
        Ok(())
    }

    /// Replaces the right side r by A⁻¹ r.
    pub fn solve(&self, r: &mut [DVec3]) {
        let (mut before, mut last) = (DVec3::ZERO, DVec3::ZERO);
        for (row, r) in self.rows.iter().zip(r.iter_mut()) {
            let y = *r - row.near * last - row.far * before;
            *r = row.diag * y;
            (before, last) = (last, y);
        }
        let (mut near, mut far, mut far_next) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        for (row, r) in self.rows.iter().zip(r.iter_mut()).rev() {
            *r -= near + far;
            (near, far, far_next) = (row.near * *r, far_next, row.far * *r);
        }
    }
}

/// A v.
pub fn multiply(rows: &[BandRow], v: &[DVec3], at: usize) -> DVec3 {
    let mut sum = rows[at].diag * v[at];
    if at > 0 {
        sum += rows[at].near * v[at - 1];
    }
    if at > 1 {
        sum += rows[at].far * v[at - 2];
    }
    if let Some(row) = rows.get(at + 1) {
        sum += row.near * v[at + 1];
    }
    if let Some(row) = rows.get(at + 2) {
        sum += row.far * v[at + 2];
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_solve_undoes_the_matrix() {
        for count in [1, 2, 3, 8] {
            let rows: Vec<BandRow> = (0..count)
                .map(|at| {
                    let x = at as f64;
                    let near = if at > 0 { DVec3::new(-1.0, 0.5, 0.1 * x) } else { DVec3::ZERO };
                    let far = if at > 1 { DVec3::new(0.3, -0.4, 0.2) } else { DVec3::ZERO };
                    BandRow { diag: DVec3::new(4.0, 5.0 + x, 6.0), near, far }
                })
                .collect();
            let x: Vec<DVec3> = (0..count).map(|at| DVec3::new(at as f64, 1.0, -0.5 * at as f64)).collect();
            let mut r: Vec<DVec3> = (0..count).map(|at| multiply(&rows, &x, at)).collect();
            let mut factor = BandFactor::default();
            factor.factor(&rows).unwrap();
            factor.solve(&mut r);
            for (got, want) in r.iter().zip(&x) {
                assert!((*got - *want).length() < 1e-13, "{got} is not {want}"); // condition below 10
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_is_refused_at_its_row() {
        let good = BandRow { diag: DVec3::ONE, ..BandRow::ZERO };
        for wrong in [DVec3::new(1.0, -1.0, 1.0), DVec3::NAN] {
            let rows = [good, BandRow { diag: wrong, ..BandRow::ZERO }];
            assert_eq!(BandFactor::default().factor(&rows), Err(1));
        }
    }
}
