//! The primal-dual way: semismooth Newton on the projected laws of contact (AC91), each step one system of the members' size.
//!
//! In: an iterate, started from impulses of the last step. Out: the same where all laws hold, or the word that they do not.
//! Never here: what to do then (`convex.rs`). Theory: `docs/theory/clusters.md`, eq. 5, 7–9, 16.

use super::cone::Form;
use super::iterate::{Iterate, Refined};
use super::members::worse;
use super::problem::Member;
use super::rows::Point;
use metachron_core::ParallelFor;

/// The most steps: where the pressure of what slides is not known it is found at a rate of about a half a step.
const STEPS_MAX: usize = 60;
/// Steps in a row that may fail to halve the error.
const STALE_MAX: usize = 20;
/// Steps that are taken whole, though the sum of squares may rise: with exact slopes which contacts stick and slide is then found in a
/// few, and a search along each would stop at every kink on the way.
const BOLD_STEPS: usize = 15;
/// Looks along a step: whole, and halved up to five times.
const LOOKS: usize = 6;
/// The shortest of them.
const SHARE_MIN: f64 = 1.0 / 32.0;
/// The share of a step's length by which it must make the sum of squares fall.
const DECREASE: f64 = 0.2;

/// The share of what is missed that an inexact step may leave (eq. 16), and the least that it comes down to, by the last factor, while
/// steps do not halve what is missed: rough steps serve as well as exact ones until the laws' kinks are near.
const LEAVE_MOST: f64 = 0.1;
const LEAVE_LEAST: f64 = 1e-3;
const LEAVE_LESS: f64 = 0.1;

/// What the way needs to know besides the problem.
#[derive(Debug, Clone, Copy)]
pub(super) struct Aim<'a> {
    /// The members, whose responses velocities follow from.
    pub members: &'a [Member<'a>],
    /// Coulomb's law as a disc, or as a cone with a shift.
    pub form: Form,
    /// The miss at which all laws hold, m/s.
    pub tolerance_m_s: f64,
    /// What a contact gives way by, m/s (eq. 5).
    pub yield_m_s: f64,
    /// Who makes large factors.
    pub threads: &'a dyn ParallelFor,
}

/// Iterates until all laws hold; `false` where it gave up, the iterate being of no use then.
pub(super) fn solve(iterate: &mut Iterate, aim: &Aim<'_>) -> bool {
    let (mut least, mut stale, mut last) = (f64::INFINITY, 0, f64::INFINITY);
    let (mut leave, mut stuck) = (LEAVE_MOST, false);
    // the cone's shift makes steps too far off to go on from
    let bold = if aim.form == Form::Disc && iterate.follows_pressure() { BOLD_STEPS } else { 0 };
    for step in 0..=STEPS_MAX {
        iterate.press();
        let mut missed = sum_of_squares(iterate, aim, 0.0).sqrt();
        // the loads of a bold step that went astray would leave rows too hard for all that follows
        if step > 0 && (step > bold || missed < last) {
            harden(iterate, aim.yield_m_s);
        }
        let mut miss = linearise(iterate, aim.form);
        let mut most_left = f64::INFINITY;
        if miss < aim.tolerance_m_s {
            match iterate.refine(aim.form, aim.members) {
                Refined::Kept => return true,
                Refined::Changed => {
                    miss = linearise(iterate, aim.form);
                    missed = sum_of_squares(iterate, aim, 0.0).sqrt();
                    if miss < aim.tolerance_m_s {
                        return true;
                    }
                }
                // what is left and the contacts are solved together, to the end
                Refined::Unanswered => {
                    linearise(iterate, aim.form);
                    most_left = 0.0;
                }
            }
        }
        stale += 1;
        if miss <= 0.5 * least {
            (least, stale) = (miss, 0);
        }
        leave = if missed > 0.5 * last { (LEAVE_LESS * leave).max(LEAVE_LEAST) } else { LEAVE_MOST };
        if step == STEPS_MAX
            || stale >= STALE_MAX
            || !miss.is_finite()
            || !iterate.take_step((leave * missed).min(most_left), aim.threads)
        {
            return false;
        }
        last = missed;
        let share = if step < bold { 1.0 } else { share_of_step(iterate, aim, missed * missed) };
        // a kink that no share gets past is gone over the second time
        let over = stuck && share <= SHARE_MIN;
        stuck = share <= SHARE_MIN && !over;
        iterate.advance(if over { 1.0 } else { share });
    }
    false
}

/// The largest miss of a law (eq. 9).
pub(super) fn largest_miss(iterate: &Iterate, form: Form) -> f64 {
    let misses = iterate.rows.rows.iter().enumerate().map(|(k, row)| {
        let at = iterate.state.point(k);
        row.miss(at.impulse, row.natural_map(form, at).value)
    });
    misses.fold(0.0, worse)
}

/// Gains and pulls of all rows; returns the largest miss, that of momentum among them.
pub(super) fn linearise(iterate: &mut Iterate, form: Form) -> f64 {
    iterate.press();
    let mut largest = iterate.system.members.measure(&iterate.state.left).fastest_m_s;
    for k in 0..iterate.rows.len() {
        let (row, at) = (&iterate.rows.rows[k], iterate.state.point(k));
        let (image, scale) = (row.natural_map(form, at), row.scale);
        largest = worse(largest, row.miss(at.impulse, image.value));
        iterate.linearise(k, &image, scale);
        if iterate.follows_pressure() {
            iterate.follow_pressure(k, form, &image);
        }
    }
    largest
}

/// How far to go: the whole step, or as many halves as make the sum of squares fall that is `before`, or the best look.
fn share_of_step(iterate: &Iterate, aim: &Aim<'_>, before: f64) -> f64 {
    let (mut share, mut best_share, mut best) = (1.0, 1.0, f64::INFINITY);
    for _ in 0..LOOKS {
        let here = sum_of_squares(iterate, aim, share);
        if here < best {
            (best, best_share) = (here, share);
        }
        if here <= (1.0 - DECREASE * share) * before {
            break;
        }
        share *= 0.5;
    }
    best_share
}

/// ‖F‖² of eq. 16 at a share of the step, with the compliance that rows would have there. A factor leaves Σ w |λ − P|² of it.
fn sum_of_squares(iterate: &Iterate, aim: &Aim<'_>, share: f64) -> f64 {
    let Iterate { rows, state, step, system, .. } = iterate;
    let mobilities = system.members.mobilities.iter().zip(&state.left).zip(&step.left);
    let momentum = mobilities.map(|((mobility, left), by)| {
        let left = *left + *by * share;
        left.dot(*mobility * left)
    });
    let terms = rows.rows.iter().enumerate().map(|(k, row)| {
        let impulse = state.lambda[k] + step.lambda[k] * share;
        let velocity = state.velocity[k] + step.velocity[k] * share;
        let compliance = row.hardened(impulse, aim.yield_m_s);
        let image = row.natural_map_at(aim.form, Point { impulse, velocity }, compliance);
        row.scale * (impulse - image.value).length_squared()
    });
    terms.sum::<f64>() + momentum.sum::<f64>()
}

/// Makes rows harder that give way too far; returns whether any was.
pub(super) fn harden(iterate: &mut Iterate, yield_m_s: f64) -> bool {
    let mut any = false;
    for (row, impulse) in iterate.rows.rows.iter_mut().zip(&iterate.state.lambda) {
        let harder = row.hardened(*impulse, yield_m_s);
        any |= harder != row.compliance;
        row.compliance = harder;
    }
    any
}
