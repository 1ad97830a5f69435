//! The direct form of a Newton step: ⊕ A/f and ⊕ A/f + Jᵀ G J by their sparse factors.
//!
//! In: members, rows, and a gain of each row. Out: solutions to rounding. Never here: which form is used, laws of contact.
//! Theory: `docs/theory/clusters.md`, eq. 8.

use super::factor::{BlockCholesky, Pair, Place};
use super::members::Members;
use super::problem::Block;
use super::rows::Rows;
use glam::{DMat3, DVec3};

/// Both matrices, each with its factor.
#[derive(Debug, Clone, Default)]
pub(super) struct Direct {
    own: BlockCholesky,
    coupled: BlockCholesky,
    /// ⊕ A/f in the structure of `coupled`.
    base: Vec<DMat3>,
    /// Where two terms of a row meet in `coupled`.
    meetings: Vec<Meeting>,
    pairs: Vec<Pair>,
    /// Factors of the coupled matrix since the members were taken up.
    pub factors: usize,
}

/// Two terms of one row, by their places among its terms, and where their product goes.
#[derive(Debug, Clone, Copy)]
struct Meeting {
    row: usize,
    left: usize,
    right: usize,
    place: Place,
}

impl Direct {
    /// Factors the members' matrices.
    ///
    /// # Errors
    /// The block at which one is not positive definite.
    pub fn take_members(&mut self, members: &Members) -> Result<(), usize> {
        self.factors = 0;
        self.pairs.clear();
        self.pairs.extend(members.blocks.iter().map(|block| Pair { row: block.row, column: block.column }));
        self.own.shape(members.size(), &self.pairs);
        fill(&mut self.own, &members.blocks);
        self.own.factor()
    }

    /// Takes up where rows couple blocks: the structure of a Newton step.
    pub fn couple(&mut self, members: &Members, rows: &Rows) {
        self.pairs.clear();
        self.pairs.extend(members.blocks.iter().map(|block| Pair { row: block.row, column: block.column }));
        for row in 0..rows.len() {
            let terms = rows.terms(row);
            for (left, term) in terms.iter().enumerate() {
                self.pairs.extend(terms[..=left].iter().map(|other| Pair { row: term.block, column: other.block }));
            }
        }
        self.coupled.shape(members.size(), &self.pairs);
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
        fill(&mut self.coupled, &members.blocks);
        self.base.clear();
        self.base.extend_from_slice(self.coupled.values());
    }

    /// Factors ⊕ A/f + Jᵀ G J; `false` where rounding leaves it without a factor.
    pub fn factor(&mut self, rows: &Rows, gains: &[DMat3]) -> bool {
        self.factors += 1;
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
}

/// Sets a matrix to those of `blocks` that it has room for.
pub(super) fn fill(matrix: &mut BlockCholesky, blocks: &[Block]) {
    matrix.clear();
    for block in blocks {
        if let Some(place) = matrix.place(Pair { row: block.row, column: block.column }) {
            matrix.add(place, &block.value);
        }
    }
}
