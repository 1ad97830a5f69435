//! The guard of passivity: an answer never makes energy beyond push-out.
//!
//! In: impulses and the velocities they make. Out: the same, or shorter along the ray to zero. Never here: solving.
//! Theory: `docs/theory/clusters.md`, eq. 12.

use super::iterate::Iterate;

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

/// Shortens all impulses by one factor if their work is above zero. A shorter impulse is in every cone and ball that the longer is in.
pub(super) fn guard(iterate: &mut Iterate) -> Ray {
    let (mut free, mut caused) = (0.0, 0.0);
    for (k, row) in iterate.rows.rows.iter().enumerate() {
        let at = iterate.state.point(k);
        free += at.impulse.dot(row.free);
        caused += at.impulse.dot(at.velocity - row.free);
    }
    let work = |share: f64| share * free + 0.5 * share * share * caused;
    if work(1.0) <= ROUNDING_J {
        return Ray { work_j: work(1.0), share: 1.0 };
    }
    let share = if caused > 0.0 { (-free / caused).clamp(0.0, 1.0) } else { 0.0 };
    iterate.state.lambda.iter_mut().for_each(|impulse| *impulse *= share);
    iterate.respond();
    Ray { work_j: work(share), share }
}
