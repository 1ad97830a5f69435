//! The iterative form of a Newton step: preconditioned conjugate gradients (HS52) on ⊕ A/f, or on ⊕ A/f + Jᵀ G J; minimal residuals
//! where slopes of laws are not symmetric.
//!
//! In: an operator, a right side, a start and a goal. Out: a solution and exactly what it leaves. Never here: when the goal is met
//! well enough for a law of contact. Theory: `docs/theory/clusters.md`, section 6.

use super::coupled::{Coupled, PlacedRows};
use super::factor::Pair;
use super::members::{Members, Size};
use super::problem::Block;
use super::residuals::{Direction, Residuals, Task};
use super::rows::Rows;
use super::skew::Stiffness;
use glam::{DMat3, DVec3};
use metachron_core::{Archive, ArchiveError};

/// Starts from the true residual: what is summed up along the way differs from it by rounding.
const ROUNDS: usize = 3;
/// The most products of a round: some, so many for each block (in exact numbers three would do), and never more than the last.
const PRODUCTS_BASE: usize = 50;
const PRODUCTS_PER_BLOCK: usize = 12;
const PRODUCTS_MAX: usize = 3000;
/// The most directions of a round where slopes of laws are not symmetric, each of which is stored.
const DIRECTIONS_MAX: usize = 60;
/// The share of a goal at which a round ends: the rest is for rounding, and for what laws then change.
const SHARE_OF_GOAL: f64 = 0.5;

/// The place of a block that is not near.
const NOWHERE: usize = usize::MAX;

/// What is multiplied by: ⊕ A/f, with Jᵀ G J where there are contacts in it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Operator<'a> {
    pub members: &'a Members,
    pub contacts: Option<Stiffness<'a>>,
    /// What changes no block by more than this by itself may be left, m/s.
    pub still_m_s: f64,
}

/// The preconditioner and the storage of conjugate gradients.
#[derive(Debug, Clone, Default)]
pub(super) struct Gradients {
    /// Of ⊕ A/f what is near, with Jᵀ G J whole: all of members that lend a factor and of rigid ones, of others the blocks on the diagonal
    /// that rows touch. What is not in it is a block by itself.
    near: Coupled,
    /// The blocks in `near`, and what each of all blocks is called there.
    met: Vec<usize>,
    places: Vec<usize>,
    blocks: Vec<Block>,
    pairs: Vec<Pair>,
    nearby: Vec<DVec3>,
    direction: Vec<DVec3>,
    image: Vec<DVec3>,
    residuals: Residuals,
    /// Products since the members were taken up.
    pub products: usize,
}

impl Operator<'_> {
    /// Whether what is left is at this share of what may be.
    pub fn is_done(&self, task: &Task<'_>, share: f64) -> bool {
        let Size { squared, fastest_m_s } = self.members.measure(task.left);
        squared <= (share * task.goal).powi(2) || fastest_m_s <= share * self.still_m_s
    }

    fn multiply(&self, x: &[DVec3], out: &mut [DVec3]) {
        self.members.multiply(x, out);
        self.add_contacts(x, out);
    }

    fn add_contacts(&self, x: &[DVec3], out: &mut [DVec3]) {
        let Some(contacts) = self.contacts else { return };
        let Stiffness { rows, gains, .. } = contacts;
        for (row, gain) in gains.iter().enumerate().filter(|(_, gain)| **gain != DMat3::ZERO) {
            rows.add_impulse(row, *gain * rows.velocity(row, x), out);
        }
        contacts.add_skew(x, out);
    }
}

