//! The tube's own estimate of its error in time, metres: some steps are repeated in twice the substeps.
//!
//! In: the state before a step and after it. Out: the error accumulated in a tenth of a second. Never here: errors in space
//! ([`super::residual`]), any change of the tube's state. Theory: docs/theory/control.md, eq. 31, 32.

use super::anchor_springs::Tie;
use super::banded_ldl::Factor;
use super::history::History;
use super::spec::Integrator;
use super::state::RodState;
use super::step::{Setting, Stepper};
use metachron_core::step_doubling::{DoublingSchedule, farthest};
use metachron_core::{AgentId, Archive, ArchiveError, archive_values};

/// The error in time of one tube.
#[derive(Debug, Clone, Default)]
pub(super) struct Doubling {
    schedule: DoublingSchedule,
    again: Option<Box<FinerRun>>,
}

/// The tube in twice the substeps, and its working storage; only allocated for a tube that has moved.
#[derive(Debug, Clone, Default)]
struct FinerRun {
    state: RodState,
    past: History,
    factor: Factor,
    ties: Vec<Tie>,
}

impl Doubling {
    /// Writes or reads a row of repeated steps as far as it is.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive.value(&mut self.schedule)?;
        archive
            .option(&mut self.again, Box::default, |again, archive| archive_values!(archive, again.state, again.past))
    }

    /// Error that steps accumulate in a tenth of a second, metres.
    pub fn error_m(&self) -> f64 {
        self.schedule.error_m()
    }

    /// Whether the present step is to be repeated.
    pub fn is_on(&self) -> bool {
        self.schedule.is_on()
    }

    /// Resets the estimate: the tube rests, and only the error in space remains.
    pub fn rest(&mut self) {
        self.schedule.rest();
    }

    /// Whether step number `steps` of the tube `me` is the first of those to be repeated.
    pub fn begins(&mut self, steps: u64, me: AgentId) -> bool {
        self.schedule.begins(steps, me)
    }

    /// Prepares for a step from `now`, after [`Self::begins`].
    pub fn begin(&mut self, begins: bool, now: &RodState, ties: &[Tie], stepper: &Stepper) {
        if self.again.as_ref().is_some_and(|again| !begins && !again.fits(now)) {
            self.schedule.cancel();
        }
        if !self.schedule.is_on() {
            return;
        }
        let again = self.again.get_or_insert_default();
        if begins {
            again.state.copy_from(now);
            again.state.force.clone_from(&now.force);
            again.state.b.clone_from(&now.b);
            again.past.copy_from(&stepper.past);
        }
        again.state.softening.clone_from(&now.softening);
        again.ties.clear();
        again.ties.extend_from_slice(ties);
    }

    /// Repeats the step that has ended at `now`, made in `setting`'s substeps, with twice as many.
    pub fn end(&mut self, stepper: &mut Stepper, now: &RodState, setting: &Setting<'_>) {
        let Some(again) = self.again.as_deref_mut() else { return };
        let setting = Setting { substeps: 2 * setting.substeps, ..*setting };
        if !again.step(stepper, &setting) {
            return self.schedule.cancel();
        }
        if self.schedule.finish_step(setting.dt) {
            self.schedule.record(farthest(&now.x, &again.state.x), order(setting.integrator));
        }
    }
}

impl FinerRun {
    /// Whether the number of nodes equals that of `now`.
    fn fits(&self, now: &RodState) -> bool {
        self.state.x.len() == now.x.len()
    }

    /// Advances by a step with the tube's stepper, its memory swapped for this one's; returns whether there is a next state.
    fn step(&mut self, stepper: &mut Stepper, setting: &Setting<'_>) -> bool {
        let Self { state, past, factor, ties } = self;
        let mut swap_memory = |stepper: &mut Stepper| {
            std::mem::swap(&mut stepper.factor, factor);
            std::mem::swap(&mut stepper.past, past);
        };
        swap_memory(stepper);
        let taken = stepper.step(state, setting, ties);
        swap_memory(stepper);
        taken.is_ok()
    }
}

/// The order of the rule.
const fn order(integrator: Integrator) -> i32 {
    match integrator {
        Integrator::Bdf2 | Integrator::EnergyMomentum => 2,
        _ => 1,
    }
}
