//! The matrices of a contact problem: that of the members, and that of a Newton step with the stiffness of contacts in it.
//!
//! In: members, rows, and a gain of each row. Out: products and solutions. Never here: laws of contact, steps of the iteration.
//! Theory: `docs/theory/clusters.md`, eq. 6 and 8.

use super::error::ProblemError;
use super::factor::{BlockCholesky, Pair, Place};
use super::problem::{Block, Problem};
use super::rows::Rows;
use glam::{DMat3, DVec3};

/// Contacts of a member whose exact compliance is compared with the estimate of its diagonal.
const SAMPLES: usize = 4;

/// ⊕ A/f and ⊕ A/f + Jᵀ G J, each with its factor.
#[derive(Debug, Clone, Default)]
pub(super) struct System {
    /// The lower half of ⊕ A/f, blocks counted over all members.
    blocks: Vec<Block>,
    /// The member of each block.
    owners: Vec<usize>,
    /// The inverse of each diagonal block of ⊕ A/f.
    mobilities: Vec<DMat3>,
    own: BlockCholesky,
    coupled: BlockCholesky,
    /// ⊕ A/f in the structure of `coupled`.
    base: Vec<DMat3>,
    /// Where two terms of a row meet in `coupled`.
    meetings: Vec<Meeting>,
    pairs: Vec<Pair>,
    scratch: Vec<DVec3>,
}

/// Two terms of one row, by their places among its terms, and where their product goes.
#[derive(Debug, Clone, Copy)]
struct Meeting {
    row: usize,
    left: usize,
    right: usize,
    place: Place,
}

/// Exact and estimated mobility at some contacts of a member.
#[derive(Debug, Clone, Copy, Default)]
struct Mobility {
    exact: f64,
    estimate: f64,
}

impl System {
    /// Takes up the members, and factors their matrices.
    ///
    /// # Errors
    /// [`ProblemError::NotPositiveDefinite`].
    pub fn take_members(&mut self, problem: &Problem<'_>, offsets: &[usize]) -> Result<(), ProblemError> {
        self.blocks.clear();
        self.owners.clear();
        for (place, member) in problem.members.iter().enumerate() {
            let offset = offsets[place];
            self.owners.extend(member.free.iter().map(|_| place));
            self.blocks.extend(member.blocks.iter().map(|block| Block {
                row: offset + block.row,
                column: offset + block.column,
                value: block.value * (1.0 / member.share),
            }));
        }
        self.pairs.clear();
        self.pairs.extend(self.blocks.iter().map(|block| Pair { row: block.row, column: block.column }));
        self.own.shape(self.owners.len(), &self.pairs);
        fill(&mut self.own, &self.blocks);
        self.own.factor().map_err(|block| {
            let member = self.owners[block];
            ProblemError::NotPositiveDefinite { member, block: block - offsets[member] }
        })?;
        self.mobilities.clear();
        self.mobilities.resize(self.owners.len(), DMat3::ZERO);
        for block in self.blocks.iter().filter(|block| block.row == block.column) {
            self.mobilities[block.row] += block.value;
        }
        self.mobilities.iter_mut().for_each(|m| *m = m.inverse());
        Ok(())
    }

    /// The scale of each row: the estimate of its members' diagonals, put right by some exact ones (eq. 6).
    pub fn scale_rows(&mut self, rows: &mut Rows, offsets: &[usize]) {
        let ratios = self.ratios(rows, offsets.len());
        for row in 0..rows.len() {
            let terms = rows.terms(row).iter();
            let scale: f64 = terms.map(|t| ratios[self.owners[t.block]] * self.estimate(&t.map, t.block)).sum();
            rows.set_scale(row, scale / 3.0);
        }
    }

    /// The trace of M diag(A)⁻¹ Mᵀ.
    fn estimate(&self, map: &DMat3, block: usize) -> f64 {
        let product = *map * self.mobilities[block] * map.transpose();
        product.x_axis.x + product.y_axis.y + product.z_axis.z
    }

