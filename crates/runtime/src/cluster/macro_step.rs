//! One macro step of a cluster: all members as one problem, or none of them where one fails.
//!
//! In: the members at the leader's time, their plan. Out: the members a macro step later; after a failure they are
//! where they were, and the models of the members to blame know it ([`crate::turn::model`]). Never here: what becomes
//! of these ([`super::exclusion`]), who is a member.

use super::{MemberState, NOT_A_MEMBER, Wish, prepared};
use crate::commands::loads::Acting;
use crate::turn::agent_runner::{AgentRunner, StepOutcome};
use crate::turn::helpers::Helped;
use crate::turn::model::contained;
use metachron_contact::StepContext;
use metachron_contact::detect::ClusterScene;
use metachron_contact::member::Participant;
use metachron_contact::remote::{MacroStep, Pairs, Remotes, part};
use metachron_contact::step::{ClusterReport, ClusterStepper, Plan, StepDoubling};
use metachron_core::step_doubling::DoublingSchedule;
use metachron_core::{AgentId, ParallelFor, SimSpan, SimTime, StepReport, recycled};
use std::sync::Arc;

/// The parts of a macro step that is being made.
struct Making<'l, 'a> {
    scene: &'l ClusterScene,
    list: &'l mut Vec<Participant<'a>>,
    sides: &'l mut [Option<&'a mut Pairs>],
    stepper: &'l mut ClusterStepper,
    doubling: Option<&'l mut StepDoubling>,
    /// The partners of asynchronous pairs; `None` where there is no such pair.
    remotes: Option<&'a mut Remotes>,
    step: MacroStep,
    dt: SimSpan,
}

/// The report of a macro step, and the work of the same in halves where that was made.
struct Made {
    report: ClusterReport,
    extra: f64,
}

impl Making<'_, '_> {
    /// Steps all.
    fn make(&mut self, threads: &dyn ParallelFor) -> Result<Made, String> {
        let Self { scene, list, sides, stepper, doubling, remotes, step, dt } = self;
        let mut extra = 0.0;
        // a finer step that diverges says nothing of this one; partners give their impulses once
        if let (Some(doubling), None) = (doubling, &remotes) {
            extra = doubling.foresee(scene, list, *dt, threads).unwrap_or(0.0);
        }
        if let Some(remotes) = remotes.take() {
            remotes.join(list, sides, stepper, *step);
        }
        let report = stepper.step(scene, list, *dt, threads).map_err(|error| error.to_string())?;
        Ok(Made { report, extra })
    }

    /// After that: settles with partners and compares with the finer step; whether all may rest.
    fn conclude(&mut self, meets: bool) -> bool {
        let Self { list, sides, stepper, doubling, step, .. } = self;
        if meets {
            part(list, sides, stepper, step.dt_s);
        }
        if let Some(doubling) = doubling {
            doubling.compare(list);
        }
        let may_rest = stepper.lets_rest() && list.iter().all(|one| one.member.can_sleep());
        let rests = may_rest && !sides.iter().flatten().any(|pairs| pairs.is_active());
        if !rests {
            list.iter_mut().for_each(|one| one.member.change(|m| m.adapt()));
        }
        rests
    }
}

/// All of a leader's state that a macro step works with, taken out of it.
struct Lent {
    scene: Arc<ClusterScene>,
    stepper: Box<ClusterStepper>,
    doubling: Option<Box<StepDoubling>>,
    remotes: Option<Box<Remotes>>,
    helped: Helped,
    /// As it was before the step.
    schedule: DoublingSchedule,
    wishes: Vec<Wish>,
    participants: Vec<Participant<'static>>,
    sides: Vec<Option<&'static mut Pairs>>,
}

/// The outcome of a macro step.
struct Attempt {
    made: Result<Made, String>,
    /// After a step that was made, whether all may rest; an error is a member's that has moved with all others, and is
    /// parked where its state is written.
    rests: Result<bool, String>,
}

impl MemberState {
    /// Lends the solvers and storage of the macro step that `me` leads as its `steps`-th.
    fn lend(&mut self, steps: u64, me: AgentId) -> Lent {
        let schedule = self.schedule;
        Lent {
            scene: Arc::clone(&self.scene),
            stepper: self.stepper.take().unwrap_or_default(),
            doubling: self.repeats(steps, me),
            remotes: self.remotes.take(),
            helped: self.helped,
            schedule,
            wishes: std::mem::take(&mut self.wishes),
            participants: std::mem::take(&mut self.participants),
            sides: std::mem::take(&mut self.sides),
        }
    }

    /// Takes it back after `attempt`. A stepper is of no use after a step that was not made, and a step is not compared
    /// where one of its members could not conclude: it is as if it had not been compared.
    fn take_back(&mut self, lent: Lent, attempt: &Attempt) {
        let is_made = attempt.made.is_ok();
        self.stepper = is_made.then_some(lent.stepper);
        self.doubling = lent.doubling.filter(|_| !is_made || attempt.rests.is_ok()).or_else(|| self.doubling.take());
        if !is_made || attempt.rests.is_err() {
            self.schedule = lent.schedule;
        }
        (self.remotes, self.helped) = (lent.remotes, lent.helped);
        (self.wishes, self.participants, self.sides) = (lent.wishes, lent.participants, lent.sides);
    }
}

