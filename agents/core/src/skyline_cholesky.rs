//! Cholesky factor of a symmetric positive definite matrix in double precision, each row stored from its first entry on.
//!
//! In: the first body that each body is coupled to, and blocks of B rows. Out: the solution. Never here: where the matrix comes from.
//! The factor of a chain has constant width, so its cost is linear in the chain's length.

use glam::DVec3;

/// A block of a matrix: the coupling of one body with another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlockIndex {
    /// The body whose rows it is in.
    pub row: usize,
    /// The body whose columns it is in, at most `row` in the lower half.
    pub column: usize,
}

impl BlockIndex {
    /// The block on the diagonal of a body.
    #[must_use]
    pub const fn diagonal(body: usize) -> Self {
        Self { row: body, column: body }
    }
}

/// The lower half of a matrix with B rows per body.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SkylineCholesky<const B: usize> {
    /// First column of each row.
    first: Vec<usize>,
    /// Where each row starts in `values`.
    start: Vec<usize>,
    values: Vec<f64>,
}

impl<const B: usize> SkylineCholesky<B> {
    /// Allocates the envelope, all zero: body i is coupled to no body below `first_body[i]` ≤ i.
    pub fn shape(&mut self, first_body: &[u32]) {
        self.first.clear();
        self.start.clear();
        let mut size = 0;
        for (body, &first) in first_body.iter().enumerate() {
            for row in B * body..B * body + B {
                self.first.push(B * first as usize);
                self.start.push(size);
                size += row + 1 - B * first as usize;
            }
        }
        self.values.clear();
        self.values.resize(size, 0.0);
    }

    /// Cost of a factorisation: the sum of squares of the row widths.
    pub fn work(first_body: &[u32]) -> usize {
        first_body.iter().enumerate().map(|(body, &first)| B * (B * (body + 1 - first as usize)).pow(2)).sum()
    }

    /// Adds `weight` · left rightᵀ to a block of the lower half; of one on the diagonal only the lower half counts.
    pub fn add(&mut self, block: BlockIndex, weight: f64, left: [f64; B], right: [f64; B]) {
        let BlockIndex { row, column } = block;
        for (i, &l) in left.iter().enumerate() {
            let at = B * row + i;
            let columns = if row == column { i + 1 } else { B };
            let from = self.start[at] + B * column - self.first[at];
            let scaled = weight * l;
            self.values[from..from + columns].iter_mut().zip(right).for_each(|(value, r)| *value += scaled * r);
        }
    }

    /// Adds numbers, given by rows, to a block of the lower half; of one on the diagonal only the lower half counts.
    pub fn add_block(&mut self, block: BlockIndex, numbers: [[f64; B]; B]) {
        let BlockIndex { row, column } = block;
        for (i, values) in numbers.iter().enumerate() {
            let at = B * row + i;
            let columns = if row == column { i + 1 } else { B };
            let from = self.start[at] + B * column - self.first[at];
            self.values[from..from + columns].iter_mut().zip(values).for_each(|(value, add)| *value += add);
        }
    }

    /// Sets all entries to zero and keeps the shape.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// The diagonal entry of a row.
    pub fn diagonal(&self, row: usize) -> f64 {
        self.values[self.start[row] + row - self.first[row]]
    }

    /// Copies `other` into the existing storage.
    pub fn copy_from(&mut self, other: &Self) {
        self.first.clone_from(&other.first);
        self.start.clone_from(&other.start);
        self.values.clone_from(&other.values);
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.first.len()
    }

    /// Replaces the matrix by its factor; `false` where it is not positive definite.
    pub fn factor(&mut self) -> bool {
        (0..self.rows() / B).all(|body| self.factor_body(B * body))
    }

