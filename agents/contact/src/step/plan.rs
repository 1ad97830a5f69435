//! How many steps each member of a cluster makes within a macro step and how long that is; and how the macro step begins anew in shorter ones.
//!
//! In: the step that each member wants, its strain by a solve, joints that do not hold. Out: the plan; members and their memories as they were
//! at the start of the macro step. Never here: steps themselves. Theory: docs/theory/clusters.md, section 9 (eq. 23).

use crate::detect::{ClusterScene, LEAST_STEPS_DEFAULT};
use crate::member::participant::Progress;
use crate::member::{ContactMemory, Participant, Role};
use crate::step::ClusterStepper;
use crate::step::report::ClusterReport;
use metachron_core::parallel::for_each;
use metachron_core::{ParallelFor, StepError};
use std::f64::consts::SQRT_2;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// The most steps that a member makes within a macro step.
const PARTS_MAX: u32 = 16;
/// The most times as many steps that a member makes whose motion strains it too far.
const DIVIDED_MAX: u32 = 64;
/// The most fine steps of a macro step, those of attempts that were given up among them: one member has time for all its divisions.
pub const FINE_STEPS_MAX: u32 = 2 * PARTS_MAX * DIVIDED_MAX;
/// After so many factors in a macro step, attempts that were given up among them, no member is divided further, and every solve makes at most
/// as many as are safe: 64 fine steps have time for 64 each.
pub const STEP_FACTORS_MAX: u32 = 4096;

/// How many steps of its own each of some bodies makes within a macro step, and how long that is, seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// The macro step, seconds.
    pub macro_s: f64,
    /// The longest step that a deformable wants, or any member where none is one, seconds.
    pub longest_s: f64,
    /// The most steps that a member makes.
    pub parts: u32,
}

impl Plan {
    /// The plan for members with these roles and wanted steps, seconds (eq. 23).
    #[must_use]
    pub fn of(members: impl Iterator<Item = (Role, f64)> + Clone) -> Self {
        let bent = members.clone().filter(|(role, _)| *role == Role::Deformable).map(|(_, wanted_s)| wanted_s);
        let all = members.clone().map(|(_, wanted_s)| wanted_s);
        let longest_s = bent.reduce(f64::max).or_else(|| all.reduce(f64::max)).unwrap_or(1.0);
        let mut plan = Self { macro_s: f64::INFINITY, longest_s, parts: 1 };
        for (_, wanted_s) in members {
            let parts = plan.parts_of(wanted_s);
            plan.parts = plan.parts.max(parts);
            plan.macro_s = plan.macro_s.min(f64::from(parts) * wanted_s);
        }
        plan
    }

    /// How many steps a deformable makes.
    #[must_use]
    pub fn parts_of(&self, wanted_s: f64) -> u32 {
        let ratio = self.longest_s / wanted_s;
        let mut parts = 1;
        // the nearest power of two, by ratios
        while parts < PARTS_MAX && ratio > f64::from(parts) * SQRT_2 {
            parts *= 2;
        }
        parts
    }

    /// How many steps a member of this role makes.
    #[must_use]
    pub fn parts_in(&self, role: Role, wanted_s: f64) -> u32 {
        if role == Role::Deformable { self.parts_of(wanted_s) } else { self.parts }
    }
}

