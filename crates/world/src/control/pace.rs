//! How fast a world's time passes: beside the clock on the wall, faster or slower, or as fast as its objects can step.
//!
//! In: a pace, spans. Out: objects that have lived so much more, and a world that stands still then. Never here: when a turn is due.

use crate::description::kinds::ExecutorKind;
use crate::error::WorldError;
use crate::history::recording::Entry;
use crate::world::{State, World};
use metachron_core::{SimSpan, SimTime};
use metachron_runtime::{AgentHandle, AgentState, SPEED_RANGE, STALLED_FOR_GOOD, TimelineCommand};
use std::time::Duration;

/// How fast a world's time passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// A second a second.
    RealTime,
    /// So many seconds a second, within [`SPEED_RANGE`].
    Factor(f64),
    /// As fast as objects can step, and no faster: none is late, gives up time or makes longer steps than it was asked for, however slow the
    /// machine is, and a rate that control may lower is kept. So time passes in [`World::advance`]; where [`World::drive`] lets it run, it
    /// passes as beside the clock on the wall, and an object that is too slow for that is behind until time stops. In
    /// lockstep steps take no virtual time: declared costs of steps make no difference to any bit.
    Free,
}

/// How often a world in real time looks whether all objects have arrived.
const POLL_INTERVAL: Duration = Duration::from_micros(500);
/// The same where nothing else is waited for.
const POLL_FREE: Duration = Duration::from_micros(50);

/// By how much objects may be apart in time at [`Pace::Free`]: half as much as objects that come near each other would
/// wait for.
const FREE_SLICE: SimSpan = SimSpan::from_millis(10);

/// So much virtual time passes between two questions whether to go on.
const VIRTUAL_SLICE: SimSpan = SimSpan::from_millis(20);

impl World {
    /// Sets how fast time passes from now on: how long a span takes on the clock, and not how much of it [`World::advance`] lives. In lockstep,
    /// where the clock is virtual, a factor changes how fast the declared machine has to be.
    ///
    /// # Errors
    /// [`WorldError::BadPace`] for a factor outside its range; the pace is then as it was.
    pub fn set_pace(&self, pace: Pace) -> Result<(), WorldError> {
        let asked = match pace {
            Pace::Factor(factor) if !(SPEED_RANGE.0..=SPEED_RANGE.1).contains(&factor) => {
                return Err(WorldError::BadPace { factor });
            }
            Pace::Factor(factor) => TimelineCommand::Speed(factor),
            Pace::RealTime => TimelineCommand::Speed(1.0),
            Pace::Free => TimelineCommand::Free,
        };
        self.drive(asked);
        Ok(())
    }

    /// Whether time passes at [`Pace::Free`].
    #[must_use]
    pub fn is_free(&self) -> bool {
        self.timeline().has_free_pace()
    }

    /// The most simulated time that one of its objects has not lived, though time has passed: its dropped time and its
    /// lag now. Zero as long as the declared machine of lockstep, or this one, is fast enough; at [`Pace::Free`] it
    /// does not grow.
    #[must_use]
    pub fn given_up(&self) -> SimSpan {
        let now = self.time();
        self.agents().iter().map(|agent| agent.given_up(now)).max().unwrap_or(SimSpan::ZERO)
    }

    /// Lets the world live for `span`, whatever its pace, then stops its time: it stands still.
    ///
    /// In lockstep every step that is due by then, at [`Pace::Free`] before then, has been made; its clock counts whole nanoseconds, so that at a
    /// factor that does not divide `span` it lives longer by less than so many nanoseconds. On threads and in the pool
    /// each object that neither rests nor has failed, nor has been in one step for five seconds, has lived to the end
    /// at least; one whose step is longer than the rest of the span is ahead by less than that step.
    /// A world that was stopped stays as it is; one that another thread pauses waits until it runs again, and one that
    /// another thread puts back ([`World::restore`]) lives from there the rest of the span. In lockstep, where another
    /// thread is in a step that lasts for five seconds, nothing is done: that object is [`AgentState::Stalled`].
    pub fn advance(&self, span: SimSpan) {
        if self.executor() == ExecutorKind::Lockstep {
            return self.advance_virtual(span);
        }
        self.advance_real(span, &mut || true);
    }

