//! The sparse factor of one body's matrix, as it lends it to the problem of its cluster.
//!
//! In: blocks of a symmetric positive definite matrix. Out: A⁻¹ of impulses. Never here: contacts, other bodies.

use super::factor::{Cholesky, Pair};
use crate::lists::refill;
use crate::solve::statement::problem::{Block, Response};
use glam::DVec3;
use metachron_core::ParallelFor;
use std::sync::{Mutex, PoisonError};

/// A sparse matrix of 3 × 3 blocks with its Cholesky factor, front by front (Duff and Reid 1983), in an order of minimum degree.
///
/// The structure is found once and kept while all blocks lie in it; nothing is then allocated, and an unchanged part is not factored
/// again. Its numbers have the same bits on every processor and by however many threads.
#[derive(Debug, Default)]
pub struct SparseFactor {
    /// Locked for its storage: a solution changes nothing that another sees.
    factor: Mutex<Cholesky>,
    pairs: Vec<Pair>,
    cost: f64,
}

impl SparseFactor {
    /// Takes up the structure of a matrix of `size` blocks, without its numbers.
    pub fn shape(&mut self, size: usize, blocks: &[Block]) {
        refill(&mut self.pairs, blocks.iter().map(Pair::of));
        let factor = self.factor.get_mut().unwrap_or_else(PoisonError::into_inner);
        factor.shape(size, &self.pairs, &[]);
        self.cost = factor.cost();
    }

    /// The cost that a factor of such a matrix would have, about in multiplications, without room for its numbers.
    #[must_use]
    pub fn cost_of(size: usize, blocks: &[Block]) -> f64 {
        let pairs: Vec<Pair> = blocks.iter().map(Pair::of).collect();
        Cholesky::cost_of(size, &pairs)
    }

    /// Factors the matrix of `size` blocks that is given by its lower half; entries with one place add up.
    ///
    /// # Errors
    /// The first block at which it is not positive definite; the factor from before is lost.
    pub fn factor(&mut self, size: usize, blocks: &[Block], threads: &dyn ParallelFor) -> Result<(), usize> {
        self.shape(size, blocks);
        let factor = self.factor.get_mut().unwrap_or_else(PoisonError::into_inner);
        factor.set(blocks);
        factor.factor(threads, |_, _| ())
    }

    /// The cost of a factor of this structure, about in multiplications.
    #[must_use]
    pub const fn cost(&self) -> f64 {
        self.cost
    }
}

impl Response for SparseFactor {
    fn respond(&self, impulses: &mut [DVec3]) {
        self.factor.lock().unwrap_or_else(PoisonError::into_inner).solve(impulses);
    }
}
