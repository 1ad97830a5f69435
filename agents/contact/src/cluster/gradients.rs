//! The iterative form of a Newton step: preconditioned conjugate gradients (HS52) on ⊕ A/f, or on ⊕ A/f + Jᵀ G J.
//!
//! In: an operator, a right side, a start and a goal. Out: a solution and exactly what it leaves. Never here: when the goal is met
//! well enough for a law of contact. Theory: `docs/theory/clusters.md`, section 6.

use super::coupled::Coupled;
use super::factor::Pair;
use super::members::{Members, Size};
use super::problem::Block;
use super::rows::Rows;
use glam::{DMat3, DVec3};
use metachron_core::ParallelFor;

/// Starts from the true residual: what is summed up along the way differs from it by rounding.
const ROUNDS: usize = 3;
/// The most products of a round: some, so many for each block (in exact numbers three would do), and never more than the last.
const PRODUCTS_BASE: usize = 50;
const PRODUCTS_PER_BLOCK: usize = 12;
const PRODUCTS_MAX: usize = 3000;
/// The share of a goal at which a round ends: the rest is for rounding, and for what laws then change.
const SHARE_OF_GOAL: f64 = 0.5;

/// One system of linear equations.
#[derive(Debug)]
pub(super) struct Task<'a> {
    /// The right side.
    pub right: &'a [DVec3],
    /// Where to start, then the solution; a factor needs no start.
    pub x: &'a mut [DVec3],
    /// Right side less product, exactly; zero by a factor.
    pub left: &'a mut [DVec3],
    /// The size that `left` may have (eq. 15), √J; where it is larger, the operator's `still_m_s` ends the solve.
    pub goal: f64,
}

/// What is multiplied by: ⊕ A/f, with Jᵀ G J where there are contacts in it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Operator<'a> {
    pub members: &'a Members,
    pub contacts: Option<Stiffness<'a>>,
    /// What changes no block by more than this by itself may be left, m/s.
    pub still_m_s: f64,
}

/// Jᵀ G J.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stiffness<'a> {
    pub rows: &'a Rows,
    pub gains: &'a [DMat3],
    /// Who factors it.
    pub threads: &'a dyn ParallelFor,
}

/// The preconditioner and the storage of conjugate gradients.
#[derive(Debug, Clone, Default)]
pub(super) struct Gradients {
    /// Of ⊕ A/f what is near: all of members that lend a factor and of rigid ones, of others the blocks on the diagonal. With Jᵀ G J whole.
    near: Coupled,
    blocks: Vec<Block>,
    pairs: Vec<Pair>,
    direction: Vec<DVec3>,
    image: Vec<DVec3>,
    /// Products since the members were taken up.
    pub products: usize,
}

impl Operator<'_> {
    /// Whether what is left is at this share of what may be.
    fn is_done(&self, task: &Task<'_>, share: f64) -> bool {
        let Size { squared, fastest_m_s } = self.members.measure(task.left);
        squared <= (share * task.goal).powi(2) || fastest_m_s <= share * self.still_m_s
    }

    fn multiply(&self, x: &[DVec3], out: &mut [DVec3]) {
        self.members.multiply(x, out);
        let Some(Stiffness { rows, gains, .. }) = self.contacts else { return };
        for (row, gain) in gains.iter().enumerate().filter(|(_, gain)| **gain != DMat3::ZERO) {
            let impulse = *gain * rows.velocity(row, x);
            for term in rows.terms(row) {
                out[term.block] += term.map.mul_transpose_vec3(impulse);
            }
        }
    }
}

impl Gradients {
    /// Makes room for the members. That a whole matrix is positive definite is seen of rigid members only, else of its nodes.
    ///
    /// # Errors
    /// A block that is not positive definite.
    pub fn take_members(&mut self, members: &Members) -> Result<(), usize> {
        let size = members.size();
        self.products = 0;
        for list in [&mut self.direction, &mut self.image] {
            list.clear();
            list.resize(size, DVec3::ZERO);
        }
        let is_near = |block: &&Block| {
            let owner = members.owners[block.row];
            block.row == block.column || members.rigid[owner] || members.lends[owner]
        };
        self.blocks.clear();
        self.blocks.extend(members.blocks.iter().filter(is_near));
        let of_nodes = members.mobilities.iter().position(|mobility| !mobility.is_finite());
        of_nodes.map_or(Ok(()), Err)
    }

    /// Takes up which blocks the rows move.
    pub fn couple(&mut self, rows: &Rows, size: usize) {
        self.pairs.clear();
        self.pairs.extend(self.blocks.iter().map(|block| Pair { row: block.row, column: block.column }));
        self.near.take(size, &self.blocks, &mut self.pairs, Some(rows));
        self.near.meet(rows);
    }

    /// Makes the preconditioner that of ⊕ A/f + Jᵀ G J; `false` where rounding leaves it without an inverse.
    pub fn precondition(&mut self, contacts: Stiffness<'_>) -> bool {
        self.near.factor(contacts)
    }

    /// Solves until what is left is at its goal, or as far as products reach.
    pub fn solve(&mut self, operator: &Operator<'_>, task: &mut Task<'_>) {
        if task.right.iter().all(|r| *r == DVec3::ZERO) {
            task.x.fill(DVec3::ZERO);
            task.left.fill(DVec3::ZERO);
            return;
        }
        for _ in 0..ROUNDS {
            self.measure(operator, task);
            if operator.is_done(task, 1.0) {
                return;
            }
            self.descend(operator, task);
        }
        self.measure(operator, task);
    }

    /// What a solution leaves.
    pub fn measure(&mut self, operator: &Operator<'_>, task: &mut Task<'_>) {
        task.left.copy_from_slice(task.right);
        if task.x.iter().any(|x| *x != DVec3::ZERO) {
            self.products += 1;
            operator.multiply(task.x, &mut self.image);
            task.left.iter_mut().zip(&self.image).for_each(|(left, image)| *left -= *image);
        }
    }

    /// One round of conjugate gradients.
    fn descend(&mut self, operator: &Operator<'_>, task: &mut Task<'_>) {
        let members = operator.members;
        let most = (PRODUCTS_BASE + PRODUCTS_PER_BLOCK * members.size()).min(PRODUCTS_MAX);
        let mut power = f64::INFINITY;
        self.direction.fill(DVec3::ZERO);
        for _ in 0..most {
            // `image` serves as storage for what the preconditioner makes of the residual
            self.image.copy_from_slice(task.left);
            match operator.contacts {
                Some(_) => self.near.solve(&mut self.image),
                None => self.image.iter_mut().zip(&members.mobilities).for_each(|(z, m)| *z = *m * *z),
            }
            let before = std::mem::replace(&mut power, dot(task.left, &self.image));
            if power <= 0.0 || power.is_nan() {
                return;
            }
            let kept = power / before;
            self.direction.iter_mut().zip(&self.image).for_each(|(d, z)| *d = *z + *d * kept);
            self.products += 1;
            operator.multiply(&self.direction, &mut self.image);
            let along = power / dot(&self.direction, &self.image);
            if !(along > 0.0 && along.is_finite()) {
                return;
            }
            for (k, image) in self.image.iter().enumerate() {
                task.x[k] += self.direction[k] * along;
                task.left[k] -= *image * along;
            }
            if operator.is_done(task, SHARE_OF_GOAL) {
                return;
            }
        }
    }
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