impl Gradients {
    /// Writes or reads what the next problem needs: the order of the factor of what is near.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.near.archive(archive)
    }

    /// Makes room for the members. Whether a matrix is positive definite is seen of the blocks on its diagonal only.
    ///
    /// # Errors
    /// A block that is not.
    pub fn take_members(&mut self, members: &Members) -> Result<(), usize> {
        self.products = 0;
        for list in [&mut self.direction, &mut self.image] {
            list.clear();
            list.resize(members.size(), DVec3::ZERO);
        }
        members.mobilities.iter().position(|mobility| !is_positive(mobility)).map_or(Ok(()), Err)
    }

    /// Takes up which blocks the rows move.
    pub fn couple(&mut self, members: &Members, rows: &Rows) {
        let Self { near, met, places, blocks, pairs, nearby, .. } = self;
        let is_whole = |block: usize| members.rigid[members.owners[block]] || members.lends[members.owners[block]];
        places.clear();
        places.extend((0..members.size()).map(|block| if is_whole(block) { 0 } else { NOWHERE }));
        rows.all_terms().iter().for_each(|term| places[term.block] = 0);
        met.clear();
        for (block, place) in places.iter_mut().enumerate().filter(|(_, place)| **place == 0) {
            *place = met.len();
            met.push(block);
        }
        blocks.clear();
        blocks.extend(members.blocks.iter().filter_map(|block| {
            let [row, column] = [block.row, block.column].map(|block| places[block]);
            let is_near = row != NOWHERE && (block.row == block.column || is_whole(block.row));
            is_near.then_some(Block { row, column, ..*block })
        }));
        pairs.clear();
        pairs.extend(blocks.iter().map(|block| Pair { row: block.row, column: block.column }));
        nearby.clear();
        nearby.resize(met.len(), DVec3::ZERO);
        let rows = PlacedRows { rows, places };
        near.take(met.len(), blocks, pairs, rows);
        near.meet(rows);
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
            if operator.contacts.is_some_and(|contacts| contacts.is_skew()) {
                self.descend_skew(operator, task);
            } else {
                self.descend(operator, task);
            }
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

    /// Solves for what is left with the preconditioner.
    fn solve_near(&mut self, operator: &Operator<'_>, left: &[DVec3], into: &mut [DVec3]) {
        let Self { near, met, nearby, .. } = self;
        let by_themselves = into.iter_mut().zip(&operator.members.mobilities).zip(left);
        by_themselves.for_each(|((z, mobility), left)| *z = *mobility * *left);
        if operator.contacts.is_some() {
            nearby.iter_mut().zip(&*met).for_each(|(x, &block)| *x = left[block]);
            near.solve(nearby);
            nearby.iter().zip(&*met).for_each(|(x, &block)| into[block] = *x);
        }
    }

    /// One round of minimal residuals.
    fn descend_skew(&mut self, operator: &Operator<'_>, task: &mut Task<'_>) {
        let mut residuals = std::mem::take(&mut self.residuals);
        let is_done = |task: &Task<'_>| operator.is_done(task, SHARE_OF_GOAL);
        residuals.descend(operator.members, task, DIRECTIONS_MAX, is_done, |left, Direction { x, image }| {
            self.products += 1;
            self.solve_near(operator, left, x);
            operator.members.multiply(x, image);
            let is_positive = dot(x, image) > 0.0;
            operator.add_contacts(x, image);
            is_positive
        });
        self.residuals = residuals;
    }

    /// One round of conjugate gradients.
    fn descend(&mut self, operator: &Operator<'_>, task: &mut Task<'_>) {
        let most = (PRODUCTS_BASE + PRODUCTS_PER_BLOCK * operator.members.size()).min(PRODUCTS_MAX);
        let mut power = f64::INFINITY;
        self.direction.fill(DVec3::ZERO);
        for _ in 0..most {
            // `image` serves as storage for what the preconditioner makes of the residual
            let mut image = std::mem::take(&mut self.image);
            self.solve_near(operator, task.left, &mut image);
            self.image = image;
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

/// Whether a symmetric matrix is positive definite, by its leading minors.
fn is_positive(matrix: &DMat3) -> bool {
    let [x, y] = [matrix.x_axis, matrix.y_axis];
    matrix.is_finite() && x.x > 0.0 && x.x * y.y > x.y * y.x && matrix.determinant() > 0.0
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
