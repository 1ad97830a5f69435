//! The parts of a turn that begins: reading from others, the step itself, writing for others.
//!
//! prepare   take commands, drop lag, gather the members it leads, look around
//! step      reads and writes nothing that others have a share in: it can be made at any moment before the next part
//! complete  write the states, its members' too
//!
//! [`AgentRunner::begin`] makes all three. A run that is recorded makes the outer two in one order with the parts of
//! all other turns ([`super::turn_order`]), and the steps side by side. Never here: the end of a turn
//! ([`super::agent_runner`]).

use super::agent_runner::{AgentRunner, Effort, PendingTurn, StepOutcome};
use super::model::contained;
use super::turn_order::Held;
use crate::cluster::{Leap, SolveBound, Span, StepPlan};
use crate::records::events::EventKind;
use crate::time::agent_clock::{LAG_CAP, Start, Timeline};
use metachron_core::{Resolution, SimSpan};
use std::time::Duration;

/// The outcome of the first part of a turn.
pub(crate) enum Prepared {
    /// It failed, and is parked.
    Parked,
    /// It waits for others, or is to hand its turns over: nothing but the finish is left of the turn.
    Waits(Effort),
    /// It is to make this step.
    Steps(PreparedTurn),
}

impl Prepared {
    /// The most steps of each solve of the step that it is to make.
    fn factors_max(&self) -> Option<u32> {
        if let Self::Steps(turn) = self { turn.step.factors_max() } else { None }
    }
}

/// A turn whose step is to be made.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PreparedTurn {
    /// The timeline by which it is made, and the wall time at which it began.
    pub timeline: Timeline,
    pub wall: Duration,
    pub step: StepPlan,
    start: Start,
    wanted: SimSpan,
    resolution: Option<Resolution>,
    /// How many of the agents that it leads step with it, and how many steps others of them have made to come to its
    /// time.
    led: u32,
    alone: u32,
}

/// A turn that has begun in an order that is noted.
pub(crate) struct Begun<'a> {
    /// Its cost; `None` where it failed and is parked.
    pub effort: Option<Effort>,
    /// No other part is made before this is dropped: the finish belongs to the last part.
    pub held: Option<Held<'a>>,
}

impl AgentRunner {
    /// Steps at wall time `wall`, with all agents it leads, or waits for peers that are behind: the cost of that, or `None` if it failed
    /// and is parked now.
    pub fn begin(&mut self, timeline: &Timeline, wall: Duration) -> Option<Effort> {
        match self.prepare(timeline, wall, SolveBound::Decided) {
            Prepared::Parked => None,
            Prepared::Waits(effort) => Some(effort),
            Prepared::Steps(turn) => {
                let made = self.solve(&turn);
                self.complete(&turn, made)
            }
        }
    }

