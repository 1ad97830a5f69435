//! Sparse Cholesky factor of a symmetric positive definite matrix of 3 × 3 blocks (DAV06, ch. 4).
//!
//! In: which blocks there are, then their numbers. Out: solutions. Never here: where the matrix comes from.
//! The order and the structure are kept while all blocks lie in it, fill included; numbers then change without allocation.
//! The numeric part looks left: each column collects what the finished columns before it give.

use super::order::minimum_degree;
use glam::{DMat3, DVec3};

/// Two blocks that are coupled, in either order; a block with itself is its diagonal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Pair {
    pub row: usize,
    pub column: usize,
}

/// Where a block is stored, and whether as its transpose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    index: usize,
    transposed: bool,
}

/// No column, as the end of a list.
const NONE: usize = usize::MAX;

/// The matrix, or its factor: columns in the order of elimination, each from its diagonal down.
#[derive(Debug, Clone, Default)]
pub(super) struct BlockCholesky {
    /// Where each block stands in the order.
    rank: Vec<usize>,
    /// Where each column starts in `rows` and `values`; one more for the end.
    starts: Vec<usize>,
    rows: Vec<usize>,
    /// After [`Self::factor`] the diagonal blocks are the inverses of the factor's.
    values: Vec<DMat3>,
    /// For each column the first of the columns that give to it next, and the one after each in such a list.
    heads: Vec<usize>,
    nexts: Vec<usize>,
    /// For each finished column the entry that gives next.
    cursors: Vec<usize>,
    /// Where each row is in the column that collects.
    spots: Vec<usize>,
    permuted: Vec<DVec3>,
}

