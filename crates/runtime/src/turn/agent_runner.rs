//! One turn of an agent, the same for every executor.
//!
//! begin   take commands, drop lag, look around, step, write the snapshot ([`super::turn_parts`])
//! finish  record, publish, touch, call the governor, rest or go on
//!
//! Between the two an executor lets the turn's time pass: on a thread it has passed, lockstep charges it. A turn that fails, by an error of
//! the model, a state that is not finite or a panic (a bug of metachron), parks the agent with the reason; nothing of it is published and
//! the other agents go on. Never here: threads, sleeping, events, any law of control, the step and the turns of the agents that an agent
//! leads ([`crate::cluster`]).

use super::helpers::Helped;
use super::model::{Model, contained};
use crate::agent::handle::Shared;
use crate::cluster::{Led, MemberState};
use crate::commands::loads::Loads;
use crate::lock_free::slot::SlotWriter;
use crate::neighbours::observation::{Observer, Peers};
use crate::records::events::{AgentEvent, EventKind};
use crate::records::governor::{Demand, Governor, TurnMeasure};
use crate::records::metrics::{MetricsWriter, SMOOTHING};
use crate::records::turns::Took;
use crate::time::agent_clock::{AgentClock, Start, Timeline};
use crate::time::faults::Faults;
use metachron_contact::{Carving, Link};
use metachron_core::{AgentId, Resolution, ResolutionRange, SimSpan, SimTime, Snapshot, StepReport};
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::time::Duration;

/// An agent with its runtime state.
pub(crate) struct AgentRunner {
    pub shared: Arc<Shared>,
    pub peers: Arc<Peers>,
    pub model: Model,
    pub pace: AgentClock,
    pub dt_range: (SimSpan, SimSpan),
    pub range: Option<ResolutionRange>,
    pub governor: Option<Box<dyn Governor>>,
    pub faults: Faults,
    pub writer: SlotWriter<Snapshot>,
    /// Matter was taken out of it since its cluster last stepped.
    pub carved: bool,
    pub observer: Observer,
    pub links: Vec<Link>,
    /// The users' commands that act on it; `None` of an agent that was never sent any.
    pub loads: Option<Box<Loads>>,
    /// Its place in a contact cluster; `None` of an agent that is no member of any.
    pub cluster: Option<Box<MemberState>>,
    /// The agents it leads.
    pub led: Led,
    pub metrics: MetricsWriter,
    pub turn_period: TurnPeriod,
    pub open: Option<PendingTurn>,
    /// Whether an agent that does not step with it was near it in its previous turn, if that was checked.
    pub was_near: Option<bool>,
    /// The state that was written last is withheld.
    pub withheld: bool,
    /// Up to which revision each ledger was announced to its receiver.
    pub announced: Vec<(AgentId, u64)>,
    /// Wall time of turns whose CPU time is not known yet, nanoseconds.
    pub unsettled_ns: u64,
    /// Simulated time up to which the workers of a pool have served it.
    pub served: SimTime,
    /// Service that it lacks relative to its present worker's queue: it makes that up.
    pub owed: SimSpan,
}

/// A turn between its begin and its finish.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
pub(crate) struct PendingTurn {
    pub start: Start,
    pub dt: SimSpan,
    /// The resolution of the step, if a governor needs it.
    pub resolution: Option<Resolution>,
    /// Its own error estimates afterwards, metres: in all, and the part caused by its time steps.
    pub errors_m: [f64; 2],
    /// Whether it may rest after this turn.
    pub rests: bool,
}

/// A step that was made.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StepOutcome {
    pub report: StepReport,
    /// Its length: at most the requested one.
    pub dt: SimSpan,
}

/// Cost of a turn that has begun.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Effort {
    /// Work of one step, in the model's unit.
    pub work: f64,
    /// Number of such steps: one, and one more for every step of the agents it leads.
    pub steps: u32,
}

/// Continuation after a turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Next {
    /// The next turn, when the pace says.
    Due,
    /// Rest until the agent is woken.
    Rest,
    /// It hands its turns over to this agent.
    Join(AgentId),
    /// Parked: no more turns.
    Parked,
}

/// Measures the interval between the starts of an agent's turns.
#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct TurnPeriod {
    last: Option<(Duration, u64)>,
    period_s: Option<f32>,
}

