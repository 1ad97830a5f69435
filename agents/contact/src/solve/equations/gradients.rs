//! The iterative form of a Newton step: preconditioned conjugate gradients (HS52) on ⊕ A/f, or on ⊕ A/f + Jᵀ G J; minimal residuals
//! where slopes of laws are not symmetric, in either form: generalised conjugate residuals (EES83), each direction stored with its image.
//!
//! In: an operator, a right side, a start and a goal. Out: a solution and its exact residual. Never here: when the goal is met
//! well enough for a law of contact. Theory: `docs/theory/clusters.md`, section 6 and eq. 8b and 15.

use super::coupled::Coupled;
use super::members::{Members, Size, is_positive};
use super::rows::Rows;
use super::skew::Skew;
use crate::lists::{refill, reset};
use glam::{DMat3, DVec3};
use metachron_core::{Archive, ArchiveError, ParallelFor};

/// Starts from the true residual: the sum along the way differs from it by rounding.
const ROUNDS: usize = 3;
/// The most products of a round: some, so many for each block (in exact numbers three would do), and never more than the last.
const PRODUCTS_BASE: usize = 50;
const PRODUCTS_PER_BLOCK: usize = 12;
const PRODUCTS_MAX: usize = 3000;
/// The most directions of a round where slopes of laws are not symmetric, each of which is stored.
const DIRECTIONS_MAX: usize = 60;
/// The share of a goal at which a round ends: the rest is for rounding, and for the changes of laws afterwards.
const SHARE_OF_GOAL: f64 = 0.5;

/// One system of linear equations.
#[derive(Debug)]
pub(crate) struct Task<'a> {
    /// The right side.
    pub right: &'a [DVec3],
    /// Where to start, then the solution; a factor needs no start.
    pub x: &'a mut [DVec3],
    /// Right side less product, exactly; zero by a factor.
    pub left: &'a mut [DVec3],
    /// The size that `left` may have (eq. 15), √J; where it is larger, the operator's `still_m_s` ends the solve.
    pub goal: f64,
}

/// The matrix of a product: ⊕ A/f, with Jᵀ G J where there are contacts in it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Operator<'a> {
    pub members: &'a Members,
    pub contacts: Option<Stiffness<'a>>,
    /// A residual that changes no block by more than this by itself may be left, m/s.
    pub still_m_s: f64,
}

/// Jᵀ (G + S) J.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stiffness<'a> {
    pub rows: &'a Rows,
    pub gains: &'a [DMat3],
    /// S, the part of each row that no factor holds; empty where there is none.
    pub skews: &'a [Skew],
    /// The threads that factor it.
    pub threads: &'a dyn ParallelFor,
}

/// The preconditioner and the storage of conjugate gradients.
#[derive(Debug, Clone, Default)]
pub(super) struct Gradients {
    /// The near part of ⊕ A/f, with Jᵀ G J whole: all of members that lend a factor and of rigid ones, of others the
    /// blocks on the diagonal that rows touch. A block outside it stands by itself.
    near: Coupled,
    direction: Vec<DVec3>,
    image: Vec<DVec3>,
    residuals: Residuals,
    /// Products since the members were taken up.
    pub products: usize,
}

impl Stiffness<'_> {
    /// Whether there is a part that is not symmetric.
    pub fn is_skew(&self) -> bool {
        self.skews.iter().any(|skew| *skew != Skew::NONE)
    }

    /// out ← out + Jᵀ S J x.
    pub fn add_skew(&self, x: &[DVec3], out: &mut [DVec3]) {
        for (row, skew) in self.skews.iter().enumerate().filter(|(_, skew)| **skew != Skew::NONE) {
            self.rows.add_impulse(row, skew.impulse(self.rows.velocity(row, x)), out);
        }
    }
}