    /// As [`Self::begin`], in the order that `held` notes, if there is one.
    pub fn begin_in<'a>(&mut self, timeline: &Timeline, wall: Duration, held: Option<Held<'a>>) -> Begun<'a> {
        let Some(mut held) = held else { return Begun { effort: self.begin(timeline, wall), held: None } };
        let prepared = self.prepare(timeline, wall, SolveBound::Decided);
        held.note_prepared(self.id(), wall, prepared.factors_max());
        let (effort, held) = match prepared {
            Prepared::Parked => (None, held),
            Prepared::Waits(effort) => (Some(effort), held),
            Prepared::Steps(turn) => {
                let (made, held) = held.apart(self.id(), || self.solve(&turn));
                (self.complete(&turn, made), held)
            }
        };
        Begun { effort, held: Some(held) }
    }

    /// The first part of a turn, at wall time `wall`.
    pub fn prepare(&mut self, timeline: &Timeline, wall: Duration, bound: SolveBound) -> Prepared {
        self.shared.sleep.clear_wake(self.id());
        self.admit_arrivals();
        contained(|| self.attempt(timeline, wall, bound)).unwrap_or_else(|reason| {
            self.fail(reason, timeline, wall);
            Prepared::Parked
        })
    }

    /// The step of a prepared turn.
    pub fn solve(&mut self, turn: &PreparedTurn) -> Result<StepOutcome, String> {
        contained(|| self.make_step(turn.step))
    }

    /// The last part of a turn that begins: writes the states after its step; the cost of the turn, or `None` if it
    /// failed and is parked now.
    pub fn complete(&mut self, turn: &PreparedTurn, made: Result<StepOutcome, String>) -> Option<Effort> {
        match contained(|| self.write_turn(turn, made)) {
            Ok((open, effort)) => {
                self.open = Some(open);
                Some(effort)
            }
            Err(reason) => {
                self.fail(reason, &turn.timeline, turn.wall);
                None
            }
        }
    }

    fn fail(&mut self, reason: String, timeline: &Timeline, wall: Duration) {
        self.park(reason);
        self.disband(timeline, wall);
    }

    fn attempt(&mut self, timeline: &Timeline, wall: Duration, bound: SolveBound) -> Result<Prepared, String> {
        self.take_commands()?;
        let now = timeline.sim_at(wall);
        let near = self.keeps_common_time(now, self.pace.is_late(timeline, wall));
        let before = self.pace.time();
        let start = self.pace.begin(timeline, wall, near);
        let jumped = self.pace.time().since(before);
        if near && start.late > LAG_CAP || self.pace.clock_offset() > SimSpan::ZERO {
            self.shared.sleep.note_far_behind(now);
        }
        // even if it waits: the awaited agents may wait for one that it leads
        let alone = self.gather(timeline, wall, Leap { start: &start, jumped });
        self.forget_features();
        if self.waits(wall) || self.should_join() {
            return Ok(Prepared::Waits(Effort { work: 0.0, steps: alone }));
        }
        self.record_period(timeline, wall);
        let time = self.pace.time();
        self.led.members_at(time).for_each(|actor| actor.record_period(timeline, wall));
        let wanted = self.faults.span(self.pace.wanted(), self.id(), self.metrics.turns());
        let is_met = self.peers.broad_phase.get().is_some() || !self.links.is_empty();
        let wanted = if is_met { self.pace.stretch(wanted, timeline, wall, near) } else { wanted };
        let resolution = self.resolution();
        let step = loop {
            match self.plan_step(Span::Wanted(wanted)) {
                Ok(step) => break step,
                Err(reason) => self.exclude(reason)?,
            }
        };
        let factors_max = match bound {
            SolveBound::Decided => self.factors_within(timeline, start.late, step.dt()),
            SolveBound::Given(factors_max) => factors_max,
        };
        let (step, led) = (step.within(factors_max), self.led.members_at(time).count() as u32);
        Ok(Prepared::Steps(PreparedTurn { timeline: *timeline, wall, step, start, wanted, resolution, led, alone }))
    }

    fn write_turn(
        &mut self,
        turn: &PreparedTurn,
        made: Result<StepOutcome, String>,
    ) -> Result<(PendingTurn, Effort), String> {
        let PreparedTurn { timeline, wall, step, start, wanted, resolution, led, alone } = *turn;
        let (StepOutcome { report, dt }, led) = match made {
            Ok(outcome) => (outcome, led),
            Err(reason) => self.step_without_failed(reason, wanted, step.factors_max())?,
        };
        if start.dropped > SimSpan::ZERO {
            self.record_event(EventKind::RateMissed);
        }
        self.pace.shorten(wanted, dt);
        let rests = report.at_rest && self.may_rest(timeline.sim_at(wall));
        if rests && self.cluster.is_some() {
            self.rest_members();
        }
        let mut open = PendingTurn { start, dt, resolution, errors_m: [0.0; 2], rests };
        self.write_led(&open);
        self.write_snapshot(self.pace.time() + dt, rests)?;
        open.errors_m = self.errors_m();
        self.pace.advance_by(dt);
        Ok((open, Effort { work: report.work, steps: 1 + led + alone }))
    }

    fn record_period(&mut self, timeline: &Timeline, wall: Duration) {
        if self.governor.is_some() {
            self.turn_period.record(timeline, wall);
        }
    }

    /// Whether another agent has found since its last step that it should lead this one: a slow agent that stepped once more alone would
    /// not be where its leader expects it.
    fn should_join(&mut self) -> bool {
        if self.shared.handover().is_none() || self.observer.neighbours().is_empty() {
            return false;
        }
        self.observer.refresh();
        self.seek_leader().is_some()
    }
}