    /// Factors the B rows of a body, beginning with row `i`: all B together against the rows of earlier bodies, so that
    /// each earlier row is read once.
    fn factor_body(&mut self, i: usize) -> bool {
        let Self { first, start, values } = self;
        let (done, mut rest) = values.split_at_mut(start[i]);
        let (first_i, width) = (first[i], i - first[i]);
        let mut rows: [&mut [f64]; B] = std::array::from_fn(|k| {
            let (row, after) = std::mem::take(&mut rest).split_at_mut(width + k + 1);
            rest = after;
            row
        });
        for j in first_i..i {
            let (first_j, at) = (first[j], j - first_i);
            let from = first_i.max(first_j);
            let row_j = &done[start[j]..=start[j] + j - first_j];
            let sums = dots(rows.each_ref().map(|row| &row[from - first_i..at]), &row_j[from - first_j..j - first_j]);
            rows.iter_mut().zip(sums).for_each(|(row, sum)| row[at] = (row[at] - sum) / row_j[j - first_j]);
        }
        for k in 0..B {
            let (above, below) = rows.split_at_mut(k);
            let row = &mut *below[0];
            for (l, upper) in above.iter().enumerate() {
                let at = width + l;
                row[at] = (row[at] - dot(&row[..at], &upper[..at])) / upper[at];
            }
            let own = &row[..width + k];
            let left = row[width + k] - dot(own, own);
            if left.is_nan() || left <= 0.0 {
                return false;
            }
            row[width + k] = left.sqrt();
        }
        true
    }

    /// Replaces the right side `x` by the solution; the matrix must be factored.
    pub fn solve(&self, x: &mut [f64]) {
        let count = self.first.len();
        for i in 0..count {
            let row = &self.values[self.start[i]..=self.start[i] + i - self.first[i]];
            let (diagonal, row) = (row[row.len() - 1], &row[..row.len() - 1]);
            x[i] = (x[i] - dot(row, &x[self.first[i]..i])) / diagonal;
        }
        for i in (0..count).rev() {
            let row = &self.values[self.start[i]..=self.start[i] + i - self.first[i]];
            let value = x[i] / row[row.len() - 1];
            x[i] = value;
            let columns = &mut x[self.first[i]..i];
            columns.iter_mut().zip(row).for_each(|(below, l)| *below -= l * value);
        }
    }
}

impl SkylineCholesky<3> {
    /// Replaces the right side `x`, one vector per body, by the solution; the matrix must be factored.
    pub fn solve_vectors(&self, x: &mut [DVec3]) {
        for (body, row) in (0..x.len()).flat_map(|body| (0..3).map(move |axis| (body, 3 * body + axis))) {
            let (first, values) = (self.first[row] / 3, self.row(row));
            let (before, own) = values.split_at(3 * (body - first));
            let left = x[body][row % 3] - dot_vectors(before, &x[first..body]);
            let (axis, done) = (row % 3, x[body]);
            let inner: f64 = (0..axis).map(|k| own[k] * done[k]).sum();
            x[body][axis] = (left - inner) / own[axis];
        }
        for (body, row) in (0..x.len()).rev().flat_map(|body| (0..3).rev().map(move |axis| (body, 3 * body + axis))) {
            let (first, values) = (self.first[row] / 3, self.row(row));
            let (before, own) = values.split_at(3 * (body - first));
            let axis = row % 3;
            let value = x[body][axis] / own[axis];
            x[body][axis] = value;
            (0..axis).for_each(|k| x[body][k] -= own[k] * value);
            let below = x[first..body].iter_mut().zip(before.chunks_exact(3));
            below.for_each(|(below, l)| *below -= DVec3::from_slice(l) * value);
        }
    }

    fn row(&self, row: usize) -> &[f64] {
        &self.values[self.start[row]..=self.start[row] + row - self.first[row]]
    }
}

/// Dot product in six lanes: a fixed order of summation, so the same bits everywhere.
fn dot_vectors(a: &[f64], b: &[DVec3]) -> f64 {
    let mut lanes = [DVec3::ZERO; 2];
    for (k, (a, b)) in a.chunks_exact(3).zip(b).enumerate() {
        lanes[k % 2] += DVec3::from_slice(a) * *b;
    }
    (lanes[0] + lanes[1]).element_sum()
}

/// Dot product in four lanes: a fixed order of summation, so the same bits everywhere.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    dots([a], b)[0]
}