    /// As [`World::advance`], and asks many times a second of the wall whether to go on; in lockstep between pieces of 20 ms of its time. Where not,
    /// the world stands where it has come to. Returns whether it was to go on every time.
    pub fn advance_while(&self, span: SimSpan, mut goes_on: impl FnMut() -> bool) -> bool {
        if self.executor() != ExecutorKind::Lockstep {
            return self.advance_real(span, &mut goes_on);
        }
        let mut left = span;
        while left > SimSpan::ZERO {
            let piece = left.min(VIRTUAL_SLICE);
            self.advance_virtual(piece);
            if !goes_on() {
                return false;
            }
            left = SimSpan::from_nanos(left.as_nanos() - piece.as_nanos());
        }
        true
    }

    /// The same on the clock of the wall.
    fn advance_real(&self, span: SimSpan, goes_on: &mut dyn FnMut() -> bool) -> bool {
        if !self.is_free() {
            self.drive(TimelineCommand::Step(span));
            return self.wait_for_all(TimelineCommand::Step, POLL_INTERVAL, goes_on);
        }
        let mut left = span;
        while left > SimSpan::ZERO && !self.has_stopped() {
            let slice = left.min(FREE_SLICE);
            self.drive(TimelineCommand::Leap(slice));
            if !self.wait_for_all(TimelineCommand::Leap, POLL_FREE, goes_on) {
                return false;
            }
            left = SimSpan::from_nanos(left.as_nanos() - slice.as_nanos());
        }
        // the leap is over: agents that are woken from now on go on from here
        self.drive(TimelineCommand::Step(SimSpan::ZERO));
        true
    }

    /// Lets virtual time pass, which does so in calls alone: where it was stopped, it is let go so far. One call: no other thread puts the world
    /// back between its look and its act.
    fn advance_virtual(&self, span: SimSpan) {
        let Some(mut state) = self.state_for_good() else { return };
        let State::Running(run) = &mut *state else { return };
        let run = run.as_mut();
        if run.timeline().until().is_some() {
            let step = TimelineCommand::Step(span);
            self.let_pass(run, || Entry::Drive(step), |run| run.drive(step));
        }
        let (now, timeline) = (run.now(), run.timeline());
        // a step that was begun before is made first; a replay lets time go as its recording says
        let left = timeline.until().map_or(span, |end| end.since(timeline.sim_at(now)).max(span));
        let until = now + timeline.wall_span(left);
        self.let_pass(run, || Entry::Wait(until), |run| run.wait_until(until));
    }

    /// Waits until all objects have lived to where time stops; it stops at once where they are not to go on, and `false` is returned. One that
    /// is led by another that has already arrived makes its last steps in a turn of that one: time goes on by `further` for it.
    fn wait_for_all(
        &self,
        further: impl Fn(SimSpan) -> TimelineCommand,
        poll: Duration,
        goes_on: &mut dyn FnMut() -> bool,
    ) -> bool {
        let mut put_back = self.rewinds();
        let Some(mut end) = self.timeline().until() else { return true };
        let mut asked = end;
        while !self.has_stopped() {
            if !goes_on() {
                self.drive(TimelineCommand::Pause);
                return false;
            }
            let often = self.rewinds();
            if often != put_back {
                // time stops elsewhere since
                let Some(until) = self.timeline().until() else { return true };
                (put_back, end, asked) = (often, until, until);
            }
            let agents = self.agents();
            let behind = |agent: &&AgentHandle| !has_reached(agent, end);
            // a state covers the step that leads to it: it may be there before its time
            if self.time() >= end && !agents.iter().any(|agent| behind(&agent)) {
                return true;
            }
            // a turn shows its leader's state last: an agent still behind after that was looked at is not in a turn
            // that is being shown
            let idle = agents.iter().filter(behind).find_map(|agent| {
                let leader = agents.of(agent.led_by()?)?;
                (leader.latest().moment() >= asked && behind(&agent)).then_some(leader)
            });
            // where another thread has stopped time, or lets it run, it is not ours to let it go on
            if let Some(leader) = idle.filter(|_| self.timeline().until() == Some(asked)) {
                self.drive(further(leader.stats().dt));
                asked = self.timeline().until().unwrap_or(asked);
            }
            self.wait_until(self.now() + poll);
        }
        true
    }
}

/// Whether nothing more is to be waited for: the agent has reached `end`, rests on, has failed, or makes a step that does not end. One that wakes at
/// the end is to step only after it.
fn has_reached(agent: &AgentHandle, end: SimTime) -> bool {
    match agent.state() {
        AgentState::Running => agent.lived_to() >= end,
        AgentState::Stalled => agent.lived_to() >= end || agent.stalled_for() >= STALLED_FOR_GOOD,
        AgentState::Resting => !agent.is_woken(),
        AgentState::Parked(_) | AgentState::Gone => true,
    }
}
