//! One side of a contact or row: which blocks of which member its point moves with, or how two members move against each other.
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

/// A point of a member, or the motion of two members against each other; of a static solid it is [`Side::FIXED`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    /// The member, by its place in the problem; without meaning where the side is fixed.
    pub member: usize,
    terms: [SideTerm; SIDE_TERMS_MAX],
    /// How many terms are those of `member`; the terms up to `end` are those of `other`.
    count: usize,
    other: usize,
    end: usize,
}

/// The terms of a side that are one member's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SidePart<'a> {
    /// The member, by its place in the problem.
    pub member: usize,
    /// Its blocks that move the side.
    pub terms: &'a [SideTerm],
}

impl Side {
    /// A point that does not move, whatever is given to it.
    pub const FIXED: Self = Self {
        member: 0,
        terms: [SideTerm { block: 0, map: DMat3::ZERO }; SIDE_TERMS_MAX],
        count: 0,
        other: 0,
        end: 0,
    };

    /// A point whose velocity is the sum of its `terms`.
    ///
    /// # Errors
    /// [`ProblemError::LongSide`] for more than [`SIDE_TERMS_MAX`] terms.
    pub fn new(member: usize, terms: &[SideTerm]) -> Result<Self, ProblemError> {
        let mut side = Self { member, ..Self::FIXED };
        let room = side.terms.get_mut(..terms.len()).ok_or(ProblemError::LongSide { terms: terms.len() })?;
        room.copy_from_slice(terms);
        (side.count, side.end) = (terms.len(), terms.len());
        Ok(side)
    }

    /// A node itself.
    #[must_use]
    pub fn node(member: usize, block: usize) -> Self {
        let mut side = Self { member, count: 1, end: 1, ..Self::FIXED };
        side.terms[0] = SideTerm::weighted(block, 1.0);
        side
    }

    /// A point of a rigid body whose block 0 is the velocity of its centre and whose block 1 is its spin, at `arm_m` from the centre.
    #[must_use]
    pub fn rigid(member: usize, arm_m: DVec3) -> Self {
        let mut side = Self { count: 2, end: 2, ..Self::node(member, 0) };
        side.terms[1] = SideTerm::spin(1, arm_m);
        side
    }

    /// The same point of the member at another place of the problem.
    #[must_use]
    pub fn of_member(self, member: usize) -> Self {
        Self { member, ..self }
    }

    /// Counts its members anew; one that `to` does not know keeps its place.
    pub(crate) fn move_members(&mut self, to: impl Fn(usize) -> Option<usize>) {
        if self.count > 0 {
            self.member = to(self.member).unwrap_or(self.member);
        }
        if self.end > self.count {
            self.other = to(self.other).unwrap_or(self.other);
        }
    }

    /// How a point, or spin, moves against another, each of one member at most, as `map` sees it.
    ///
    /// # Errors
    /// [`ProblemError::LongSide`] for more than [`SIDE_TERMS_MAX`] terms of both.
    pub fn against(point: &Self, from: &Self, map: DMat3) -> Result<Self, ProblemError> {
        let mapped = |side: &Self, map: DMat3| side.terms.map(|term| SideTerm { map: map * term.map, ..term });
        let (near, far) = (mapped(point, map), mapped(from, -map));
        if point.count == 0 {
            return Self::new(from.member, &far[..from.count]);
        }
        let mut side = Self::new(point.member, &near[..point.count])?;
        (side.other, side.end) = (from.member, point.count + from.count);
        let room = side.terms.get_mut(point.count..side.end);
        room.ok_or(ProblemError::LongSide { terms: side.end })?.copy_from_slice(&far[..from.count]);
        Ok(side)
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

    /// The blocks of its member that move the point; none of a fixed one.
    #[must_use]
    pub fn terms(&self) -> &[SideTerm] {
        &self.terms[..self.count]
    }

    /// The second member of a motion of two against each other.
    #[must_use]
    pub fn second(&self) -> Option<SidePart<'_>> {
        (self.end > self.count).then(|| SidePart { member: self.other, terms: &self.terms[self.count..self.end] })
    }

    /// Its members: none of a fixed side, one of a point, two of a motion against each other.
    pub fn parts(&self) -> impl Iterator<Item = SidePart<'_>> {
        let first = (self.count > 0).then(|| SidePart { member: self.member, terms: self.terms() });
        first.into_iter().chain(self.second())
    }
}

impl SidePart<'_> {
    /// The velocity that the blocks of its member give the side by themselves.
    #[must_use]
    pub fn velocity(&self, blocks: &[DVec3]) -> DVec3 {
        self.terms.iter().map(|term| term.map * blocks[term.block]).sum()
    }
}
