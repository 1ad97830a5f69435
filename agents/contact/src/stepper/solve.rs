//! The solve of a fine step: again with the places that bodies struck would pass, and until joints hold where bodies will be.
//!
//! In: members with what they see, places, rows. Out: every member's impulses. Never here: how places are found, how rows are laid out.
//! Theory: docs/theory/clusters.md, section 9.

use super::joints::Aimed;
use super::progress::Progress;
use super::search::{Judge, Round, Search};
use super::ties::Ties;
use super::{ClusterMember, ClusterReport, ClusterStepper, On, Participant, Role, times};
use crate::cluster::{Level, Member, Problem, ProblemError, Response, StepForm};
use glam::DVec3;
use metachron_core::{ParallelFor, StepError, recycled};

/// The most solves of a fine step: what is struck reaches what it strikes one body further in each, and joints converge.
const ROUNDS_MAX: u32 = 6;
/// A member of more blocks that lends no factor gets none: the problem is solved by conjugate gradients.
const FACTORED_BLOCKS_MAX: usize = 200;
/// Joints hold to this share of the depth of contacts, in metres and radians.
const JOINT_SHARE: f64 = 0.25;
/// From so many fine steps on, joints that do not hold ask for more only while that brings what they miss below this share of it.
const PARTS_HOPED: f64 = 16.0;
const MISS_SHRINKS: f64 = 0.7;
/// By how much a body in a joint may turn in a fine step: the force of the joint is where it is at the start.
const TURN_MAX_RAD: f64 = 0.15;

/// By how much a joint that holds may be off where contacts are `depth_m` deep, metres.
pub(super) fn joint_miss_m(depth_m: f64) -> f64 {
    JOINT_SHARE * depth_m
}