impl AgentRunner {
    /// Steps all that it leads and that are at its time, with itself, as one problem, each solve of it by at most so many steps.
    ///
    /// # Errors
    /// The reason why a member cannot go on: nobody has moved.
    pub(super) fn step_cluster(
        &mut self,
        plan: Plan,
        factors_max: Option<u32>,
        dt: SimSpan,
    ) -> Result<StepOutcome, String> {
        let (id, steps) = (self.shared.id, self.metrics.turns());
        let Some(mut lent) = self.cluster.as_mut().map(|member| member.lend(steps, id)) else {
            return Err(NOT_A_MEMBER.to_owned());
        };
        lent.stepper.set_factors_max(factors_max);
        lent.doubling.iter_mut().for_each(|doubling| doubling.set_factors_max(factors_max));
        let attempt = self.try_macro_step(&mut lent, plan, dt);
        if let Some(reason) = attempt.made.as_ref().err().or(attempt.rests.as_ref().err()) {
            self.each_member(|actor| actor.model.note_unwound(reason));
        }
        if let (Ok(_), Ok(_), Some(doubling)) = (&attempt.made, &attempt.rests, &lent.doubling) {
            self.note_errors(doubling, dt);
        }
        let report = attempt.made.as_ref().ok().map(|made| self.note_made(&lent.stepper, made, dt));
        if let Some(member) = &mut self.cluster {
            member.take_back(lent, &attempt);
        }
        let Attempt { made, rests } = attempt;
        let at_rest = rests.unwrap_or(false);
        match report {
            Some(report) => Ok(StepOutcome { report: StepReport { at_rest, ..report }, dt }),
            None => Err(made.err().unwrap_or_default()),
        }
    }

    /// Makes a macro step with its lent solvers.
    fn try_macro_step(&mut self, lent: &mut Lent, plan: Plan, dt: SimSpan) -> Attempt {
        let time = self.pace.time();
        let Lent { scene, stepper, doubling, remotes, helped, wishes, participants, sides, .. } = lent;
        let mut list = recycled(std::mem::take(participants));
        let mut pairs = recycled(std::mem::take(sides));
        let (mut led, peers) = (std::mem::take(&mut self.led), Arc::clone(&self.peers));
        let all = std::iter::once(&mut *self).chain(led.members_at(time));
        for (actor, wish) in all.zip(&*wishes) {
            let parts = plan.parts_in(wish.role, wish.step_s);
            if let Some((participant, own)) = actor.participant(time, dt, parts) {
                list.push(participant);
                pairs.push(own);
            }
        }
        let meets = pairs.iter().any(Option::is_some);
        let is_whole = list.len() == wishes.len();
        let mut making = Making {
            scene,
            list: &mut list,
            sides: &mut pairs,
            stepper,
            doubling: doubling.as_deref_mut(),
            remotes: meets.then(|| &mut **remotes.get_or_insert_default()),
            step: MacroStep { dt_s: dt.as_secs_f64(), parts: plan.parts },
            dt,
        };
        let make = || {
            let size = making.list.iter().map(Participant::size).sum();
            peers.helpers.make(size, helped, |threads| making.make(threads))
        };
        let made = if is_whole { contained(make) } else { Err(NOT_A_MEMBER.to_owned()) };
        let rests = contained(|| Ok(made.is_ok() && making.conclude(meets)));
        (*participants, *sides) = (recycled(list), recycled(pairs));
        self.led = led;
        Attempt { made, rests }
    }

    /// Notes the figures of a macro step that has been made.
    fn note_made(&mut self, stepper: &ClusterStepper, made: &Made, dt: SimSpan) -> StepReport {
        let Made { report, extra } = made;
        self.note_pairs(stepper, dt);
        self.note_events(stepper, dt);
        self.note_solves(report, dt);
        self.note_groups(self.pace.time() + dt);
        StepReport { work: report.work + extra, substeps: report.fine_steps, at_rest: false }
    }

    /// Its part in a step of `dt` from `time`, of which it makes so many parts, and its asynchronous pairs.
    fn participant(&mut self, time: SimTime, dt: SimSpan, parts: u32) -> Option<(Participant<'_>, Option<&mut Pairs>)> {
        let id = self.shared.id;
        let Self { model, observer, loads, links, shared, cluster, .. } = self;
        let MemberState { memory, grips, asynchronous, parts: own_parts, .. } = &mut **cluster.as_mut()?;
        *own_parts = parts;
        let Acting { springs: user_springs, forces, motors, pose } = prepared(loads, time, dt);
        let (neighbours, pose) = (observer.neighbours(), *pose);
        let context = StepContext { me: id, time, neighbours, user_springs, forces, motors, pose, links };
        let laws = &shared.laws;
        let (member, alone_s) = (model.member().ok()??, self.pace.wanted().as_secs_f64());
        let participant = Participant { id, member, context, laws, memory, parts, alone_s, grips };
        Some((participant, asynchronous.as_deref_mut()))
    }
}
