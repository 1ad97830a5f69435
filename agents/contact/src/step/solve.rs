//! The solve of a fine step: again with the places that bodies struck would pass, and until joints hold where bodies will be.
//!
//! In: members with their surroundings, places, rows. Out: every member's impulses. Never here: how places are found,
//! how rows are laid out.
//! Theory: docs/theory/clusters.md, section 9.

use crate::constraint::joint::Aimed;
use crate::detect::{Judge, Round};
use crate::impact::SolvedStep;
use crate::lists::refill;
use crate::member::participant::Progress;
use crate::member::problem::{Posed, Velocities};
use crate::member::{Participant, Role};
use crate::solve::Side;
use crate::step::plan::times;
use crate::step::report::ClusterReport;
use crate::step::{ClusterStepper, On};
use glam::DVec3;
use metachron_core::{ParallelFor, StepError};

/// The most solves of a fine step: an impact reaches one body further in each, and joints converge.
const ROUNDS_MAX: u32 = 6;
/// Joints hold to this share of the depth of contacts, in metres and radians.
const JOINT_SHARE: f64 = 0.25;
/// From so many fine steps on, joints that do not hold ask for more only while that brings their miss below this share of it.
const PARTS_HOPED: f64 = 16.0;
const MISS_SHRINKS: f64 = 0.7;
/// By how much a body in a joint may turn in a fine step: the force of the joint is where it is at the start.
const TURN_MAX_RAD: f64 = 0.15;

/// By how much a joint that holds may be off where contacts are `depth_m` deep, metres.
pub(super) fn joint_miss_m(depth_m: f64) -> f64 {
    JOINT_SHARE * depth_m
}

