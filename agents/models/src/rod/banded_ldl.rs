//! The tube's linear system: symmetric, 3×3 blocks, each row coupled to the two before it; factor, solve.
//!
//! In: [`Row`]s in the interleaved order x₀, φ₀, x₁, φ₁, … x_N ("slots": node k is slot 2k, segment k slot 2k + 1).
//! Its pairs (φ_k, x_{k+1}) are the 6×6 blocks of a block-tridiagonal matrix.
//! Out: L D Lᵀ without square roots in O(N), one answer A⁻¹ r in O(N).
//! Elimination runs from both ends simultaneously, two rows in one register, and meets in the three rows in the
//! middle: half the latency of the pivots, and half the instructions.
//! Never here: the physical meaning of the numbers, allocation once the sizes settle. Theory: docs/theory/rod.md, eq. 15–17.

use super::block::{Column, Matrix, Number, Symmetric, positive};
use super::sym3::Sym3;
use glam::{DMat3, DVec3};
use metachron_contact::solve::Response;
use wide::f64x2;

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

/// A row as elimination reads it, counted from the front's own end.
#[derive(Clone, Copy)]
struct InputRow<T> {
    diag: Symmetric<T>,
    near: Matrix<T>,
    far: Symmetric<T>,
}

/// One block row of the factor.
#[derive(Debug, Clone, Copy)]
struct Factored<T> {
    /// Inverse of the pivot P_i.
    inverse: Symmetric<T>,
    /// L(i, i − 1).
    near: Matrix<T>,
    /// L(i, i − 2).
    far: Matrix<T>,
}

/// State of elimination: the results of two rows that the next one needs.
struct Front<T> {
    /// Inverses of the pivots of rows i − 2 and i − 1.
    before: Symmetric<T>,
    last: Symmetric<T>,
    /// N_{i−1}: A(i − 1, i − 2) after elimination.
    last_near: Matrix<T>,
}

/// The result of eliminating the earlier rows from one row.
struct EliminatedRow<T> {
    near: Matrix<T>,
    far: Matrix<T>,
    /// N_i.
    changed: Matrix<T>,
    pivot: Symmetric<T>,
}

/// The factor of A. It maps impulses to velocities; contacts work through this interface ([`crate::rod`]).
#[derive(Debug, Clone, Default)]
pub struct Factor {
    /// Rows i and n − 1 − i side by side, from the ends inwards; the last two entries hold only the couplings of the middle to the rest.
    ends: Vec<Factored<f64x2>>,
    /// The three rows that are eliminated last, in order.
    middle: Box<[Factored<f64>; 3]>,
}

impl Row {
    /// All zero. (No `Default`: that of a `DMat3` is the identity.)
    pub const ZERO: Self = Self { diag: Sym3::ZERO, near: DMat3::ZERO, far: Sym3::ZERO };
}

impl From<&Row> for InputRow<f64> {
    fn from(row: &Row) -> Self {
        Self { diag: row.diag.into(), near: row.near.into(), far: row.far.into() }
    }
}

impl InputRow<f64x2> {
    /// Row i as the front elimination reads it, and row n − 1 − i as the back one does.
    #[inline(always)]
    fn both(rows: &[Row], i: usize) -> Self {
        let j = rows.len() - 1 - i;
        let (row, mirrored) = (&rows[i], &rows[j]);
        let near = rows.get(j + 1).map_or(DMat3::ZERO, |row| row.near.transpose());
        let far = rows.get(j + 2).map_or(Sym3::ZERO, |row| row.far);
        Self {
            diag: Symmetric::of(&row.diag, &mirrored.diag),
            near: Matrix::of(&row.near, &near),
            far: Symmetric::of(&row.far, &far),
        }
    }
}

impl<T: Number> Default for Factored<T> {
    fn default() -> Self {
        Self { inverse: Symmetric::ZERO, near: Matrix::ZERO, far: Matrix::ZERO }
    }
}

impl<T: Number> Front<T> {
    const START: Self = Self { before: Symmetric::ZERO, last: Symmetric::ZERO, last_near: Matrix::ZERO };