    /// For each member the ratio of exact to estimated mobility, over a few of its rows.
    fn ratios(&mut self, rows: &Rows, members: usize) -> Vec<f64> {
        let mut ratios = vec![1.0; members];
        if self.blocks.iter().all(|block| block.row == block.column) {
            return ratios;
        }
        let mut touching: Vec<Vec<usize>> = vec![Vec::new(); members];
        for row in 0..rows.len() {
            for term in rows.terms(row) {
                let list = &mut touching[self.owners[term.block]];
                if list.last() != Some(&row) {
                    list.push(row);
                }
            }
        }
        let mut sums = vec![Mobility::default(); members];
        for sample in 0..SAMPLES {
            let chosen: Vec<_> = touching.iter().map(|list| list.get(sample * list.len() / SAMPLES).copied()).collect();
            self.sample(rows, &chosen, &mut sums);
        }
        for (ratio, sum) in ratios.iter_mut().zip(sums) {
            let exact = sum.exact / sum.estimate;
            if exact > 0.0 && exact.is_finite() {
                *ratio = exact;
            }
        }
        ratios
    }

    /// Adds the mobility of every member at one row of its own; all members share three solutions.
    fn sample(&mut self, rows: &Rows, chosen: &[Option<usize>], sums: &mut [Mobility]) {
        let size = self.owners.len();
        for axis in 0..3 {
            self.scratch.clear();
            self.scratch.resize(size, DVec3::ZERO);
            for (member, row) in chosen.iter().enumerate() {
                for term in row.iter().flat_map(|&row| rows.terms(row)).filter(|t| self.owners[t.block] == member) {
                    self.scratch[term.block] += term.map.row(axis);
                }
            }
            self.own.solve(&mut self.scratch);
            for (member, row) in chosen.iter().enumerate() {
                for term in row.iter().flat_map(|&row| rows.terms(row)).filter(|t| self.owners[t.block] == member) {
                    sums[member].exact += term.map.row(axis).dot(self.scratch[term.block]);
                    if axis == 0 {
                        sums[member].estimate += self.estimate(&term.map, term.block);
                    }
                }
            }
        }
    }

    /// Takes up where rows couple blocks: the structure of a Newton step.
    pub fn couple(&mut self, rows: &Rows) {
        self.pairs.clear();
        self.pairs.extend(self.blocks.iter().map(|block| Pair { row: block.row, column: block.column }));
        for row in 0..rows.len() {
            let terms = rows.terms(row);
            for (left, term) in terms.iter().enumerate() {
                self.pairs.extend(terms[..=left].iter().map(|other| Pair { row: term.block, column: other.block }));
            }
        }
        self.coupled.shape(self.owners.len(), &self.pairs);
        self.meetings.clear();
        for row in 0..rows.len() {
            let terms = rows.terms(row);
            for left in 0..terms.len() {
                for right in 0..=left {
                    let pair = Pair { row: terms[left].block, column: terms[right].block };
                    let place = self.coupled.place(pair);
                    self.meetings.extend(place.map(|place| Meeting { row, left, right, place }));
                }
            }
        }
        fill(&mut self.coupled, &self.blocks);
        self.base.clear();
        self.base.extend_from_slice(self.coupled.values());
    }

    /// Factors ⊕ A/f + Jᵀ G J; `false` where rounding leaves it without a factor.
    pub fn factor(&mut self, rows: &Rows, gains: &[DMat3]) -> bool {
        self.coupled.load(&self.base);
        for meeting in self.meetings.iter().filter(|meeting| gains[meeting.row] != DMat3::ZERO) {
            let terms = rows.terms(meeting.row);
            let product = gains[meeting.row] * terms[meeting.right].map;
            self.coupled.add(meeting.place, &(terms[meeting.left].map.transpose() * product));
        }
        self.coupled.factor().is_ok()
    }

    /// x ← (⊕ A/f + Jᵀ G J)⁻¹ x of the last factor.
    pub fn solve(&mut self, x: &mut [DVec3]) {
        self.coupled.solve(x);
    }

    /// x ← (⊕ A/f)⁻¹ x.
    pub fn respond(&mut self, x: &mut [DVec3]) {
        self.own.solve(x);
    }

    /// out ← ⊕ A/f x.
    pub fn multiply(&self, x: &[DVec3], out: &mut [DVec3]) {
        out.fill(DVec3::ZERO);
        for block in &self.blocks {
            out[block.row] += block.value * x[block.column];
            if block.row != block.column {
                out[block.column] += block.value.mul_transpose_vec3(x[block.row]);
            }
        }
    }
}

/// Sets a matrix to `blocks`.
fn fill(matrix: &mut BlockCholesky, blocks: &[Block]) {
    matrix.clear();
    for block in blocks {
        if let Some(place) = matrix.place(Pair { row: block.row, column: block.column }) {
            matrix.add(place, &block.value);
        }
    }
}
