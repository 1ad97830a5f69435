//! One turn of an agent: what every executor does, whoever keeps the time.
//!
//! begin   take commands, give up lag, look around, step, write the snapshot
//! finish  account, publish, touch, ask the governor, rest or go on
//!
//! Between the two an executor lets the turn's time pass: it did on a thread, lockstep charges it. A turn that fails, by an
//! error of the model, a state that is not finite or a panic (a bug of ours), parks the agent with the reason; nothing of it is
//! published and the others go on. Never here: threads, sleeping, events, any law of control.

use super::account::{Diary, Entry, SMOOTHING};
use super::governor::{Demand, Governor, TurnMeasure};
use super::handle::Shared;
use super::pace::{Pace, Start, Timeline};
use super::slot::{LatestSlot, SlotWriter};
use metachron_agents::{
    Agent, AgentId, Neighbour, Pull, Resolution, ResolutionRange, SimSpan, SimTime, Snapshot, StepReport, Surroundings,
};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, PoisonError};
use std::time::Duration;

/// An agent and all it needs to live.
pub(super) struct Actor {
    pub shared: Arc<Shared>,
    pub agent: Box<dyn Agent>,
    pub pace: Pace,
    pub dt_range: (SimSpan, SimSpan),
    pub range: Option<ResolutionRange>,
    pub governor: Option<Box<dyn Governor>>,
    pub writer: SlotWriter<Snapshot>,
    pub links: Vec<Arc<LatestSlot<Snapshot>>>,
    pub neighbours: Vec<Neighbour>,
    pub hands: Vec<Pull>,
    pub diary: Diary,
    pub rhythm: Rhythm,
    pub open: Option<Open>,
    /// Wall time of turns whose CPU time is not known yet.
    pub unsettled: Duration,
}

/// A turn between its begin and its finish.
#[derive(Debug, Clone, Copy)]
pub(super) struct Open {
    start: Start,
    report: StepReport,
    dt: SimSpan,
    resolution: Option<Resolution>,
}

/// What comes after a turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Next {
    /// The next one, when the pace says.
    Due,
    /// Nothing until somebody wakes the agent.
    Rest,
    /// Nothing any more.
    Parked,
}

/// The distance between the starts of an agent's turns.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Rhythm {
    last: Option<(Duration, u64)>,
    period_s: Option<f64>,
}

impl Rhythm {
    fn beat(&mut self, timeline: &Timeline, wall: Duration) {
        let piece = timeline.piece();
        match self.last.filter(|&(_, p)| p == piece) {
            None => self.period_s = None,
            Some((last, _)) => {
                let sample = wall.saturating_sub(last).as_secs_f64();
                self.period_s = Some(self.period_s.map_or(sample, |old| old + SMOOTHING * (sample - old)));
            }
        }
        self.last = Some((wall, piece));
    }
}

impl Actor {
    pub fn id(&self) -> AgentId {
        self.shared.id
    }

    /// Whether the agent has given up.
    pub fn is_parked(&self) -> bool {
        !self.shared.gauges.is_running() && !self.shared.gauges.is_resting()
    }

    /// Publishes the state the agent starts from, or parks it.
    pub fn introduce(&mut self) {
        let time = self.pace.time();
        let written = contained(|| self.write_snapshot(time));
        match written {
            Ok(()) => drop(self.writer.publish()),
            Err(reason) => self.shared.gauges.park(reason),
        }
        self.diary.pace(&self.shared.gauges, &self.pace);
    }

    /// Steps at wall time `wall`: the work it took in the model's unit, or `None` if it failed and is parked now.
    pub fn begin(&mut self, timeline: &Timeline, wall: Duration) -> Option<f64> {
        match contained(|| self.attempt(timeline, wall)) {
            Ok(open) => {
                self.open = Some(open);
                Some(open.report.work)
            }
            Err(reason) => {
                self.park(reason);
                None
            }
        }
    }

    /// Ends the turn that began: it took `work_s` seconds and it is wall time `wall`.
    pub fn finish(&mut self, timeline: &Timeline, wall: Duration, work_s: f64) -> Next {
        let Some(open) = self.open.take() else { return Next::Parked };
        let now = timeline.sim_at(wall);
        let missed = now > self.pace.time();
        let entry = Entry { now, late: open.start.late, missed, work_s };
        // first the account: who sees a state finds it accounted for
        self.diary.write(&self.shared.gauges, &self.pace, entry);
        let published = self.writer.publish();
        self.touch(now);
        if let Err(reason) = contained(|| self.consult(timeline, &open, work_s)) {
            self.park(reason);
            return Next::Parked;
        }
        // a state nobody could see is no state to rest in
        let at_rest = open.report.at_rest && published && self.hands.is_empty();
        if at_rest && self.lie_down(now) { Next::Rest } else { Next::Due }
    }

    /// Whether somebody has woken the agent from its rest; it is on its feet then, at the timeline's present.
    pub fn wakes(&mut self, timeline: &Timeline, wall: Duration) -> bool {
        if !self.shared.board.take_wake(self.id()) {
            return false;
        }
        self.hold_watched(timeline.sim_at(wall));
        self.pace.wake(timeline, wall);
        self.rhythm = Rhythm::default();
        self.diary.restart(timeline.sim_at(wall));
        self.diary.pace(&self.shared.gauges, &self.pace);
        self.shared.gauges.set_resting(false);
        true
    }

