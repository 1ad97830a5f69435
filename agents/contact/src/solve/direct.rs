//! The direct form of a Newton step: ⊕ A/f and ⊕ A/f + Jᵀ G J by their sparse factors.
//!
//! In: members, rows, and a gain of each row. Out: solutions to rounding. Never here: which form is used, laws of contact.
//! Theory: `docs/theory/clusters.md`, eq. 8.

use super::coupled::{Coupled, PlacedRows};
use super::factor::{Cholesky, Pair};
use super::members::Members;
use super::problem::Block;
use super::rows::Rows;
use super::skew::Stiffness;
use glam::DVec3;
use metachron_core::{Archive, ArchiveError, ParallelFor};

/// Both matrices, each with its factor.
#[derive(Debug, Clone, Default)]
pub(super) struct Direct {
    /// Of the members that lend no factor.
    own: Cholesky,
    /// The blocks of these, as `own` counts them: what each is called over all members.
    lone: Vec<usize>,
    blocks: Vec<Block>,
    x: Vec<DVec3>,
    coupled: Coupled,
    /// What each block is called in `coupled`.
    places: Vec<usize>,
    pairs: Vec<Pair>,
    /// Factors of the coupled matrix since the members were taken up.
    pub factors: usize,
}

impl Direct {
    /// Writes or reads what the next problem needs: the orders of both factors.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.own.archive(archive)?;
        self.coupled.archive(archive)
    }

    /// Factors the members' matrices.
    ///
    /// # Errors
    /// The block at which one is not positive definite.
    pub fn take_members(&mut self, members: &Members, threads: &dyn ParallelFor) -> Result<(), usize> {
        self.factors = 0;
        let Self { own, lone, blocks, pairs, x, .. } = self;
        lone.clear();
        lone.extend((0..members.size()).filter(|&block| !members.lends[members.owners[block]]));
        let place = |block: usize| lone.binary_search(&block).ok();
        blocks.clear();
        blocks.extend(
            members
                .blocks
                .iter()
                .filter(|block| !members.lends[members.owners[block.row]])
                .filter_map(|block| Some(Block { row: place(block.row)?, column: place(block.column)?, ..*block })),
        );
        pairs.clear();
        pairs.extend(blocks.iter().map(|block| Pair { row: block.row, column: block.column }));
        x.clear();
        x.resize(lone.len(), DVec3::ZERO);
        own.shape(lone.len(), pairs, &[]);
        own.set(blocks);
        own.factor(threads, |_, _| ()).map_err(|block| lone[block])
    }

    /// Takes up where rows couple blocks: the structure of a Newton step.
    pub fn couple(&mut self, members: &Members, rows: &Rows) {
        self.pairs.clear();
        self.pairs.extend(members.blocks.iter().map(|block| Pair { row: block.row, column: block.column }));
        self.places.clear();
        self.places.extend(0..members.size());
        let rows = PlacedRows { rows, places: &self.places };
        self.coupled.take(members.size(), &members.blocks, &mut self.pairs, rows);
        self.coupled.meet(rows);
    }

    /// Factors ⊕ A/f + Jᵀ G J; `false` where rounding leaves it without a factor.
    pub fn factor(&mut self, contacts: Stiffness<'_>) -> bool {
        self.factors += 1;
        self.coupled.factor(contacts)
    }

    /// x ← (⊕ A/f + Jᵀ G J)⁻¹ x of the last factor.
    pub fn solve(&mut self, x: &mut [DVec3]) {
        self.coupled.solve(x);
    }

    /// x ← (⊕ A/f)⁻¹ x, where members lend no factor.
    pub fn respond(&mut self, x: &mut [DVec3]) {
        let Self { own, lone, x: own_x, .. } = self;
        own_x.iter_mut().zip(&*lone).for_each(|(own, &block)| *own = x[block]);
        own.solve(own_x);
        own_x.iter().zip(&*lone).for_each(|(own, &block)| x[block] = *own);
    }
}
