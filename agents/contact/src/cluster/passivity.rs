//! The guard of passivity: an answer never makes energy beyond push-out.
//!
//! In: impulses and the velocities they make. Out: the same, or shorter along the ray to zero. Never here: solving.
//! Theory: `docs/theory/clusters.md`, eq. 12 and 18.

use super::iterate::Iterate;
use glam::DVec3;

/// Work below which an answer is passive but for rounding, J.
const ROUNDING_J: f64 = 1e-12;

/// What the guard found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ray {
    /// D of the impulses as they are left, J.
    pub work_j: f64,
    /// What they were multiplied by; 1 where they were passive.
    pub share: f64,
}

/// Shortens all impulses, and what they made, by one factor if their work on members of these free velocities is above zero. The work
/// is that of the velocities as they are: momentum that an inexact solve leaves is neither given nor paid for. A shorter impulse is in every cone and ball that the longer is in.
pub(super) fn guard(iterate: &mut Iterate, free_m_s: &[DVec3]) -> Ray {
    let (mut free, mut caused) = (0.0, 0.0);
    for (k, row) in iterate.rows.rows.iter().enumerate() {
        let at = iterate.state.point(k);
        free += at.impulse.dot(row.free);
        caused += at.impulse.dot(at.velocity - row.free);
    }
    for ((left, before), change) in iterate.state.left.iter().zip(free_m_s).zip(&iterate.state.change) {
        free -= left.dot(*before);
        caused -= left.dot(*change);
    }
    let work = |share: f64| share * free + 0.5 * share * share * caused;
    if work(1.0) <= ROUNDING_J {
        return Ray { work_j: work(1.0), share: 1.0 };
    }
    let share = if caused > 0.0 { (-free / caused).clamp(0.0, 1.0) } else { 0.0 };
    iterate.shorten(share);
    Ray { work_j: work(share), share }
}
