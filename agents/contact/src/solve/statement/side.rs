//! One side of a contact: which blocks of which member its point moves with.
//!
//! In: blocks and the maps from their velocities to that of the point. Out: the same as a list of fixed length, without storage of
//! its own. Never here: where the point is. Theory: `docs/theory/clusters.md`, eq. 1.

use super::error::ProblemError;
use glam::{DMat3, DVec3};

/// The most blocks that a side may have: two nodes, a spin and two sections of a tube, the corners of a tetrahedron, a rigid body's two.
pub const SIDE_TERMS_MAX: usize = 5;

/// The share that one block has in the velocity of a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SideTerm {
    /// The block, counted within its member.
    pub block: usize,
    /// Takes the block's velocity to its part of the point's.
    pub map: DMat3,
}

impl SideTerm {
    /// A node's share by its weight, as of a point within an element.
    #[must_use]
    pub fn weighted(block: usize, weight: f64) -> Self {
        Self { block, map: DMat3::from_diagonal(DVec3::splat(weight)) }
    }

    /// The share of a spin ω at an arm r, in metres from the axis of spin to the point: ω × r.
    #[must_use]
    pub fn spin(block: usize, arm_m: DVec3) -> Self {
        let r = arm_m;
        let columns = [DVec3::new(0.0, -r.z, r.y), DVec3::new(r.z, 0.0, -r.x), DVec3::new(-r.y, r.x, 0.0)];
        Self { block, map: DMat3::from_cols(columns[0], columns[1], columns[2]) }
    }
}

/// A point of a member; of a static solid it is [`Side::FIXED`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    /// The member, by its place in the problem; without meaning where the side is fixed.
    pub member: usize,
    terms: [SideTerm; SIDE_TERMS_MAX],
    count: usize,
}

impl Side {
    /// A point that does not move, whatever is given to it.
    pub const FIXED: Self =
        Self { member: 0, terms: [SideTerm { block: 0, map: DMat3::ZERO }; SIDE_TERMS_MAX], count: 0 };

    /// A point whose velocity is the sum of its `terms`.
    ///
    /// # Errors
    /// [`ProblemError::LongSide`] for more than [`SIDE_TERMS_MAX`] terms.
    pub fn new(member: usize, terms: &[SideTerm]) -> Result<Self, ProblemError> {
        let mut side = Self { member, ..Self::FIXED };
        let room = side.terms.get_mut(..terms.len()).ok_or(ProblemError::LongSide { terms: terms.len() })?;
        room.copy_from_slice(terms);
        side.count = terms.len();
        Ok(side)
    }

    /// A node itself.
    #[must_use]
    pub fn node(member: usize, block: usize) -> Self {
        let mut side = Self { member, count: 1, ..Self::FIXED };
        side.terms[0] = SideTerm::weighted(block, 1.0);
        side
    }

    /// A point of a rigid body whose block 0 is the velocity of its centre and whose block 1 is its spin, at `arm_m` from the centre.
    #[must_use]
    pub fn rigid(member: usize, arm_m: DVec3) -> Self {
        let mut side = Self { count: 2, ..Self::node(member, 0) };
        side.terms[1] = SideTerm::spin(1, arm_m);
        side
    }

    /// The same point of the member at another place of the problem.
    #[must_use]
    pub fn of_member(self, member: usize) -> Self {
        Self { member, ..self }
    }

    /// Makes the arm of a point of a body that moves as a whole longer, by a vector in metres; `turns` is the body's spin.
    pub(crate) fn lengthen(&mut self, turns: &Self, by_m: DVec3) {
        for term in &mut self.terms[..self.count] {
            for spin in turns.terms().iter().filter(|spin| spin.block == term.block) {
                term.map += SideTerm::spin(0, by_m).map * spin.map;
            }
        }
    }

    /// The velocity of the point where the blocks of its member have these velocities; zero of a fixed one.
    #[must_use]
    pub fn velocity(&self, blocks: &[DVec3]) -> DVec3 {
        self.terms().iter().map(|term| term.map * blocks[term.block]).sum()
    }

    /// The blocks that move the point; none of a fixed one.
    #[must_use]
    pub fn terms(&self) -> &[SideTerm] {
        &self.terms[..self.count]
    }
}