impl ClusterStepper {
    /// Begins the first step of every member, in as many parts as its free motion needs.
    pub(super) fn plan(
        &mut self,
        all: &mut [Participant<'_>],
        dt_s: f64,
        threads: &dyn ParallelFor,
    ) -> Result<(), StepError> {
        for_each(threads, all, &mut self.progress, &Participant::size, &|one, state| {
            let own_s = dt_s / f64::from(one.parts);
            one.member.change(|m| m.look(&one.context, dt_s));
            state.begin(&mut one.member, own_s);
            let more = times(one.member.strain(one.member.system().free, own_s));
            state.parts = one.parts * more;
            state.begun_s = if more == 1 { own_s } else { 0.0 };
        });
        self.first_failure()
    }

    /// Gives shorter steps to rigid members where joints ask for them, at most so many of all; whether it does.
    pub(super) fn divide_joints(&mut self, all: &[Participant<'_>], most: u32) -> bool {
        if self.joints.ask <= 1 {
            return false;
        }
        let mut any = false;
        for (one, state) in all.iter().zip(&mut self.progress).filter(|(one, _)| one.member.role() == Role::Rigid) {
            any |= divide(state, f64::from(self.joints.ask), most.min(one.parts * DIVIDED_MAX));
        }
        any
    }

    /// Gives shorter steps to members that the solution strains too far, at most so many of all; whether there are any.
    pub(super) fn divide(&mut self, all: &[Participant<'_>], h_s: f64, most: u32) -> bool {
        let mut any = false;
        for (one, state) in all.iter().zip(&mut self.progress) {
            let so_far = one.member.strain(&state.v_before, h_s * f64::from(state.part));
            // a strain that is too much already grows through the rest of its step
            let strain = so_far * f64::from(state.share) / f64::from(state.part);
            // the division that its free motion asked for counts
            any |= so_far > 1.0 && divide(state, strain, most.min(one.parts * DIVIDED_MAX));
        }
        any
    }

    /// Bounds the solves of a fine step: by the budget, and once the factors of the macro step are spent by as many as are safe.
    pub(super) fn bound_solves(&mut self, scene: &ClusterScene, report: &ClusterReport) {
        let mut most = self.factors_max.map(|most| most.max(scene.budget().least_steps()));
        if report.factors >= STEP_FACTORS_MAX {
            most = Some(most.unwrap_or(LEAST_STEPS_DEFAULT).min(LEAST_STEPS_DEFAULT));
        }
        (self.solver.settings.factors_max, self.impacts.factors_max) = (most, most);
    }
}

/// The most steps of a member in a macro step that is begun anew after all in this report: a power of two, as they are, or 0.
pub(super) fn parts_left(report: &ClusterReport) -> u32 {
    let left = FINE_STEPS_MAX.saturating_sub(report.begun_steps);
    if left == 0 || report.factors >= STEP_FACTORS_MAX { 0 } else { 1 << left.ilog2() }
}

/// Lets a member make as many steps as this strain of one asks for, up to the most; whether it makes more. Where it may not, its strain is noted.
fn divide(state: &mut Progress, strain: f64, most: u32) -> bool {
    let divides = state.parts < most;
    if divides {
        state.parts = (state.parts * times(strain)).min(most);
    } else {
        state.strain_left = state.strain_left.max(strain);
    }
    divides
}

/// How many times as many steps a member needs that this one strains so far, as a share of the strain that it can take.
pub(super) fn times(strain: f64) -> u32 {
    let mut times = 1;
    while times < DIVIDED_MAX && strain > f64::from(times) {
        times *= 2;
    }
    times
}

impl ClusterStepper {
    /// Keeps the states from which a macro step starts.
    pub(super) fn keep(&mut self, all: &mut [Participant<'_>]) {
        self.kept.resize_with(all.len(), ContactMemory::default);
        for (one, kept) in all.iter_mut().zip(&mut self.kept) {
            one.member.change(|m| m.keep());
            kept.clone_from(one.memory);
        }
        self.is_kept = true;
    }

    /// Runs a part of the step from which code of members may unwind: all others are then put back.
    pub(super) fn guard<'p, T>(
        &mut self,
        all: &mut [Participant<'p>],
        run: impl FnOnce(&mut Self, &mut [Participant<'p>]) -> T,
    ) -> T {
        catch_unwind(AssertUnwindSafe(|| run(self, all))).unwrap_or_else(|panic| {
            self.put_back(all);
            resume_unwind(panic)
        })
    }

    /// Puts all back to the start of the macro step but members whose code has unwound, from wherever in it that came.
    /// Until all are kept none has moved.
    pub(super) fn put_back(&mut self, all: &mut [Participant<'_>]) {
        if !self.is_kept {
            return;
        }
        for (one, kept) in all.iter_mut().zip(&self.kept).filter(|(one, _)| !one.member.is_broken()) {
            // this one may unwind as well: its mark says so
            drop(catch_unwind(AssertUnwindSafe(|| one.member.change(|m| m.go_back()))));
            one.memory.clone_from(kept);
        }
    }

    /// Goes back to the start of the macro step.
    pub(super) fn go_back(&mut self, all: &mut [Participant<'_>]) {
        for ((one, kept), state) in all.iter_mut().zip(&self.kept).zip(&mut self.progress) {
            one.member.change(|m| m.go_back());
            one.memory.clone_from(kept);
            state.begun_s = 0.0;
        }
    }
}