impl Operator<'_> {
    /// Whether the residual is at this share of its bounds.
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
    /// Writes or reads the order of the factor of the near part, which the next problem needs.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.near.archive(archive)
    }

    /// Makes room for the members. Whether a matrix is positive definite is seen of the blocks on its diagonal only.
    ///
    /// # Errors
    /// A block that is not.
    pub fn take_members(&mut self, members: &Members) -> Result<(), usize> {
        for list in [&mut self.direction, &mut self.image] {
            reset(list, members.size(), DVec3::ZERO);
        }
        members.mobilities.iter().position(|mobility| !is_positive(mobility)).map_or(Ok(()), Err)
    }

    /// Takes up which blocks the rows move.
    pub fn couple(&mut self, members: &Members, rows: &Rows) {
        let is_whole = |block: usize| members.rigid[members.owners[block]] || members.lends[members.owners[block]];
        self.near.couple(members, rows, is_whole);
    }

    /// Makes the preconditioner that of ⊕ A/f + Jᵀ G J; `false` where rounding leaves it without an inverse.
    pub fn precondition(&mut self, contacts: Stiffness<'_>) -> bool {
        self.near.factor(contacts).is_ok()
    }

    /// Solves until the residual is at its goal, or as far as products reach.
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

    /// Finds the residual of a solution.
    pub fn measure(&mut self, operator: &Operator<'_>, task: &mut Task<'_>) {
        task.left.copy_from_slice(task.right);
        if task.x.iter().any(|x| *x != DVec3::ZERO) {
            self.products += 1;
            operator.multiply(task.x, &mut self.image);
            task.left.iter_mut().zip(&self.image).for_each(|(left, image)| *left -= *image);
        }
    }

    /// Solves for the residual with the preconditioner.
    fn solve_near(&mut self, operator: &Operator<'_>, left: &[DVec3], into: &mut [DVec3]) {
        let by_themselves = into.iter_mut().zip(&operator.members.mobilities).zip(left);
        by_themselves.for_each(|((z, mobility), left)| *z = *mobility * *left);
        if operator.contacts.is_some() {
            self.near.solve(left, into);
        }
    }

    /// One round of minimal residuals.
    fn descend_skew(&mut self, operator: &Operator<'_>, task: &mut Task<'_>) {
        let mut residuals = std::mem::take(&mut self.residuals);
        let end = End { directions: DIRECTIONS_MAX, share: SHARE_OF_GOAL };
        residuals.descend(operator, task, end, |left, Direction { x, image }| {
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
            // `image` serves as storage for the preconditioned residual
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

/// A change of the solution, and the part of the right side that it answers.
#[derive(Debug, Clone, Default)]
pub(super) struct Direction {
    pub x: Vec<DVec3>,
    pub image: Vec<DVec3>,
}

/// When a round ends: after so many directions, or at this share of its goal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct End {
    pub directions: usize,
    pub share: f64,
}

/// Storage of the directions.
#[derive(Debug, Clone, Default)]
pub(super) struct Residuals {
    directions: Vec<Direction>,
    /// A velocity of each block, by which impulses are weighed.
    weighed: Vec<DVec3>,
}

impl Residuals {
    /// Makes the residual of a task smaller, direction by direction. `aim` makes a direction of it, or tells that there
    /// is none.
    pub fn descend(
        &mut self,
        operator: &Operator<'_>,
        task: &mut Task<'_>,
        end: End,
        mut aim: impl FnMut(&[DVec3], &mut Direction) -> bool,
    ) {
        let Self { directions, weighed } = self;
        let members = operator.members;
        for count in 0..end.directions {
            if directions.len() == count {
                directions.push(Direction::default());
            }
            let (known, unknown) = directions.split_at_mut(count);
            let next = &mut unknown[0];
            next.resize(task.left.len());
            let aimed = aim(task.left, next);
            weigh(members, &next.image, weighed);
            for other in &*known {
                next.add(other, -dot(weighed, &other.image));
            }
            weigh(members, &next.image, weighed);
            let size = dot(weighed, &next.image).sqrt();
            let share = dot(weighed, task.left) / (size * size);
            if !(aimed && share.is_finite()) {
                return;
            }
            add(task.x, &next.x, share);
            add(task.left, &next.image, -share);
            next.scale(size.recip());
            if operator.is_done(task, end.share) {
                return;
            }
        }
    }
}

impl Direction {
    fn resize(&mut self, size: usize) {
        for list in [&mut self.x, &mut self.image] {
            reset(list, size, DVec3::ZERO);
        }
    }

    fn add(&mut self, other: &Self, share: f64) {
        add(&mut self.x, &other.x, share);
        add(&mut self.image, &other.image, share);
    }

    fn scale(&mut self, by: f64) {
        self.x.iter_mut().chain(&mut self.image).for_each(|value| *value *= by);
    }
}

/// diag(A/f)⁻¹ of impulses (eq. 15).
fn weigh(members: &Members, impulses: &[DVec3], into: &mut Vec<DVec3>) {
    refill(into, members.mobilities.iter().zip(impulses).map(|(mobility, impulse)| *mobility * *impulse));
}

fn add(to: &mut [DVec3], list: &[DVec3], share: f64) {
    to.iter_mut().zip(list).for_each(|(value, by)| *value += *by * share);
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