/// Dot products of several rows with one: the bits of each are those of [`dot`].
fn dots<const N: usize>(all: [&[f64]; N], b: &[f64]) -> [f64; N] {
    let (b4, rest) = b.as_chunks::<4>();
    let all = all.map(|a| (&a.as_chunks::<4>().0[..b4.len()], &a[4 * b4.len()..b.len()]));
    let mut lanes = [[0.0; 4]; N];
    for (at, b) in b4.iter().enumerate() {
        for (lanes, (a, _)) in lanes.iter_mut().zip(&all) {
            (0..4).for_each(|k| lanes[k] += a[at][k] * b[k]);
        }
    }
    std::array::from_fn(|n| {
        let [a, b, c, d] = lanes[n];
        let last: f64 = all[n].1.iter().zip(rest).map(|(x, y)| x * y).sum();
        (a + b) + (c + d) + last
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solving_vectors_gives_what_solving_numbers_gives() {
        let first_body = [0, 0, 1, 0, 3];
        let mut matrix = SkylineCholesky::<3>::default();
        matrix.shape(&first_body);
        for (row, &first) in first_body.iter().enumerate() {
            for column in first as usize..=row {
                let value = |k: usize| 0.1 * libm::sin((7 * row + 3 * column + k) as f64);
                let own = if row == column { 3.0 } else { 0.0 };
                let block: [[f64; 3]; 3] =
                    std::array::from_fn(|i| std::array::from_fn(|j| value(3 * i + j) + if i == j { own } else { 0.0 }));
                matrix.add_block(BlockIndex { row, column }, block);
            }
        }
        assert!(matrix.factor());
        let mut flat: Vec<f64> = (0..15).map(|i| libm::cos(f64::from(i))).collect();
        let mut vectors: Vec<DVec3> = flat.chunks_exact(3).map(DVec3::from_slice).collect();
        matrix.solve(&mut flat);
        matrix.solve_vectors(&mut vectors);
        for (vector, numbers) in vectors.iter().zip(flat.chunks_exact(3)) {
            assert!(vector.distance(DVec3::from_slice(numbers)) < 1e-14); // rounding in another order
        }
    }

    #[test]
    fn the_factor_solves_its_system() {
        let first_body = [0, 0, 1, 0, 3];
        let mut matrix = SkylineCholesky::<6>::default();
        matrix.shape(&first_body);
        let mut full = vec![vec![0.0; 30]; 30];
        let unit = |i: usize| std::array::from_fn(|k| f64::from(u8::from(k == i)));
        for body in 0..5 {
            for i in 0..6 {
                matrix.add(BlockIndex::diagonal(body), 3.0, unit(i), unit(i));
                full[6 * body + i][6 * body + i] += 3.0;
            }
        }
        for (seed, (a, b)) in [(1, 0), (2, 1), (3, 0), (4, 3), (3, 2)].into_iter().enumerate() {
            let row = |k: usize| std::array::from_fn::<f64, 6, _>(|i| libm::sin((seed * 13 + k * 7 + i) as f64));
            let (left, right) = (row(0), row(1));
            matrix.add(BlockIndex::diagonal(a), 10.0, left, left);
            matrix.add(BlockIndex::diagonal(b), 10.0, right, right);
            matrix.add(BlockIndex { row: a, column: b }, 10.0, left, right);
            for i in 0..6 {
                for j in 0..6 {
                    full[6 * a + i][6 * a + j] += 10.0 * left[i] * left[j];
                    full[6 * b + i][6 * b + j] += 10.0 * right[i] * right[j];
                    full[6 * a + i][6 * b + j] += 10.0 * left[i] * right[j];
                    full[6 * b + j][6 * a + i] += 10.0 * left[i] * right[j];
                }
            }
        }
        let right: Vec<f64> = (0..30).map(|i| libm::cos(f64::from(i))).collect();
        let mut x = right.clone();
        assert!(matrix.factor());
        matrix.solve(&mut x);
        for (row, wanted) in full.iter().zip(&right) {
            let got: f64 = row.iter().zip(&x).map(|(a, x)| a * x).sum();
            assert!((got - wanted).abs() < 1e-12, "{got} is not {wanted}"); // rounding of a sum of 30 numbers near 10
        }
    }
}