    /// Accounts for the CPU time of the turns since the last call: `share` of what they took on the wall.
    pub fn settle(&mut self, share: f64) {
        let nanos = (std::mem::take(&mut self.unsettled).as_nanos() as f64 * share) as u64;
        self.shared.gauges.cpu_nanos.fetch_add(nanos, Relaxed);
    }

    /// Brings the account up to date, at the end of a run: who rests has rested until now.
    pub fn close_account(&mut self, timeline: &Timeline, wall: Duration) {
        if self.shared.gauges.is_resting() {
            self.hold_watched(timeline.sim_at(wall));
            self.pace.wake(timeline, wall);
            self.diary.pace(&self.shared.gauges, &self.pace);
        }
        self.diary.flush(&self.shared.gauges);
    }

    pub fn park(&self, reason: String) {
        self.diary.flush(&self.shared.gauges);
        self.shared.gauges.park(reason);
    }

    fn attempt(&mut self, timeline: &Timeline, wall: Duration) -> Result<Open, String> {
        self.take_commands();
        self.rhythm.beat(timeline, wall);
        let start = self.pace.begin(timeline, wall);
        self.look_around();
        let (dt, time) = (self.pace.dt(), self.pace.time());
        let resolution = self.agent.resolution();
        let around =
            Surroundings { me: self.shared.id, time, neighbours: &self.neighbours, hands: &self.hands, links: &[] };
        let report = self.agent.step(dt, &around).map_err(|e| e.to_string())?;
        self.write_snapshot(time + dt)?;
        self.pace.advance();
        Ok(Open { start, report, dt, resolution })
    }

    fn take_commands(&mut self) {
        if let Some(wanted) = self.shared.mail.take_retune() {
            self.retune(wanted);
        }
        if let Some(dt) = self.shared.mail.take_dt() {
            self.set_dt(dt);
        }
        if let Some(hand) = self.shared.mail.take_hand() {
            self.hands.clear();
            self.hands.extend(hand);
        }
    }

    fn look_around(&mut self) {
        for (neighbour, slot) in self.neighbours.iter_mut().zip(&self.links) {
            neighbour.snapshot = slot.latest();
        }
    }

    fn write_snapshot(&mut self, time: SimTime) -> Result<(), String> {
        let agent = &self.agent;
        let finite = self.writer.fill(|into| {
            into.clear();
            agent.write_snapshot(into);
            into.time = time;
            into.is_finite()
        });
        let model = self.shared.model;
        if finite {
            self.note_watched();
            Ok(())
        } else {
            Err(format!("the state of this {model} at {:.6} s is not finite", time.as_secs_f64()))
        }
    }

    /// Writes down the points that are watched.
    fn note_watched(&self) {
        let Some(state) = self.writer.filled() else { return };
        let mut traces = self.shared.traces.lock().unwrap_or_else(PoisonError::into_inner);
        traces.iter_mut().for_each(|trace| trace.look(state));
    }

    /// Writes down that the points watched stay where they are until `now`: a state at rest still holds.
    fn hold_watched(&self, now: SimTime) {
        let state = self.shared.slot.latest();
        let mut traces = self.shared.traces.lock().unwrap_or_else(PoisonError::into_inner);
        traces.iter_mut().for_each(|trace| trace.hold(&state, now));
    }

    /// Tells those this agent acts on, once they can see how.
    fn touch(&self, now: SimTime) {
        let newest = self.shared.slot.latest();
        newest.touches.iter().filter(|id| **id != self.shared.id).for_each(|id| self.shared.board.touch(*id, now));
    }

    fn consult(&mut self, timeline: &Timeline, open: &Open, work_s: f64) -> Result<(), String> {
        let Some(governor) = &mut self.governor else { return Ok(()) };
        let wanted_period_s = 1.0 / (self.shared.wanted_hz * timeline.speed());
        let Demand { dt, resolution } = governor.after_step(&TurnMeasure {
            work_s,
            wanted_period_s,
            real_period_s: self.rhythm.period_s.unwrap_or(wanted_period_s),
            lateness_s: open.start.late.as_secs_f64(),
            dropped: open.start.dropped,
            dt: open.dt,
            resolution: open.resolution,
        });
        dt.into_iter().for_each(|dt| self.set_dt(dt));
        resolution.into_iter().for_each(|wanted| self.retune(wanted));
        Ok(())
    }

    fn set_dt(&mut self, dt: SimSpan) {
        self.pace.set_dt(dt.clamp(self.dt_range.0, self.dt_range.1));
    }

    fn retune(&mut self, wanted: Resolution) {
        let Some(range) = &self.range else { return };
        let wanted = range.clamp(wanted);
        if self.agent.resolution().is_some_and(|held| held != wanted) {
            self.agent.retune(wanted);
        }
    }

    fn lie_down(&mut self, now: SimTime) -> bool {
        let rests = self.shared.board.try_rest(self.id(), now);
        if rests {
            self.diary.flush(&self.shared.gauges);
            self.shared.gauges.set_resting(true);
        }
        rests
    }
}

/// Runs `part` of a turn; an error or a panic in it is the reason to park.
fn contained<T>(part: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    // the agent is not used again after a panic, so its broken promises are seen by nobody
    match catch_unwind(AssertUnwindSafe(part)) {
        Ok(result) => result,
        Err(payload) => {
            let text = payload.downcast_ref::<&str>().copied().map(str::to_owned);
            let text = text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_default();
            Err(format!("panicked, which is a bug in metachron: {text}"))
        }
    }
}
