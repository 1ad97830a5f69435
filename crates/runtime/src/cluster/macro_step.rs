//! One macro step of a cluster: all members as one problem, or none of them where one fails.
//!
//! In: the members at the leader's time, their plan. Out: the members a macro step later; after a failure they are where they were, and those whose
//! fault it is are known by their models ([`super::super::model`]). Never here: what becomes of these ([`super::exclusion`]), who is a member.

use super::super::agent_runner::{AgentRunner, StepOutcome, contained};
use super::super::loads::Acting;
use super::{ClusterSeat, NO_SEAT, prepared};
use metachron_contact::StepContext;
use metachron_contact::asynchronous::{MacroStep, Pairs, Remotes, part};
use metachron_contact::stepper::{
    ClusterMember, ClusterReport, ClusterScene, ClusterStepper, Participant, Plan, StepDoubling,
};
use metachron_core::{ParallelFor, SimSpan, SimTime, StepReport, recycled};
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
        // a finer step that diverges says nothing of this one; what partners give is given once
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
        let may_rest = stepper.lets_rest() && list.iter().all(|one| one.member.is_calm());
        may_rest && !sides.iter().flatten().any(|pairs| pairs.is_active())
    }
}

impl AgentRunner {
    /// Steps all that it leads and that are at its time, with itself, as one problem.
    ///
    /// # Errors
    /// The reason why a member cannot go on: nobody has moved.
    pub(super) fn step_cluster(&mut self, plan: Plan, dt: SimSpan) -> Result<StepOutcome, String> {
        let (id, time, steps) = (self.shared.id, self.pace.time(), self.metrics.turns());
        let Some(seat) = &mut self.cluster else { return Err(NO_SEAT.to_owned()) };
        let mut list = recycled(std::mem::take(&mut seat.participants));
        let mut sides = recycled(std::mem::take(&mut seat.sides));
        let (mut remotes, mut helped) = (seat.remotes.take(), seat.helped);
        let mut stepper = seat.stepper.take().unwrap_or_default();
        let schedule = seat.schedule;
        let mut doubling = seat.repeats(steps, id);
        let (scene, wishes) = (Arc::clone(&seat.scene), std::mem::take(&mut seat.wishes));
        let (mut led, peers) = (std::mem::take(&mut self.led), Arc::clone(&self.peers));
        let all = std::iter::once(&mut *self).chain(led.members_at(time));
        let parts = wishes.iter().map(|wish| plan.parts_in(wish.role, wish.step_s));
        for (actor, parts) in all.zip(parts) {
            if let Some((participant, pairs)) = actor.participant(time, dt, parts) {
                list.push(participant);
                sides.push(pairs);
            }
        }
        let meets = sides.iter().any(Option::is_some);
        let is_whole = list.len() == wishes.len();
        let mut making = Making {
            scene: &scene,
            list: &mut list,
            sides: &mut sides,
            stepper: &mut stepper,
            doubling: doubling.as_deref_mut(),
            remotes: meets.then(|| &mut **remotes.get_or_insert_default()),
            step: MacroStep { dt_s: dt.as_secs_f64(), parts: plan.parts },
            dt,
        };
        let make = || {
            let size = making.list.iter().map(Participant::size).sum();
            peers.helpers.make(size, &mut helped, |threads| making.make(threads))
        };
        let made = if is_whole { contained(make) } else { Err(NO_SEAT.to_owned()) };
        // what fails now has moved with all others, and is parked where its state is written
        let concluded = contained(|| Ok(made.is_ok() && making.conclude(meets)));
        let (list, sides) = (recycled(list), recycled(sides));
        self.led = led;
        if let Some(seat) = &mut self.cluster {
            (seat.participants, seat.sides, seat.wishes) = (list, sides, wishes);
            (seat.remotes, seat.helped) = (remotes, helped);
        }
        if let Some(reason) = made.as_ref().err().or(concluded.as_ref().err()) {
            self.each_member(|actor| actor.model.note_unwound(reason));
        }
        if made.is_err() || concluded.is_err() {
            // it is as if this step had not been compared
            let kept = doubling.take().filter(|_| made.is_err());
            self.cluster.iter_mut().for_each(|seat| seat.schedule = schedule);
            kept.into_iter().zip(&mut self.cluster).for_each(|(doubling, seat)| seat.doubling = Some(doubling));
        }
        if let Some(doubling) = doubling {
            self.note_errors(doubling, dt);
        }
        let made = made?;
        let report = self.note_made(stepper, plan, dt, &made);
        Ok(StepOutcome { report: StepReport { at_rest: concluded.unwrap_or(false), ..report }, dt })
    }

    /// Notes what a macro step was that has been made.
    fn note_made(&mut self, stepper: Box<ClusterStepper>, plan: Plan, dt: SimSpan, made: &Made) -> StepReport {
        let Made { report, extra } = made;
        self.note_pairs(&stepper, dt);
        self.note_events(&stepper, dt);
        self.note_solves(report, plan, dt);
        self.note_groups(self.pace.time() + dt);
        if let Some(seat) = &mut self.cluster {
            seat.stepper = Some(stepper);
        }
        StepReport { work: report.work + extra, substeps: report.fine_steps, at_rest: false }
    }

    /// Its part in a step of `dt` from `time`, of which it makes so many parts, and its asynchronous pairs.
    fn participant(&mut self, time: SimTime, dt: SimSpan, parts: u32) -> Option<(Participant<'_>, Option<&mut Pairs>)> {
        let id = self.shared.id;
        let Self { model, observer, loads, links, shared, cluster, .. } = self;
        let ClusterSeat { memory, grips, asynchronous, .. } = &mut **cluster.as_mut()?;
        let Acting { springs: hands, forces, motors, pose } = prepared(loads, time, dt);
        let (neighbours, pose) = (observer.neighbours(), *pose);
        let context = StepContext { me: id, time, neighbours, hands, forces, motors, pose, links };
        let laws = &shared.laws;
        let (member, alone_s) = (model.member().ok()??, self.pace.wanted().as_secs_f64());
        let participant = Participant { id, member, context, laws, memory, parts, alone_s, grips };
        Some((participant, asynchronous.as_deref_mut()))
    }
}
