//! Minimal residuals for equations that are not symmetric: generalised conjugate residuals (EES83), each direction stored with its image.
//!
//! In: what is left of a right side, and who makes a direction of it. Out: a solution and what it leaves, smaller by every direction. Never
//! here: the matrix, how directions are made. Theory: `docs/theory/clusters.md`, eq. 8b and 15.

use super::members::Members;
use glam::DVec3;

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

/// A change of the solution, and the part of the right side that it answers.
#[derive(Debug, Clone, Default)]
pub(super) struct Direction {
    pub x: Vec<DVec3>,
    pub image: Vec<DVec3>,
}

/// Storage of the directions.
#[derive(Debug, Clone, Default)]
pub(super) struct Residuals {
    directions: Vec<Direction>,
    /// A velocity of each block, by which impulses are weighed.
    weighed: Vec<DVec3>,
}

impl Residuals {
    /// Makes what a task leaves smaller by up to `most` directions, until it `is_done`. `aim` makes one of what is left, or tells
    /// that there is none.
    pub fn descend(
        &mut self,
        members: &Members,
        task: &mut Task<'_>,
        most: usize,
        is_done: impl Fn(&Task<'_>) -> bool,
        mut aim: impl FnMut(&[DVec3], &mut Direction) -> bool,
    ) {
        let Self { directions, weighed } = self;
        for count in 0..most {
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
            if is_done(task) {
                return;
            }
        }
    }
}

impl Direction {
    fn resize(&mut self, size: usize) {
        for list in [&mut self.x, &mut self.image] {
            list.clear();
            list.resize(size, DVec3::ZERO);
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
    into.clear();
    into.extend(members.mobilities.iter().zip(impulses).map(|(mobility, impulse)| *mobility * *impulse));
}

fn add(to: &mut [DVec3], list: &[DVec3], share: f64) {
    to.iter_mut().zip(list).for_each(|(value, by)| *value += *by * share);
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}
