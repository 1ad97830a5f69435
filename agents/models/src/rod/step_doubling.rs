//! The tube's own estimate of its error in time, metres: now and then steps are made a second time, in twice the substeps.
//!
//! In: the state before a step and after it. Out: what the steps of a tenth of a second do wrong. Never here: errors in space
//! ([`super::residual`]), any change of the tube's state, impulses on others. Theory: docs/theory/control.md, eq. 31, 32.

use super::anchor_springs::Tie;
use super::banded_ldl::Factor;
use super::company::Company;
use super::history::Past;
use super::method::Integrator;
use super::state::Config;
use super::step::{Setting, Stepper};
use metachron_core::AgentId;
use metachron_core::step_doubling::{Watch, farthest};

/// The error in time of one tube.
#[derive(Debug, Clone, Default)]
pub(super) struct Doubling {
    watch: Watch,
    again: Option<Box<Again>>,
}

/// The tube in twice the substeps, and room for them; only one that has moved has it.
#[derive(Debug, Clone, Default)]
struct Again {
    state: Config,
    past: Past,
    factor: Factor,
    /// Nobody: what is given is given once.
    company: Company,
    ties: Vec<Tie>,
}

impl Doubling {
    /// What steps make wrong in a tenth of a second, metres.
    pub fn error_m(&self) -> f64 {
        self.watch.error_m()
    }

    /// Whether the present step is made again.
    pub fn is_on(&self) -> bool {
        self.watch.is_on()
    }

    /// The tube rests: only space errs.
    pub fn rest(&mut self) {
        self.watch.rest();
    }

    /// Prepares for step number `steps` of the tube `me` from `now`. Those that others press on are made once: what they give is
    /// given once.
    pub fn begin(&mut self, (steps, me): (u64, AgentId), (now, ties): (&Config, &[Tie]), stepper: &Stepper) {
        let begins = self.watch.begins(steps, me);
        if !stepper.company.is_empty()
            || !stepper.company.fresh().is_empty()
            || self.again.as_ref().is_some_and(|again| !begins && !again.fits(now))
        {
            self.watch.give_up();
        }
        if !self.watch.is_on() {
            return;
        }
        let again = self.again.get_or_insert_default();
        if begins {
            again.state.copy_from(now);
            again.state.force.clone_from(&now.force);
            again.state.b.clone_from(&now.b);
            again.past.copy_from(&stepper.past);
        }
        again.ties.clear();
        again.ties.extend_from_slice(ties);
    }

    /// A step that is to be made again has ended at `now`, in `setting`'s substeps: it is, in twice as many.
    pub fn end(&mut self, stepper: &mut Stepper, now: &Config, setting: &Setting<'_>) {
        let Some(again) = self.again.as_deref_mut() else { return };
        let touching = stepper.contacts.is_touching();
        let setting = Setting { substeps: 2 * setting.substeps, ..*setting };
        if !again.step(stepper, &setting) {
            return self.watch.give_up();
        }
        if self.watch.made_twice(setting.dt) {
            self.watch.learn(farthest(&now.x, &again.state.x), order(setting.integrator, touching));
        }
    }
}

impl Again {
    /// Whether it is divided as `now` is.
    fn fits(&self, now: &Config) -> bool {
        self.state.x.len() == now.x.len()
    }

    /// Goes on by a step, with the stepper of the tube but for what that remembers; whether there is a next state.
    fn step(&mut self, stepper: &mut Stepper, setting: &Setting<'_>) -> bool {
        let Self { state, past, factor, company, ties } = self;
        let mut lend = |stepper: &mut Stepper| {
            std::mem::swap(&mut stepper.factor, factor);
            std::mem::swap(&mut stepper.past, past);
            std::mem::swap(&mut stepper.company, company);
        };
        let span = stepper.span_s;
        lend(stepper);
        let taken = stepper.step(state, setting, ties);
        lend(stepper);
        stepper.span_s = span;
        taken.is_ok()
    }
}

/// The order of the rule: where a tube touches, all of them are of the first.
const fn order(integrator: Integrator, touching: bool) -> i32 {
    match integrator {
        Integrator::Bdf2 | Integrator::EnergyMomentum if !touching => 2,
        _ => 1,
    }
}