impl TurnPeriod {
    pub(crate) fn record(&mut self, timeline: &Timeline, wall: Duration) {
        let piece = timeline.piece();
        match self.last.filter(|&(_, p)| p == piece) {
            None => self.period_s = None,
            Some((last, _)) => {
                let sample = wall.saturating_sub(last).as_secs_f32();
                self.period_s = Some(self.period_s.map_or(sample, |old| old + SMOOTHING as f32 * (sample - old)));
            }
        }
        self.last = Some((wall, piece));
    }
}

impl AgentRunner {
    pub fn id(&self) -> AgentId {
        self.shared.id
    }

    /// Tells readers of its events what happens to it now.
    pub fn record_event(&self, kind: EventKind) {
        self.shared.streams.event(&AgentEvent { at: self.pace.time(), kind });
    }

    /// Whether the agent is parked.
    pub fn is_parked(&self) -> bool {
        self.shared.gauges.has_ended()
    }

    /// Publishes the initial state of the agent, or parks it.
    pub fn publish_initial(&mut self) {
        let time = self.pace.time();
        let written = contained(|| self.write_snapshot(time, false));
        match written {
            Ok(()) => drop(self.writer.publish()),
            Err(reason) => self.park(reason),
        }
        self.notify_reader();
        self.metrics.pace(&self.shared.gauges, &self.pace);
    }

    /// Ends the turn that `took` so long: `turn_s` seconds of the caller, turns of the agents that it leads included.
    pub fn finish(&mut self, timeline: &Timeline, took: Took, turn_s: f64) -> Next {
        let wall = took.ended;
        let work_s = self.cluster.as_ref().map_or(turn_s, |member| member.helped().core_s(turn_s));
        // it waited, or another agent leads it from now on
        let Some(open) = self.open.take() else {
            let next = self.seek_leader().map_or(Next::Due, Next::Join);
            if next == Next::Due {
                self.record_wait(Took { ended: self.pace.due(timeline).unwrap_or(wall).max(wall), ..took });
            }
            return next;
        };
        let now = timeline.sim_at(wall);
        self.note_price(timeline, took);
        let work_s = self.share_work(work_s);
        self.metrics.time_turn(&self.shared.gauges, turn_s);
        // its own state comes last: a reader that sees it also sees the states of all agents that it leads
        let mut published = self.conclude_led(timeline, took);
        published &= self.record_step(&open, timeline, wall, work_s);
        self.record_turn(&open, self.id(), took);
        if let Err(reason) = contained(|| self.run_governor(timeline, &open, work_s)) {
            self.park(reason);
            self.disband(timeline, wall);
            return Next::Parked;
        }
        self.part();
        if let Some(leader) = self.seek_leader() {
            return Next::Join(leader);
        }
        // an agent does not rest in a state that was not published
        if open.rests && published && self.try_to_rest(now) { Next::Rest } else { Next::Due }
    }

    /// Whether the agent was woken from its rest; it then runs again at the timeline's present, with all agents it leads.
    pub fn try_wake(&mut self, timeline: &Timeline, wall: Duration) -> bool {
        if !self.shared.sleep.take_wake(self.id()) {
            return false;
        }
        self.resume(timeline, wall);
        true
    }

    /// How it goes on where a run takes it up: a turn that began in virtual time ends.
    pub fn next(&mut self, timeline: &Timeline, wall: Duration) -> Next {
        if self.is_parked() {
            Next::Parked
        } else if self.open.is_some() {
            self.finish(timeline, Took { begun: wall, ended: wall }, 0.0)
        } else if self.shared.gauges.is_resting() {
            Next::Rest
        } else {
            Next::Due
        }
    }

    /// Goes on in a run whose clock reads `wall` now, with all agents it leads.
    pub fn rebase(&mut self, wall: Duration) {
        self.pace.rebase(wall);
        self.turn_period = TurnPeriod::default();
        self.led.each(|actor| actor.rebase(wall));
    }

