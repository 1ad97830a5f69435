//! The phases of a fine step but for its solve and its records: members begin, contacts are detected, rows assembled, members integrated.
//!
//! In: members at the start of a fine step. Out: contacts and rows of its problem; after the solve, members at its end. Never here: the order of the
//! phases. Theory: docs/theory/clusters.md, section 9 (eq. 24, 26, 27).

use crate::constraint::FineStep;
use crate::detect::{ClusterScene, Judge, Round};
use crate::member::StepEnd;
use crate::member::participant::{Participant, Progress};
use crate::solve::multiply;
use crate::step::ClusterStepper;
use crate::step::report::ClusterReport;
use crate::step::solve::joint_miss_m;
use metachron_core::parallel::for_each;
use metachron_core::{ParallelFor, StepError};

impl ClusterStepper {
    /// Begins the steps of members that are at the end of one, and finds the velocities of all as others see them (eq.
    /// 24).
    pub(super) fn begin(
        &mut self,
        all: &mut [Participant<'_>],
        h_s: f64,
        threads: &dyn ParallelFor,
    ) -> Result<(), StepError> {
        for_each(threads, all, &mut self.progress, &Participant::size, &|one, state| {
            let own_s = h_s * f64::from(state.share);
            if state.part == 0 && state.begun_s != own_s {
                state.begin(&mut one.member, own_s);
            }
        });
        self.first_failure()?;
        for (place, (one, state)) in all.iter().zip(&mut self.progress).enumerate() {
            if state.part == 0 {
                let own_s = h_s * f64::from(state.share);
                state.begun_s = 0.0;
                state.start(&one.member);
                self.external.act(place, one, [own_s, self.macro_s], state);
            }
            state.part += 1;
            state.look(&one.member);
        }
        Ok(())
    }

    /// Finds where members may touch, but for members of a rigid pile: their contacts are not the problem's.
    pub(super) fn detect(&mut self, scene: &ClusterScene, all: &[Participant<'_>], h_s: f64) {
        let Self { search, pile, progress, factors_max, .. } = self;
        let round = Round { scene, all, progress, h_s, judge: Judge::Predicted };
        if pile.go_on(scene, all, *factors_max) {
            search.find(&round, pile.domains());
            pile.end_if_touched(search);
        }
        if !pile.is_on() {
            search.find(&round, &[]);
            pile.begin(scene, all, search, *factors_max);
            if pile.is_on() {
                search.find(&round, pile.domains());
            }
        }
        search.sense(&round);
    }

    /// Lays out springs, links and joints of a fine step that begins `after_s` seconds into the macro step.
    pub(super) fn assemble(&mut self, scene: &ClusterScene, all: &[Participant<'_>], h_s: f64, after_s: f64) {
        let Self { constraints, joints, progress, depth_m, .. } = self;
        constraints.clear();
        let step = FineStep { all, progress, h_s, after_s, joint_miss_m: joint_miss_m(*depth_m) };
        constraints.gather_springs(&step);
        constraints.gather_own_springs(&step);
        constraints.gather_links(&step);
        constraints.gather_lines(&step, &self.external.lines);
        self.external.give_led(h_s);
        joints.gather(scene, &step, constraints);
        constraints.add_inertia(&step);
    }

    /// Steps a rigid pile from the velocities that its members have without contact.
    pub(super) fn step_pile(
        &mut self,
        all: &[Participant<'_>],
        h_s: f64,
        report: &mut ClusterReport,
    ) -> Result<(), StepError> {
        self.pile.step(all, &mut self.progress, h_s, &mut self.sums)?.add_to(report);
        Ok(())
    }

    /// Moves all members; the step of some ends (eq. 26, 27).
    pub(super) fn integrate(
        &mut self,
        all: &mut [Participant<'_>],
        h_s: f64,
        threads: &dyn ParallelFor,
    ) -> Result<(), StepError> {
        for_each(threads, all, &mut self.progress, &Participant::size, &|one, state| {
            let since_s = h_s * f64::from(state.part);
            if state.part < state.share {
                one.member.change(|m| m.move_to(&state.v_before, since_s));
            } else {
                let Progress { v_before: v, touched, unanswered, pressed, .. } = &*state;
                let end = StepEnd { v, h_s: since_s, touched: *touched, unanswered, pressed };
                state.failure = one.member.end(&end).err();
                if state.failure.is_none() && !state.dx_impacts.is_empty() {
                    // by the impulses that move it so far; how it has gone is not needed any more
                    multiply(one.member.system().blocks, &state.dx_impacts, &mut state.v_mean);
                    one.member.change(|m| m.carry(&state.v_mean));
                }
                state.part = 0;
            }
        });
        self.first_failure()?;
        let Self { progress, failures, .. } = self;
        for (place, (one, state)) in all.iter().zip(progress).enumerate() {
            if state.part == 0 {
                failures.note_own(place, &one.member, h_s * f64::from(state.share));
            }
        }
        Ok(())
    }

    /// The failure of the first participant that failed in the loop over all.
    pub(super) fn first_failure(&mut self) -> Result<(), StepError> {
        let failures = self.progress.iter_mut().map(|state| state.failure.take());
        failures.fold(None, Option::or).map_or(Ok(()), Err)
    }
}