    /// Eliminates the earlier rows from the next one (eq. 16).
    #[inline(always)]
    fn reach(&self, row: &InputRow<T>) -> EliminatedRow<T> {
        let across = row.far.full();
        let far = self.before.after(&across);
        let changed = row.near.minus_across(&far, &self.last_near);
        let near = self.last.after(&changed);
        let pivot = row.diag.minus_across(&far, &across).minus_across(&near, &changed);
        EliminatedRow { near, far, changed, pivot }
    }

    /// Eliminates the next row; also returns the minors that must be positive and finite.
    #[inline(always)]
    fn eliminate(&mut self, row: &InputRow<T>) -> (Factored<T>, [T; 3]) {
        let EliminatedRow { near, far, changed, pivot } = self.reach(row);
        let (inverse, minors) = pivot.inverse();
        self.pass(changed, inverse);
        (Factored { inverse, near, far }, minors)
    }

    /// Advances past a row.
    #[inline(always)]
    fn pass(&mut self, changed: Matrix<T>, inverse: Symmetric<T>) {
        *self = Self { before: self.last, last: inverse, last_near: changed };
    }
}

impl Response for Factor {
    fn respond(&self, impulses: &mut [DVec3]) {
        self.solve(impulses);
    }
}

impl Factor {
    /// Number of slots of the matrix; zero before the first factorisation.
    pub fn slots(&self) -> usize {
        if self.ends.is_empty() { 0 } else { 2 * self.pairs() + 3 }
    }

    /// Number of rows eliminated from each end.
    fn pairs(&self) -> usize {
        self.ends.len().saturating_sub(2)
    }

    /// Memory in use, bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.ends[..]) + size_of_val(&*self.middle)
    }

    /// Discards the factor.
    pub fn forget(&mut self) {
        self.ends.clear();
    }

    /// Factors a matrix with an odd number of rows, at least three (eq. 16).
    ///
    /// # Errors
    /// A slot whose pivot is not positive definite.
    pub fn factor(&mut self, rows: &[Row]) -> Result<(), usize> {
        let pairs = (rows.len() - 3) / 2;
        self.ends.resize(pairs + 2, Factored::default());
        let mut front = Front::START;
        for (i, out) in self.ends[..pairs].iter_mut().enumerate() {
            let (row, minors) = front.eliminate(&InputRow::both(rows, i));
            if let Some(lane) = Column(minors).apart().iter().position(|&Column(minors)| !positive(minors)) {
                return Err([i, rows.len() - 1 - i][lane]);
            }
            *out = row;
        }
        let middle = self.link(front, rows);
        let mut front = Front::START;
        for (i, out) in self.middle.iter_mut().enumerate() {
            let (row, minors) = front.eliminate(&middle[i]);
            if !positive(minors) {
                return Err(pairs + i);
            }
            *out = row;
        }
        Ok(())
    }

    /// Stores the couplings of the three middle rows to those eliminated before, and returns the middle with those eliminated.
    fn link(&mut self, mut front: Front<f64x2>, rows: &[Row]) -> [InputRow<f64>; 3] {
        let pairs = self.pairs();
        let first = front.reach(&InputRow { diag: Symmetric::ZERO, ..InputRow::both(rows, pairs) });
        front.pass(first.changed, Symmetric::ZERO);
        // the couplings within the middle are eliminated later, in `factor`
        let second =
            front.reach(&InputRow { diag: Symmetric::ZERO, near: Matrix::ZERO, ..InputRow::both(rows, pairs + 1) });
        for (out, reached) in self.ends[pairs..].iter_mut().zip([&first, &second]) {
            *out = Factored { inverse: Symmetric::ZERO, near: reached.near, far: reached.far };
        }
        let mut middle: [InputRow<f64>; 3] = std::array::from_fn(|i| InputRow::from(&rows[pairs + i]));
        (middle[0].near, middle[0].far, middle[1].far) = (Matrix::ZERO, Symmetric::ZERO, Symmetric::ZERO);
        let ([front, back], [front_next, back_next]) = (first.pivot.apart(), second.pivot.apart());
        let [front_link, back_link] = second.changed.apart();
        middle[0].diag = middle[0].diag.plus(front);
        middle[1].diag = middle[1].diag.plus(front_next).plus(back_next);
        middle[2].diag = middle[2].diag.plus(back);
        middle[1].near = middle[1].near.plus(front_link);
        middle[2].near = middle[2].near.plus(back_link.transposed());
        middle
    }

    /// Replaces the right side r by A⁻¹ r (eq. 17): impulses, one per slot, become the velocities they cause.
    pub fn solve(&self, r: &mut [DVec3]) {
        let pairs = self.pairs();
        let (mut before, mut last) = (Column::ZERO, Column::ZERO);
        for (i, row) in self.ends[..pairs].iter().enumerate() {
            let y = both(r, i).minus(&row.far, before).minus(&row.near, last);
            put(r, i, row.inverse.times(y));
            (before, last) = (last, y);
        }
        let [first, second] = [&self.ends[pairs], &self.ends[pairs + 1]];
        let given = Column::ZERO.minus(&first.far, before).minus(&first.near, last);
        let given_next = Column::ZERO.minus(&second.far, last);
        for (i, given) in [(pairs, given), (pairs + 1, given_next)] {
            let [front, back] = given.apart().map(DVec3::from);
            r[i] += front;
            r[self.slots() - 1 - i] += back;
        }
        self.solve_middle(&mut r[pairs..pairs + 3]);
        let (mut after, mut next) = (both(r, pairs + 1), both(r, pairs));
        for i in (0..pairs).rev() {
            let x = both(r, i)
                .minus_transposed(&self.ends[i + 2].far, after)
                .minus_transposed(&self.ends[i + 1].near, next);
            put(r, i, x);
            (after, next) = (next, x);
        }
    }

    /// The same for the three middle rows, after the others have been eliminated from them.
    fn solve_middle(&self, r: &mut [DVec3]) {
        let [a, b, c] = &*self.middle;
        let y0 = Column::from(r[0]);
        let y1 = Column::from(r[1]).minus(&b.near, y0);
        let y2 = Column::from(r[2]).minus(&c.far, y0).minus(&c.near, y1);
        let x2 = c.inverse.times(y2);
        let x1 = b.inverse.times(y1).minus_transposed(&c.near, x2);
        let x0 = a.inverse.times(y0).minus_transposed(&c.far, x2).minus_transposed(&b.near, x1);
        for (r, x) in r.iter_mut().zip([x0, x1, x2]) {
            *r = x.into();
        }
    }
}