impl ClusterStepper {
    /// Solves the problem of a fine step, and again while bodies would pass through each other where no contact was sought; gives every member
    /// its impulses (eq. 25).
    pub(super) fn solve(
        &mut self,
        on: On<'_>,
        all: &[Participant<'_>],
        h_s: f64,
        report: &mut ClusterReport,
    ) -> Result<(), StepError> {
        report.contacts = 0;
        self.joints.ask = 1;
        let is_open = |state: &Progress| !state.unanswered.is_empty();
        if self.search.contacts.is_empty() && self.constraints.rows.is_empty() && !self.progress.iter().any(is_open) {
            // a member that touches nothing moves as it would
            self.progress.iter_mut().for_each(Progress::go_on);
            return Ok(());
        }
        let (mut last_miss_m, mut missed_m) = (f64::INFINITY, self.joints.missed_m);
        for round in 1..=ROUNDS_MAX {
            self.constraints.lay_contacts(&mut self.search, all, h_s);
            self.solve_once(all, h_s, on.threads, report)?;
            self.note_motion(all);
            let Self { solver, search, constraints, joints, macro_s, progress, depth_m, .. } = &mut *self;
            let solution = solver.solution();
            // the next solve starts from this one
            for (contact, impulse) in search.contacts.iter_mut().zip(&solution.contacts_n_s) {
                contact.warm_n_s = *impulse;
            }
            for (row, impulse) in constraints.rows.iter_mut().zip(&solution.rows_n_s) {
                row.warm_n_s = *impulse;
            }
            for (owner, contact) in search.owners.iter_mut().zip(&search.contacts) {
                owner.push_n = owner.push_row.map_or(owner.push_n, |row| solution.rows_n_s[row].length() / h_s);
                let torque_n_m = |row: usize| solution.rows_n_s[row].dot(contact.normal) / h_s;
                owner.spin.torque_n_m = owner.spin_row.map_or(owner.spin.torque_n_m, torque_n_m);
            }
            let v_solved = |member: usize| &progress[member].v_solved[..];
            constraints.turn_arms(progress, v_solved, h_s);
            let Aimed { miss_m, turn_rad } = joints.aim(all, constraints, v_solved, h_s);
            let joints_done = miss_m < joint_miss_m(*depth_m) || miss_m > last_miss_m;
            let holds = miss_m < joint_miss_m(*depth_m);
            let made = (*macro_s / h_s).round();
            // a joint that cannot hold does not in shorter steps either
            let helps = made < PARTS_HOPED || miss_m < MISS_SHRINKS * joints.missed_m;
            joints.ask = times(turn_rad / TURN_MAX_RAD).max(if holds || !helps { 1 } else { 2 });
            missed_m = if holds { joints.missed_m } else { miss_m };
            // the last look is followed by no solve that would stop flying bodies
            let is_last = round == ROUNDS_MAX;
            if joints_done || is_last {
                self.rebound(on, all, !is_last, report)?;
            }
            let look = Round { scene: on.scene, all, progress: &self.progress, h_s, judge: Judge::Solved };
            // new contacts are solved
            let passed = !is_last && self.search.add_passed(&look);
            // with other contacts joints start anew
            last_miss_m = if passed { f64::INFINITY } else { miss_m };
            if is_last || !passed && joints_done {
                break;
            }
        }
        self.joints.missed_m = missed_m;
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
        let Self { solver, search, constraints, progress, members, .. } = self;
        // a member that no row touches and that knows its free motion moves by it, and makes no problem larger
        let mut count = 0..;
        progress.iter_mut().for_each(|state| state.place = (!state.unanswered.is_empty()).then_some(0));
        let sides =
            search.contacts.iter().flat_map(|c| &c.sides).chain(constraints.rows.iter().flat_map(|row| &row.sides));
        sides.flat_map(Side::parts).for_each(|part| progress[part.member].place = Some(0));
        let involved = progress.iter_mut().filter(|state| state.place.is_some());
        involved.for_each(|state| state.place = count.next());
        refill(
            &mut members.places,
            progress.iter().enumerate().filter_map(|(member, state)| state.place.map(|_| member)),
        );
        let (contacts, rows) = (&mut search.contacts[..], &mut constraints.rows[..]);
        let (free, open): (Velocities, Velocities) = (|state| &state.v_predicted, |state| &state.unanswered);
        let posed = Posed { all, progress, contacts, rows, h_s, threads, free, open };
        report.add(&posed.solve(solver, members)?);
        for state in &mut *progress {
            let Progress { v_solved, v_predicted, place, .. } = state;
            (place.map_or(&v_predicted[..], |place| solver.solution().velocities(place))).clone_into(v_solved);
        }
        Ok(())
    }

    /// Lets contacts that close fast rebound.
    fn rebound(
        &mut self,
        on: On<'_>,
        all: &[Participant<'_>],
        may_fly: bool,
        report: &mut ClusterReport,
    ) -> Result<(), StepError> {
        let Self { impacts, search, constraints, solver, progress, members, .. } = self;
        let (solution, threads) = (solver.solution(), on.threads);
        let step = SolvedStep { all, search, constraints, solution, members, progress, threads, may_fly };
        let took = impacts.rebound(step)?;
        took.iter().for_each(|took| report.add(took));
        Ok(())
    }

    /// Finds the members that the impulses hold, and how places move by them.
    fn note_motion(&mut self, all: &[Participant<'_>]) {
        let Self { solver, search, constraints, progress, .. } = self;
        let solution = solver.solution();
        progress.iter_mut().for_each(|state| state.bears = false);
        let mut hold = |both: &mut dyn Iterator<Item = usize>| both.for_each(|member| progress[member].bears = true);
        for (owner, impulse) in search.owners.iter().zip(&solution.contacts_n_s) {
            if *impulse != DVec3::ZERO || owner.push_row.is_some_and(|row| solution.rows_n_s[row] != DVec3::ZERO) {
                hold(&mut owner.both());
            }
        }
        for ((owner, row), impulse) in constraints.owners.iter().zip(&constraints.rows).zip(&solution.rows_n_s) {
            if *impulse != DVec3::ZERO {
                hold(&mut owner.both());
                // a row between two joints has members besides its owner's
                hold(&mut row.sides.iter().flat_map(Side::parts).map(|part| part.member));
            }
        }
        for (one, state) in all.iter().zip(progress) {
            state.go(one.member.role() == Role::Rigid);
        }
    }

    /// Gives every member the impulses found.
    fn give(&mut self, report: &mut ClusterReport) {
        let Self { solver, search, progress, impacts, .. } = self;
        for state in &mut *progress {
            let left = state.place.map_or(&[][..], |place| solver.solution().unanswered(place));
            state.take(left);
        }
        impacts.leave(progress);
        progress.iter_mut().filter(|state| state.bears).for_each(Progress::hold);
        report.contacts = search.contacts.len() as u32;
        report.depth_m = search.contacts.iter().map(|contact| -contact.gap_m).fold(report.depth_m, f64::max);
    }
}