impl BlockCholesky {
    /// Makes room for a matrix of `size` blocks with these couplings; returns whether a new order was needed.
    pub fn shape(&mut self, size: usize, pairs: &[Pair]) -> bool {
        if self.rank.len() == size && pairs.iter().all(|&pair| self.place(pair).is_some()) {
            return false;
        }
        let mut neighbours = vec![Vec::new(); size];
        for pair in pairs.iter().filter(|pair| pair.row != pair.column) {
            neighbours[pair.row].push(pair.column);
            neighbours[pair.column].push(pair.row);
        }
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
        }
        let order = minimum_degree(neighbours.clone());
        self.rank = vec![0; size];
        order.iter().enumerate().for_each(|(rank, &block)| self.rank[block] = rank);
        self.structure(&order, &neighbours);
        for list in [&mut self.heads, &mut self.nexts, &mut self.cursors, &mut self.spots] {
            *list = vec![NONE; size];
        }
        self.values = vec![DMat3::ZERO; self.rows.len()];
        self.permuted = vec![DVec3::ZERO; size];
        true
    }

    /// The rows of every column of the factor: those of the matrix, and those of all columns whose first row it is.
    fn structure(&mut self, order: &[usize], neighbours: &[Vec<usize>]) {
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); order.len()];
        self.starts = vec![0];
        self.rows.clear();
        for (rank, &block) in order.iter().enumerate() {
            let mut column: Vec<usize> =
                neighbours[block].iter().map(|&other| self.rank[other]).filter(|&row| row > rank).collect();
            for &child in &children[rank] {
                let rows = &self.rows[self.starts[child] + 1..self.starts[child + 1]];
                column.extend(rows.iter().copied().filter(|&row| row > rank));
            }
            column.sort_unstable();
            column.dedup();
            if let Some(&parent) = column.first() {
                children[parent].push(rank);
            }
            self.rows.push(rank);
            self.rows.extend(column);
            self.starts.push(self.rows.len());
        }
    }

    /// Where a block is stored; `None` where the structure has no room for it.
    pub fn place(&self, pair: Pair) -> Option<Place> {
        let [row, column] = [self.rank.get(pair.row)?, self.rank.get(pair.column)?];
        let [low, high] = [row.min(column), row.max(column)];
        let start = self.starts[*low];
        let at = self.rows[start..self.starts[low + 1]].binary_search(high).ok()?;
        Some(Place { index: start + at, transposed: row < column })
    }

    /// Sets all blocks to zero.
    pub fn clear(&mut self) {
        self.values.fill(DMat3::ZERO);
    }

    /// The numbers as they stand, to be taken up again by [`Self::load`].
    pub fn values(&self) -> &[DMat3] {
        &self.values
    }

    /// Takes numbers that [`Self::values`] gave.
    pub fn load(&mut self, values: &[DMat3]) {
        self.values.copy_from_slice(values);
    }

    /// Adds to a block.
    pub fn add(&mut self, place: Place, value: &DMat3) {
        self.values[place.index] += if place.transposed { value.transpose() } else { *value };
    }

    /// Replaces the matrix by its factor.
    ///
    /// # Errors
    /// The block at which the matrix is not positive definite; the numbers are lost then.
    pub fn factor(&mut self) -> Result<(), usize> {
        self.heads.fill(NONE);
        for column in 0..self.rank.len() {
            self.collect(column);
            let (start, end) = (self.starts[column], self.starts[column + 1]);
            let Some(inverse) = inverse_of_lower(&self.values[start]) else {
                return Err(self.rank.iter().position(|&rank| rank == column).unwrap_or_default());
            };
            self.values[start] = inverse;
            let upper = inverse.transpose();
            self.values[start + 1..end].iter_mut().for_each(|value| *value *= upper);
            self.hand_on(column, start + 1);
        }
        Ok(())
    }

    /// Takes from a column what all finished columns with a block in its row give.
    fn collect(&mut self, column: usize) {
        let (start, end) = (self.starts[column], self.starts[column + 1]);
        self.rows[start..end].iter().enumerate().for_each(|(at, &row)| self.spots[row] = at);
        let mut giver = self.heads[column];
        while giver != NONE {
            let following = self.nexts[giver];
            let (from, to) = (self.cursors[giver], self.starts[giver + 1]);
            let (done, rest) = self.values.split_at_mut(start);
            let right = done[from].transpose();
            for (row, left) in self.rows[from..to].iter().zip(&done[from..to]) {
                rest[self.spots[*row]] -= *left * right;
            }
            self.hand_on(giver, from + 1);
            giver = following;
        }
    }

    /// Puts a finished column into the list of the column that its entry `at` belongs to.
    fn hand_on(&mut self, giver: usize, at: usize) {
        self.cursors[giver] = at;
        if at < self.starts[giver + 1] {
            let taker = self.rows[at];
            self.nexts[giver] = self.heads[taker];
            self.heads[taker] = giver;
        }
    }

    /// Replaces the right side, one vector for each block, by the solution; the matrix must be factored.
    pub fn solve(&mut self, x: &mut [DVec3]) {
        let Self { rank, starts, rows, values, permuted, .. } = self;
        rank.iter().zip(&*x).for_each(|(&rank, value)| permuted[rank] = *value);
        for column in 0..rank.len() {
            let (start, end) = (starts[column], starts[column + 1]);
            let own = values[start] * permuted[column];
            permuted[column] = own;
            rows[start + 1..end].iter().zip(&values[start + 1..end]).for_each(|(&row, l)| permuted[row] -= *l * own);
        }
        for column in (0..rank.len()).rev() {
            let (start, end) = (starts[column], starts[column + 1]);
            let below = rows[start + 1..end].iter().zip(&values[start + 1..end]);
            let left = below.fold(permuted[column], |sum, (&row, l)| sum - l.mul_transpose_vec3(permuted[row]));
            permuted[column] = values[start].mul_transpose_vec3(left);
        }
        rank.iter().zip(x).for_each(|(&rank, value)| *value = permuted[rank]);
    }
}

/// The inverse of the lower Cholesky factor of a symmetric block; `None` where it is not positive definite.
fn inverse_of_lower(m: &DMat3) -> Option<DMat3> {
    let root = |left: f64| (left > 0.0 && left.is_finite()).then(|| left.sqrt());
    let a = root(m.x_axis.x)?;
    let (b, c) = (m.x_axis.y / a, m.x_axis.z / a);
    let d = root(m.y_axis.y - b * b)?;
    let e = (m.y_axis.z - b * c) / d;
    let f = root(m.z_axis.z - c * c - e * e)?;
    let (ia, id, inverse_f) = (1.0 / a, 1.0 / d, 1.0 / f);
    let ba = -b * ia * id;
    Some(DMat3::from_cols(
        DVec3::new(ia, ba, -(c * ia + e * ba) * inverse_f),
        DVec3::new(0.0, id, -e * id * inverse_f),
        DVec3::new(0.0, 0.0, inverse_f),
    ))
}
