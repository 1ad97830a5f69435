//! The direct form of a Newton step: ⊕ A/f and ⊕ A/f + Jᵀ G J by their sparse factors.
//!
//! In: members, rows, and a gain of each row. Out: solutions to rounding. Never here: which form is used, laws of contact.
//! Theory: `docs/theory/clusters.md`, eq. 8.

use super::coupled::Coupled;
use super::factor::{Cholesky, Pair};
use super::members::Members;
use super::rows::Rows;
use glam::{DMat3, DVec3};

/// Both matrices, each with its factor.
#[derive(Debug, Clone, Default)]
pub(super) struct Direct {
    own: Cholesky,
    coupled: Coupled,
    pairs: Vec<Pair>,
    /// Factors of the coupled matrix since the members were taken up.
    pub factors: usize,
}

impl Direct {
    /// Factors the members' matrices.
    ///
    /// # Errors
    /// The block at which one is not positive definite.
    pub fn take_members(&mut self, members: &Members) -> Result<(), usize> {
        self.factors = 0;
        self.list(members);
        self.own.shape(members.size(), &self.pairs);
        self.own.set(&members.blocks);
        self.own.factor(|_, _| ())
    }

    /// Takes up where rows couple blocks: the structure of a Newton step.
    pub fn couple(&mut self, members: &Members, rows: &Rows) {
        self.list(members);
        self.coupled.take(members.size(), &members.blocks, &mut self.pairs, Some(rows));
        self.coupled.meet(rows);
    }

    fn list(&mut self, members: &Members) {
        self.pairs.clear();
        self.pairs.extend(members.blocks.iter().map(|block| Pair { row: block.row, column: block.column }));
    }

    /// Factors ⊕ A/f + Jᵀ G J; `false` where rounding leaves it without a factor.
    pub fn factor(&mut self, rows: &Rows, gains: &[DMat3]) -> bool {
        self.factors += 1;
        self.coupled.factor(rows, gains)
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