impl ClusterStepper {
    /// Solves the problem of a fine step, and again while bodies would pass through each other where nobody looked; gives every member
    /// its impulses (eq. 25).
    pub(super) fn solve(
        &mut self,
        on: On<'_>,
        all: &[Participant<'_>],
        h_s: f64,
        report: &mut ClusterReport,
    ) -> Result<(), StepError> {
        report.contacts = 0;
        self.joints_ask = 1;
        let is_open = |state: &Progress| !state.unanswered.is_empty();
        if self.search.contacts.is_empty() && self.ties.rows.is_empty() && !self.progress.iter().any(is_open) {
            // what touches nothing moves as it would
            self.spins.clear();
            self.progress.iter_mut().for_each(Progress::go_on);
            return Ok(());
        }
        let (mut last_miss_m, mut missed_m) = (f64::INFINITY, self.joints_missed_m);
        for round in 1..=ROUNDS_MAX {
            self.spins.lay(&self.search, all, &mut self.ties, h_s);
            self.solve_once(all, h_s, on.threads, report)?;
            self.note_motion(all);
            let Self {
                solver,
                search,
                ties,
                spins,
                joints,
                joints_ask,
                joints_missed_m,
                macro_s,
                progress,
                depth_m,
                rebounds,
                ..
            } = &mut *self;
            let solution = solver.solution();
            // the next solve starts from this one
            for (contact, impulse) in search.contacts.iter_mut().zip(&solution.contacts_n_s) {
                contact.warm_n_s = *impulse;
            }
            for (row, impulse) in ties.rows.iter_mut().zip(&solution.rows_n_s) {
                row.warm_n_s = *impulse;
            }
            for (contact, row) in spins.rows(ties) {
                let normal = search.contacts[contact].normal;
                search.owners[contact].spin.torque_n_m = solution.rows_n_s[row].dot(normal) / h_s;
            }
            let Aimed { miss_m, turn_rad } = joints.aim(all, ties, |member| &progress[member].solved[..], h_s);
            let joints_done = miss_m < joint_miss_m(*depth_m) || miss_m > last_miss_m;
            let look = Round { scene: on.scene, all, progress, h_s, judge: Judge::Solved };
            // what is added is solved
            let passed = round < ROUNDS_MAX && search.add_passed(&look);
            // with other contacts joints start anew
            last_miss_m = if passed { f64::INFINITY } else { miss_m };
            let holds = miss_m < joint_miss_m(*depth_m);
            let made = (*macro_s / h_s).round();
            // what cannot hold does not in shorter steps either
            let helps = made < PARTS_HOPED || miss_m < MISS_SHRINKS * *joints_missed_m;
            *joints_ask = times(turn_rad / TURN_MAX_RAD).max(if holds || !helps { 1 } else { 2 });
            missed_m = if holds { *joints_missed_m } else { miss_m };
            if round == ROUNDS_MAX || !passed && joints_done {
                break;
            }
            rebounds.stop(search);
            if rebounds.wanted_parts().is_some() {
                // the step is made again in shorter ones
                return Ok(());
            }
        }
        self.joints_missed_m = missed_m;
        self.give(report);
        Ok(())
    }

    fn solve_once(
        &mut self,
        all: &[Participant<'_>],
        h_s: f64,
        threads: &dyn ParallelFor,
        report: &mut ClusterReport,
    ) -> Result<(), StepError> {
        let Self { solver, search, ties, progress, members, lent, .. } = self;
        // what no row touches and knows how it would move does so, and makes no problem larger
        let mut count = 0..;
        progress.iter_mut().for_each(|state| state.place = (!state.unanswered.is_empty()).then_some(0));
        let sides = search.contacts.iter().flat_map(|c| &c.sides).chain(ties.rows.iter().flat_map(|row| &row.sides));
        sides.filter(|side| !side.terms().is_empty()).for_each(|side| progress[side.member].place = Some(0));
        let involved = progress.iter_mut().filter(|state| state.place.is_some());
        involved.for_each(|state| state.place = count.next());
        let (mut list, mut lenders) = (recycled(std::mem::take(members)), recycled(std::mem::take(lent)));
        let taking = || all.iter().zip(&*progress).filter(|(_, state)| state.place.is_some());
        lenders.extend(taking().map(|(one, _)| one.member.lent()));
        list.extend(taking().zip(&lenders).map(|((one, state), lender)| Member {
            blocks: one.member.blocks(),
            response: lender.as_ref().map(|lender| lender as &dyn Response),
            free: &state.seen,
            unanswered: &state.unanswered,
            now: &state.before,
            share: f64::from(state.part),
        }));
        move_sides(search, ties, |member| progress[member].place);
        let has_factor = |member: &Member<'_>| member.response.is_some() || member.free.len() <= FACTORED_BLOCKS_MAX;
        solver.set_form(if list.iter().all(has_factor) { StepForm::Direct } else { StepForm::Iterative });
        let problem = Problem { h_s, members: &list, contacts: &search.contacts, rows: &ties.rows, threads };
        let outcome = solver.solve(&problem).map(|solution| solution.report);
        (*members, *lent) = (recycled(list), recycled(lenders));
        let places = &mut self.places;
        places.clear();
        places.extend(progress.iter().enumerate().filter_map(|(member, state)| state.place.map(|_| member)));
        move_sides(search, ties, |place| places.get(place).copied());
        let took = outcome.map_err(|error| {
            blame(&error, all, places);
            refused(&error, h_s)
        })?;
        // a blow that would make energy is none
        for (contact, rebounds) in search.contacts.iter_mut().zip(&solver.solution().rebounds) {
            if !rebounds {
                contact.restitution = 0.0;
            }
        }
        for state in &mut *progress {
            let Progress { solved, seen, place, .. } = state;
            solved.clear();
            solved.extend_from_slice(place.map_or(&seen[..], |place| solver.solution().velocities(place)));
        }
        report.factors += took.factors as u32;
        report.products += took.products as u32;
        report.solves += 1;
        report.unfinished += u32::from(took.level == Level::Interior);
        report.level = report.level.max(took.level);
        report.miss_m_s = report.miss_m_s.max(took.miss_m_s);
        Ok(())
    }

    /// Finds what the impulses found hold, and how places move by them.
    fn note_motion(&mut self, all: &[Participant<'_>]) {
        let Self { solver, search, ties, progress, .. } = self;
        let solution = solver.solution();
        progress.iter_mut().for_each(|state| state.bears = false);
        let mut hold = |both: &mut dyn Iterator<Item = usize>| both.for_each(|member| progress[member].bears = true);
        for (k, impulse) in solution.contacts_n_s.iter().enumerate() {
            // a blow is over when the step begins: the flight after it is free
            if *impulse != DVec3::ZERO && search.contacts[k].restitution == 0.0 {
                hold(&mut search.owners[k].both());
            }
        }
        for (owner, impulse) in ties.owners.iter().zip(&solution.rows_n_s) {
            if *impulse != DVec3::ZERO {
                hold(&mut owner.both());
            }
        }
        for (one, state) in all.iter().zip(progress) {
            state.go(one.member.role() == Role::Rigid);
        }
    }

    /// Gives every member the impulses found.
    fn give(&mut self, report: &mut ClusterReport) {
        let Self { solver, search, progress, rebounds, .. } = self;
        for state in &mut *progress {
            let left = state.place.map_or(&[][..], |place| solver.solution().unanswered(place));
            state.take(left);
        }
        rebounds.note_late(search, &solver.solution().contacts_n_s, progress);
        progress.iter_mut().filter(|state| state.bears).for_each(Progress::hold);
        report.contacts = search.contacts.len() as u32;
        report.depth_m = search.contacts.iter().map(|contact| -contact.gap_m).fold(report.depth_m, f64::max);
    }
}

/// Counts the members of all sides anew.
fn move_sides(search: &mut Search, ties: &mut Ties, to: impl Fn(usize) -> Option<usize>) {
    let contacts = search.contacts.iter_mut().flat_map(|contact| &mut contact.sides);
    let sides = contacts.chain(ties.rows.iter_mut().flat_map(|row| &mut row.sides));
    for side in sides.filter(|side| !side.terms().is_empty()) {
        side.member = to(side.member).unwrap_or(side.member);
    }
}

/// Blames the participant whose matrix or velocities are none, of the members at these `places`.
fn blame(error: &ProblemError, all: &[Participant<'_>], places: &[usize]) {
    let (ProblemError::Member { member, .. } | ProblemError::NotPositiveDefinite { member, .. }) = *error else {
        return;
    };
    let blamed = places.get(member).and_then(|place| all.get(*place));
    blamed.into_iter().for_each(|one| one.member.reject(error.to_string()));
}

fn refused(error: &ProblemError, dt_s: f64) -> StepError {
    StepError::Diverged { model: "cluster", dt_s, what: error.to_string() }
}