    /// Accounts for a turn that took `wall` time of the caller, shared equally with the agents it leads.
    pub fn count(&mut self, wall: Duration) {
        let mut helped = Helped::default();
        let mut take = |member: Option<&mut Box<MemberState>>| {
            let Helped { waited, cpu } = member.map_or_else(Helped::default, |member| member.take_helped());
            helped.waited += waited;
            helped.cpu += cpu;
        };
        take(self.cluster.as_mut());
        // agents that caught up with it have made turns of their own within its turn
        self.led.each(|actor| take(actor.cluster.as_mut()));
        let Helped { waited, cpu } = helped;
        let members = 1 + self.led.len() as u32;
        let own_ns = (wall.saturating_sub(waited) / members).as_nanos() as u64;
        let helpers_ns = (cpu / members).as_nanos() as u64;
        self.count_ns(own_ns, helpers_ns);
        self.led.each(|actor| actor.count_ns(own_ns, helpers_ns));
    }

    fn count_ns(&mut self, wall_ns: u64, cpu_ns: u64) {
        self.unsettled_ns += wall_ns;
        self.add_cpu(cpu_ns);
    }

    fn add_cpu(&self, nanos: u64) {
        let cpu = &self.shared.gauges.cpu_nanos;
        // no other thread writes: an atomic exchange would cost more
        cpu.store(cpu.load(Relaxed) + nanos, Relaxed);
    }

    /// Accounts for the CPU time of the turns since the last call: the fraction `share` of their wall time.
    pub fn settle(&mut self, share: f64) {
        let nanos = (std::mem::take(&mut self.unsettled_ns) as f64 * share) as u64;
        self.add_cpu(nanos);
        self.led.each(|member| member.settle(share));
    }

    /// Completes the metrics at the end of a run: a resting agent has rested until now, and the last state is published.
    pub fn close_account(&mut self, timeline: &Timeline, wall: Duration) {
        self.show_withheld();
        if self.shared.gauges.is_resting() {
            let now = timeline.sim_at(wall);
            self.hold_watched(now);
            self.pace.wake(now);
            self.metrics.pace(&self.shared.gauges, &self.pace);
        }
        self.metrics.flush(&self.shared.gauges);
        self.led.each(|member| member.close_account(timeline, wall));
    }

    /// Parks the agent for good, for this reason.
    pub fn park(&mut self, reason: String) {
        self.show_withheld();
        self.metrics.flush(&self.shared.gauges);
        let left = self.shared.gauges.has_left();
        self.record_event(if left { EventKind::Gone } else { EventKind::Parked });
        self.shared.gauges.park(reason);
        self.notify_reader();
        if let Some(broad_phase) = self.peers.broad_phase.get().filter(|_| !left) {
            broad_phase.publish_rest(self.id());
        }
        self.close();
    }

    /// Its resolution, if a governor needs it.
    pub fn resolution(&mut self) -> Option<Resolution> {
        self.governor.as_ref()?;
        self.model.call(|agent| agent.resolution()).ok().flatten()
    }

    /// The error estimates of the state that was written last, metres: in all, and the part caused by its time steps.
    pub fn errors_m(&self) -> [f64; 2] {
        self.writer.filled().map_or([0.0; 2], |state| [state.residual_m, state.drift_m])
    }

    /// Obeys the commands that came in.
    ///
    /// # Errors
    /// Where it leaves the run, or was moved to a state that is none.
    pub fn take_commands(&mut self) -> Result<(), String> {
        let mut pending = self.shared.mail.take();
        if pending.leaves {
            self.vanish();
            return Err(GONE.to_owned());
        }
        if let Some(broken) = self.model.broken() {
            return Err(broken.to_owned());
        }
        if let Some(wanted) = pending.set_resolution {
            self.set_resolution(wanted)?;
        }
        if let Some(dt) = pending.dt {
            self.set_dt(dt);
        }
        if pending.has_loads() {
            self.loads.get_or_insert_default().take(&mut pending, self.pace.time());
        }
        if let Some(pressure_pa) = pending.pressure_pa {
            self.model.call(|agent| agent.set_pressure_pa(pressure_pa))?;
        }
        self.carve(&pending.carvings)?;
        let mut moved = false;
        if let Some(state) = &pending.state {
            moved = self.model.call(|agent| agent.set_state(state))?.is_ok();
        }
        if let Some(motion) = &pending.motion {
            moved |= self.model.call(|agent| agent.set_motion(motion))?;
        }
        let moves = pending.motion.is_some_and(|motion| motion.position_m.is_some() || motion.rotation.is_some());
        if moved && (moves || pending.state.is_some()) {
            self.cluster.iter_mut().for_each(|member| member.note_placed());
        }
        // others find it where it is now
        if moved { self.write_snapshot(self.pace.time(), false) } else { Ok(()) }
    }

