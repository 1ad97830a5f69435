//! The matrices of all members of a contact problem: ⊕ A/f, its diagonal, and the measure of impulses that follows from it.
//!
//! In: members. Out: products and sizes. Never here: contacts, solutions. Theory: `docs/theory/clusters.md`, eq. 1 and 15.

use crate::lists::reset;
use crate::solve::statement::problem;
use crate::solve::statement::problem::{Block, Problem};
use glam::{DMat3, DVec3};

/// A member of no more blocks than a rigid body's.
const RIGID_BLOCKS: usize = 2;

/// ⊕ A/f, blocks counted over all members.
#[derive(Debug, Clone, Default)]
pub(crate) struct Members {
    /// The lower half.
    pub blocks: Vec<Block>,
    /// The member of each block.
    pub owners: Vec<usize>,
    /// The inverse of each diagonal block.
    pub mobilities: Vec<DMat3>,
    /// Whether each block is coupled with others of its member: of one that is not its mobility is the response.
    pub coupled: Vec<bool>,
    /// Whether each member has no more blocks than a rigid body.
    pub rigid: Vec<bool>,
    /// Whether each member lends its own factor.
    pub lends: Vec<bool>,
}

/// How large impulses on blocks are.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Size {
    /// ‖r‖², J (eq. 15).
    pub squared: f64,
    /// The largest velocity that they would give to blocks by themselves, m/s.
    pub fastest_m_s: f64,
}

impl Size {
    /// ‖r‖, √J.
    pub fn root(self) -> f64 {
        self.squared.sqrt()
    }
}

impl Members {
    /// Takes up the members of a problem, the first block of each being at its offset.
    ///
    /// # Errors
    /// A block of a member without a factor of its own, coupled with no other, that is not positive definite.
    pub fn take(&mut self, problem: &Problem<'_>, offsets: &[usize]) -> Result<(), usize> {
        self.blocks.clear();
        self.owners.clear();
        self.rigid.clear();
        self.lends.clear();
        for (place, member) in problem.members.iter().enumerate() {
            let offset = offsets[place];
            self.rigid.push(member.free.len() <= RIGID_BLOCKS);
            self.lends.push(member.response.is_some());
            self.owners.extend(member.free.iter().map(|_| place));
            self.blocks.extend(member.blocks.iter().map(|block| Block {
                row: offset + block.row,
                column: offset + block.column,
                value: block.value * (1.0 / member.share),
            }));
        }
        reset(&mut self.mobilities, self.owners.len(), DMat3::ZERO);
        reset(&mut self.coupled, self.owners.len(), false);
        for block in &self.blocks {
            if block.row == block.column {
                self.mobilities[block.row] += block.value;
            } else {
                (self.coupled[block.row], self.coupled[block.column]) = (true, true);
            }
        }
        let Self { mobilities, coupled, lends, owners, .. } = self;
        let answers_alone = |block: usize| !(coupled[block] || lends[owners[block]]);
        let wrong = (0..mobilities.len()).find(|&block| answers_alone(block) && !is_positive(&mobilities[block]));
        mobilities.iter_mut().for_each(|m| *m = m.inverse());
        wrong.map_or(Ok(()), Err)
    }

    /// Sets the response of blocks that are coupled with no others.
    pub fn respond_alone(&self, impulses: &[DVec3], into: &mut [DVec3]) {
        for (block, coupled) in self.coupled.iter().enumerate() {
            if !coupled {
                into[block] = self.mobilities[block] * impulses[block];
            }
        }
    }

    /// How many blocks of velocity there are.
    pub fn size(&self) -> usize {
        self.owners.len()
    }

    /// out ← ⊕ A/f x.
    pub fn multiply(&self, x: &[DVec3], out: &mut [DVec3]) {
        problem::multiply(&self.blocks, x, out);
    }

    /// How large impulses on all blocks are.
    pub fn measure(&self, impulses: &[DVec3]) -> Size {
        let mut size = Size::default();
        for (mobility, impulse) in self.mobilities.iter().zip(impulses) {
            let velocity = *mobility * *impulse;
            size.squared += impulse.dot(velocity);
            size.fastest_m_s = worse(size.fastest_m_s, velocity.abs().max_element());
        }
        size
    }
}

/// Whether a symmetric matrix is positive definite (Sylvester's criterion); not where a number is none or has no end.
pub(super) fn is_positive(m: &DMat3) -> bool {
    let [x, y] = [m.x_axis, m.y_axis];
    m.is_finite() && x.x > 0.0 && x.x * y.y > x.y * y.x && m.determinant() > 0.0
}

/// The larger of two sizes; one that is not a number stays.
pub(crate) fn worse(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}
