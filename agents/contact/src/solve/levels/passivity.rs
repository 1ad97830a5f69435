//! The guard of passivity: an answer never makes energy beyond push-out.
//!
//! In: impulses and the velocities they make. Out: the same, or shorter along the ray to zero. Never here: solving.
//! Theory: `docs/theory/clusters.md`, eq. 12 and 18.

use super::iterate::Iterate;
use crate::solve::statement::problem::Member;
use glam::DVec3;

/// Work below which an answer is passive but for rounding, J.
const ROUNDING_J: f64 = 1e-12;

/// The result of the guard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ray {
    /// D of the impulses as they are left, J, or a bound of it.
    pub work_j: f64,
    /// The factor of the impulses; 1 where they were passive.
    pub share: f64,
}

/// Shortens all impulses, and the velocities that they made, by one factor if their work on members of these free
/// velocities is above zero. The work is that of the velocities as they are: momentum that an inexact solve leaves is
/// neither given nor paid for. A shorter impulse is in every cone and ball that the longer is in.
pub(crate) fn guard(iterate: &mut Iterate, members: &[Member<'_>], free_m_s: &[DVec3]) -> Ray {
    if !iterate.unanswered.is_empty() {
        // the changes of velocity by impulses alone are not known; but D is less than their work on velocities as they
        // become
        let most = work_at_the_end(iterate, free_m_s);
        if most <= ROUNDING_J {
            return Ray { work_j: most, share: 1.0 };
        }
    }
    iterate.complete(members);
    let Iterate { rows, state, step: own, .. } = &*iterate;
    let (mut free, mut caused) = (0.0, 0.0);
    for (k, row) in rows.rows.iter().enumerate() {
        let (at, without) = (state.point(k), row.free + rows.velocity(k, &own.change));
        free += at.impulse.dot(without);
        caused += at.impulse.dot(at.velocity - without);
    }
    for (k, before) in free_m_s.iter().enumerate() {
        let left = state.left[k] - own.left[k];
        free -= left.dot(*before + own.change[k]);
        caused -= left.dot(state.change[k] - own.change[k]);
    }
    let work = |share: f64| share * free + 0.5 * share * share * caused;
    if work(1.0) <= ROUNDING_J {
        return Ray { work_j: work(1.0), share: 1.0 };
    }
    let share = if caused > 0.0 { (-free / caused).clamp(0.0, 1.0) } else { 0.0 };
    iterate.shorten(share);
    Ray { work_j: work(share), share }
}

/// The work of impulses on the velocities that bodies end with, J.
fn work_at_the_end(iterate: &Iterate, free_m_s: &[DVec3]) -> f64 {
    let Iterate { rows, state, .. } = iterate;
    let given: f64 = (0..rows.len()).map(|k| state.lambda[k].dot(state.velocity[k])).sum();
    let ends = free_m_s.iter().zip(&state.change).zip(&state.left);
    given - ends.map(|((free, change), left)| left.dot(*free + *change)).sum::<f64>()
}