/// Slot i and slot n − 1 − i, side by side.
#[inline(always)]
fn both(r: &[DVec3], i: usize) -> Column<f64x2> {
    Column::of(r[i], r[r.len() - 1 - i])
}

/// Writes them back.
#[inline(always)]
fn put(r: &mut [DVec3], i: usize, value: Column<f64x2>) {
    let [front, back] = value.apart().map(DVec3::from);
    let j = r.len() - 1 - i;
    (r[i], r[j]) = (front, back);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A positive definite band matrix of `n` rows with entries of order one, from a fixed sequence.
    pub fn example(n: usize) -> Vec<Row> {
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
        for n in [3, 5, 7, 17] {
            let rows = example(n);
            let mut factor = Factor::default();
            factor.factor(&rows).unwrap();
            assert_eq!(factor.slots(), n);
            let x: Vec<_> = (0..n).map(|i| DVec3::new(i as f64, 1.0, -0.5 * i as f64)).collect();
            let mut r = multiply(&rows, &x);
            factor.solve(&mut r);
            for (got, want) in r.iter().zip(&x) {
                assert!((*got - *want).length() < 1e-12, "{got} is not {want}"); // error of 17 rows at 3e-16, condition number below 100
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_is_refused_at_its_slot() {
        for slot in [0, 1, 4, 6, 7, 8] {
            for wrong in [DVec3::new(1.0, -1.0, 1.0), DVec3::NAN] {
                let mut rows = example(9);
                rows[slot].diag = Sym3::diagonal(wrong);
                assert_eq!(Factor::default().factor(&rows), Err(slot));
            }
        }
    }
}