    /// Removes the cells in some regions; others touch and see it without them from now on.
    fn carve(&mut self, carvings: &[Carving]) -> Result<(), String> {
        for carving in carvings {
            if let Some(removed) = self.model.call(|agent| agent.carve(carving))? {
                self.carved = true;
                self.record_event(EventKind::Carved(removed));
            }
        }
        if self.carved { self.publish_form() } else { Ok(()) }
    }

    /// Whether no outside influence prevents the agent from resting at simulated time `now`.
    pub fn is_undisturbed(&self, now: SimTime) -> bool {
        let own = self.pace.time();
        !self.loads.as_ref().is_some_and(|loads| loads.keep_awake(own))
            && !self.shared.sleep.must_stay_awake(self.id(), now)
    }

    /// Lets its governor answer a turn that took `work_s` seconds of its own.
    pub fn run_governor(&mut self, timeline: &Timeline, open: &PendingTurn, work_s: f64) -> Result<(), String> {
        let Some(governor) = &mut self.governor else { return Ok(()) };
        let wanted_period_s = 1.0 / (self.shared.wanted_hz() * timeline.speed());
        let is_timed = !timeline.is_free();
        let Demand { dt, resolution } = governor.after_step(&TurnMeasure {
            work_s: if is_timed { work_s } else { 0.0 },
            wanted_period_s,
            real_period_s: self.turn_period.period_s.filter(|_| is_timed).map_or(wanted_period_s, f64::from),
            lateness_s: open.start.late.as_secs_f64(),
            dropped: open.start.dropped,
            dt: open.dt,
            resolution: open.resolution,
            residual_m: open.errors_m[0],
            drift_m: open.errors_m[1],
        });
        dt.into_iter().for_each(|dt| self.set_dt(dt));
        resolution.map_or(Ok(()), |wanted| self.set_resolution(wanted))
    }

    fn set_dt(&mut self, dt: SimSpan) {
        self.pace.set_dt(dt.clamp(self.dt_range.0, self.dt_range.1));
    }

    fn set_resolution(&mut self, wanted: Resolution) -> Result<(), String> {
        let Some(range) = &self.range else { return Ok(()) };
        let wanted = range.clamp(wanted);
        self.model.call(|agent| {
            if agent.resolution().is_some_and(|held| held != wanted) {
                agent.set_resolution(wanted);
            }
        })
    }

    fn try_to_rest(&mut self, now: SimTime) -> bool {
        let led = self.led.ids();
        let rests = self.shared.sleep.try_rest(self.id(), led, now);
        if rests {
            self.rest_now();
        }
        rests
    }

    /// Puts it to rest, with all agents it leads.
    fn rest_now(&mut self) {
        self.metrics.flush(&self.shared.gauges);
        self.shared.gauges.set_resting(true);
        self.record_event(EventKind::Rests);
        self.notify_reader();
        if let Some(broad_phase) = self.peers.broad_phase.get() {
            broad_phase.publish_rest(self.id());
        }
        self.led.each(AgentRunner::rest_now);
    }

    /// Continues after a rest, at the timeline's present, with all agents it leads.
    fn resume(&mut self, timeline: &Timeline, wall: Duration) {
        let now = timeline.wakes_at(wall);
        self.hold_watched(now);
        self.pace.wake(now);
        // as an agent that newly comes near its peers: while it slept their time went on
        self.was_near = Some(false);
        self.turn_period = TurnPeriod::default();
        self.metrics.restart(now);
        self.metrics.pace(&self.shared.gauges, &self.pace);
        self.shared.gauges.woken_at.store(self.pace.scene_time().as_nanos(), Relaxed);
        self.shared.gauges.set_resting(false);
        self.record_event(EventKind::Wakes);
        self.notify_reader();
        self.led.each(|member| member.resume(timeline, wall));
    }
}

/// Why an agent makes no more turns that has left.
const GONE: &str = "it has left";
