//! The primal-dual way: semismooth Newton on the projected laws of contact (AC91), each step one system of the members' size.
//!
//! In: an iterate at which the laws nearly hold. Out: the same where all hold, or the word that steps did not lead there.
//! Never here: what to do then. Theory: `docs/theory/clusters.md`, eq. 5, 7–9, 16.

use super::iterate::{Iterate, Refined};
use crate::solve::equations::members::worse;
use crate::solve::statement::problem::Member;
use metachron_core::ParallelFor;

/// A step that does not bring the miss below this share of the one before is followed by a more exact one.
const HALF: f64 = 0.5;
/// The share of the miss that an inexact step may leave (eq. 16), and the least that it comes down to, by the last factor, while
/// steps do not halve the miss: rough steps serve as well as exact ones until the laws' kinks are near.
const LEAVE_MOST: f64 = 0.1;
const LEAVE_LEAST: f64 = 1e-3;
const LEAVE_LESS: f64 = 0.1;

/// The parameters of the way besides the problem.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Aim<'a> {
    /// The members, whose responses velocities follow from.
    pub members: &'a [Member<'a>],
    /// The miss at which all laws hold, m/s.
    pub tolerance_m_s: f64,
    /// The velocity by which a contact gives way, m/s (eq. 5).
    pub yield_m_s: f64,
    /// The threads that make large factors.
    pub threads: &'a dyn ParallelFor,
}

/// How many steps are worth their price.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Patience {
    /// The most of all.
    pub steps: usize,
    /// The most in a row that do not bring the miss to this share of the least so far: which contacts stick and slide is found in whole
    /// steps, on the way of which the miss may grow.
    pub stale: usize,
    pub left: f64,
}

/// Takes whole steps until all laws hold; `false` where patience ends, the iterate being of no use then.
pub(crate) fn solve(iterate: &mut Iterate, aim: &Aim<'_>, patience: Patience) -> bool {
    let (mut least, mut stale, mut last, mut leave) = (f64::INFINITY, 0, f64::INFINITY, LEAVE_MOST);
    for step in 0..=patience.steps {
        iterate.press();
        let mut missed = iterate.missed();
        // the loads of a step that went astray would leave rows too hard for all that follows
        if missed < last {
            harden(iterate, aim.yield_m_s);
        }
        let mut miss_m_s = linearise(iterate);
        let mut most_left = f64::INFINITY;
        if miss_m_s < aim.tolerance_m_s {
            match iterate.refine(aim.members) {
                Refined::Kept => return true,
                Refined::Changed => {
                    miss_m_s = linearise(iterate);
                    missed = iterate.missed();
                    if miss_m_s < aim.tolerance_m_s {
                        return true;
                    }
                }
                // the rest and the contacts are solved together, to the end
                Refined::Unanswered => {
                    linearise(iterate);
                    most_left = 0.0;
                }
            }
        }
        stale += 1;
        if missed <= patience.left * least {
            (least, stale) = (missed, 0);
        }
        leave = if missed > HALF * last { (LEAVE_LESS * leave).max(LEAVE_LEAST) } else { LEAVE_MOST };
        let goal = (leave * missed).min(most_left);
        let goes_on = step < patience.steps && stale < patience.stale && miss_m_s.is_finite();
        if !goes_on || !iterate.factor(aim.threads) || !iterate.solve(aim.threads, |_| goal) {
            return false;
        }
        last = missed;
        iterate.advance(1.0);
    }
    false
}

/// The most that laws and momentum miss, m/s (eq. 9); infinite where it is no number.
pub(crate) fn miss_m_s(iterate: &mut Iterate) -> f64 {
    iterate.press();
    let of_momentum = iterate.system.members.measure(&iterate.state.left).fastest_m_s;
    let misses = iterate.rows.rows.iter().enumerate().map(|(k, row)| {
        let at = iterate.state.point(k);
        row.miss(at.impulse, row.natural_map(at).value)
    });
    let most = misses.fold(of_momentum, worse);
    if most.is_nan() { f64::INFINITY } else { most }
}

/// Gains and pulls of all rows; returns the largest miss, that of momentum among them.
pub(super) fn linearise(iterate: &mut Iterate) -> f64 {
    iterate.press();
    let mut largest = iterate.system.members.measure(&iterate.state.left).fastest_m_s;
    for k in 0..iterate.rows.len() {
        let (row, at) = (&iterate.rows.rows[k], iterate.state.point(k));
        let image = row.natural_map(at);
        largest = worse(largest, row.miss(at.impulse, image.value));
        iterate.linearise(k, &image);
    }
    largest
}

/// Makes rows harder that give way too far.
fn harden(iterate: &mut Iterate, yield_m_s: f64) {
    for (row, impulse) in iterate.rows.rows.iter_mut().zip(&iterate.state.lambda) {
        row.compliance = row.hardened(*impulse, yield_m_s);
    }
}
