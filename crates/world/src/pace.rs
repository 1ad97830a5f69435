//! How fast a world's time passes: beside the clock on the wall, faster or slower, or as fast as its objects can step.
//!
//! In: a pace, spans. Out: objects that have lived so much more, and a world that stands still then. Never here: when a turn is due.

use super::error::WorldError;
use super::kinds::ExecutorKind;
use super::world::World;
use metachron_core::{SimSpan, SimTime};
use metachron_runtime::{AgentHandle, AgentState, SPEED_RANGE, STALLED_FOR_GOOD, TimelineCommand};
use std::sync::atomic::Ordering::{Acquire, Relaxed};
use std::time::Duration;

/// How fast a world's time passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// A second a second.
    RealTime,
    /// So many seconds a second, within [`SPEED_RANGE`].
    Factor(f64),
    /// As fast as objects can step, and no faster: none is late, none gives up time, however slow the machine is. So time passes in
    /// [`World::advance`]; where [`World::drive`] lets it run, it passes as beside the clock on the wall.
    Free,
}

/// How often a world in real time looks whether all objects have arrived.
const POLL_INTERVAL: Duration = Duration::from_micros(500);
/// The same where nothing else is waited for.
const POLL_FREE: Duration = Duration::from_micros(50);

/// By how much objects may be apart in time at [`Pace::Free`]: half as much as those that come near each other would wait for.
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
        let factor = match pace {
            Pace::Factor(factor) => factor,
            Pace::RealTime | Pace::Free => 1.0,
        };
        if !(SPEED_RANGE.0..=SPEED_RANGE.1).contains(&factor) {
            return Err(WorldError::BadPace { factor });
        }
        self.shared.is_free.store(pace == Pace::Free, Relaxed);
        self.drive(TimelineCommand::Speed(factor));
        Ok(())
    }

    /// Lets the world live for `span`, whatever its pace, then stops its time: it stands still.
    ///
    /// In lockstep every step that is due by then has been made; its clock counts whole nanoseconds, so that at a factor that does not divide
    /// `span` it lives longer by less than so many nanoseconds. On threads and in the pool each object that neither rests nor has failed,
    /// nor has been in one step for five seconds, has lived to the end at least; one whose step is longer than what was left is ahead by less than that step.
    /// A world that was stopped stays as it is; one that another thread pauses waits until it runs again, and one that another thread puts back
    /// ([`World::restore`]) lives from there what was left of the span.
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
        if !self.shared.is_free.load(Relaxed) {
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
        true
    }

    /// Lets virtual time pass, which does so in calls alone: where it was stopped, it is let go so far.
    fn advance_virtual(&self, span: SimSpan) {
        if self.timeline().until().is_some() {
            self.drive(TimelineCommand::Step(span));
        }
        let (now, timeline) = (self.now(), self.timeline());
        // a step that was begun before is made first; a replay lets time go as its recording says
        let left = timeline.until().map_or(span, |end| end.since(timeline.sim_at(now)).max(span));
        self.wait_until(now + timeline.wall_span(left));
    }

    /// Waits until all objects have lived to where time stops; it stops at once where they are not to go on, and `false` is returned. One that
    /// is led by another that has already arrived makes its last steps in a turn of that one: time goes on by `further` for it.
    fn wait_for_all(
        &self,
        further: impl Fn(SimSpan) -> TimelineCommand,
        poll: Duration,
        goes_on: &mut dyn FnMut() -> bool,
    ) -> bool {
        let mut put_back = self.shared.put_back.load(Acquire);
        let Some(mut end) = self.timeline().until() else { return true };
        let mut asked = end;
        while !self.has_stopped() {
            if !goes_on() {
                self.drive(TimelineCommand::Pause);
                return false;
            }
            let often = self.shared.put_back.load(Acquire);
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
            // a turn shows its leader's state last: who is still behind after that was looked at is not in a turn that is being shown
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
