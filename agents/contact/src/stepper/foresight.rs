//! By how much a fine step changes the velocities of two bodies, as far as is known before the solve.
//!
//! In: what the step would change without contact, what each contact and row gave in the last step. Out: the change of each side of a pair
//! but for what the pair itself gives. Never here: when bodies meet, whether they rebound. Theory: docs/theory/clusters.md, section 9.

use super::outside::respond;
use super::progress::Progress;
use super::search::Search;
use super::ties::Ties;
use super::{ClusterMember, Participant, Role};
use crate::cluster::Side;
use glam::DVec3;

/// What is known of a fine step before it is solved.
#[derive(Debug, Clone, Default)]
pub(super) struct Foresight {
    /// The first block of each participant in `held_n_s`, and what contacts and rows gave each block in the last step, N·s.
    offsets: Vec<usize>,
    held_n_s: Vec<DVec3>,
    /// The change of velocity of each block of a pair's two sides.
    gains: [Vec<DVec3>; 2],
    /// What others than the pair hold a side by, what that changes, and storage for it.
    others_n_s: Vec<DVec3>,
    changes: Vec<DVec3>,
    residual: Vec<DVec3>,
}

impl Foresight {
    /// Takes up what held each participant in the last step.
    pub fn begin(&mut self, search: &Search, ties: &Ties, progress: &[Progress]) {
        let Self { offsets, held_n_s, .. } = self;
        offsets.clear();
        let mut count = 0;
        for state in progress {
            offsets.push(count);
            count += state.seen.len();
        }
        held_n_s.clear();
        held_n_s.resize(count, DVec3::ZERO);
        let contacts = search.contacts.iter().map(|contact| (&contact.sides, contact.warm_n_s));
        let rows = ties.rows.iter().map(|row| (&row.sides, row.warm_n_s));
        for (sides, warm_n_s) in contacts.chain(rows).filter(|(_, warm_n_s)| *warm_n_s != DVec3::ZERO) {
            for (side, sign) in sides.iter().zip([1.0, -1.0]).filter(|(side, _)| !side.terms().is_empty()) {
                add(&mut held_n_s[offsets[side.member]..], side, warm_n_s * sign);
            }
        }
    }

    /// Foresees the changes of both sides of the pair whose contacts these are.
    pub fn look(
        &mut self,
        all: &[Participant<'_>],
        search: &Search,
        pair: std::ops::Range<usize>,
        progress: &[Progress],
    ) {
        let contacts = &search.contacts[pair];
        for (at, sign) in [1.0, -1.0].into_iter().enumerate() {
            let Self { offsets, held_n_s, gains, others_n_s, changes, residual } = &mut *self;
            let gains = &mut gains[at];
            gains.clear();
            let Some(moved) = contacts.iter().map(|contact| &contact.sides[at]).find(|side| !side.terms().is_empty())
            else {
                continue;
            };
            let (member, state) = (&all[moved.member].member, &progress[moved.member]);
            gains.extend(state.seen.iter().zip(&state.before).map(|(seen, before)| *seen - *before));
            if member.role() != Role::Rigid {
                continue;
            }
            let start = offsets[moved.member];
            others_n_s.clear();
            others_n_s.extend_from_slice(&held_n_s[start..start + gains.len()]);
            for contact in contacts {
                add(others_n_s, &contact.sides[at], contact.warm_n_s * -sign);
            }
            changes.clone_from(others_n_s);
            respond(member, changes, residual);
            hold(gains, others_n_s, changes);
        }
    }

    /// By how much side `at` of the pair gains speed along `axis` at a place, m/s.
    pub fn gain_m_s(&self, at: usize, side: &Side, axis: DVec3) -> f64 {
        if side.terms().is_empty() { 0.0 } else { side.velocity(&self.gains[at]).dot(axis) }
    }
}

/// Adds what an impulse at a side gives its blocks.
fn add(blocks: &mut [DVec3], side: &Side, impulse_n_s: DVec3) {
    side.terms().iter().for_each(|term| blocks[term.block] += term.map.mul_transpose_vec3(impulse_n_s));
}

/// Adds to gains what these impulses change, as much of it as holds a body still at most: what landed in the last step got more than
/// what it lies on will give.
fn hold(gains: &mut [DVec3], impulses: &[DVec3], changes: &[DVec3]) {
    let along = |list: &[DVec3]| -> f64 { list.iter().zip(impulses).map(|(v, impulse)| v.dot(*impulse)).sum() };
    let (falls, answers) = (-along(gains), along(changes));
    if falls > 0.0 && answers > 0.0 {
        let share = (falls / answers).min(1.0);
        gains.iter_mut().zip(changes).for_each(|(gain, change)| *gain += *change * share);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_gains_nothing_and_what_landed_no_more_than_that() {
        let fall = [DVec3::Z * -0.1, DVec3::ZERO];
        for (given_n_s, left) in [(0.0, -0.1), (0.1, -0.05), (0.2, 0.0), (3.0, 0.0), (-0.2, -0.1)] {
            let (mut gains, impulses) = (fall, [DVec3::Z * given_n_s, DVec3::ZERO]);
            hold(&mut gains, &impulses, &impulses.map(|impulse| impulse * 0.5));
            assert!((gains[0].z - left).abs() < 1e-15, "{given_n_s} N s of a body of 2 kg: {}", gains[0].z);
        }
    }
}
