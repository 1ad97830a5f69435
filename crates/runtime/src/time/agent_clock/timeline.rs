//! The scene's common timeline: maps wall time to simulated time.
//!
//! In: pause, run, speed, single step. Out: an immutable [`Timeline`] that every thread reads without waiting.
//! Never here: an agent's own time ([`super::AgentClock`] has it), sleeping.

use arc_swap::ArcSwap;
use metachron_core::{SimSpan, SimTime};
use std::sync::Arc;
use std::sync::atomic::{
    AtomicU64,
    Ordering::{Acquire, Release},
};
use std::time::Duration;

/// The slowest and the fastest simulated time, simulated seconds per wall second.
/// Slower is a pause; faster, no agent keeps up and every step would be late.
pub const SPEED_RANGE: (f64, f64) = (0.001, 100.0);

/// A linear piece of the timeline: from wall time `wall` on, simulated time runs from `sim` with `speed`, and stops when it reaches
/// `until`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Timeline {
    wall: Duration,
    sim: SimTime,
    speed: f64,
    until: Option<SimTime>,
    /// Whether simulated time waits for agents, so that no step is late ([`TimelineCommand::Free`]).
    free: bool,
    /// Where simulated time was before it leapt; `None` where it has not.
    leapt_from: Option<SimTime>,
    piece: u64,
}

/// A user's command to the timeline.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum TimelineCommand {
    /// Simulated time stops.
    Pause,
    /// Simulated time runs on.
    Run,
    /// Simulated seconds per wall second from now on; clamped to [`SPEED_RANGE`], NaN changes nothing.
    Speed(f64),
    /// Simulated time runs on for exactly this span, then stops: a frame span for a single step. Steps requested while one is in progress
    /// add up.
    Step(SimSpan),
    /// Simulated time is so much later at once, and stops there: the steps up to then are made as fast as they can, and none is late.
    Leap(SimSpan),
    /// Simulated time waits for agents from now on, until a speed is set: none is late, gives up time or lengthens a step, however slow the
    /// machine is. In virtual time, turns take none of it; elsewhere one that is too slow for the clock is behind until time stops for it.
    Free,
}

impl Timeline {
    /// A timeline at wall speed, both times from zero.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            wall: Duration::ZERO,
            sim: SimTime::ZERO,
            speed: 1.0,
            until: None,
            free: false,
            leapt_from: None,
            piece: 0,
        }
    }

    /// Whether it can be in force: one that was read may be of any numbers.
    pub fn is_sound(&self) -> bool {
        (SPEED_RANGE.0..=SPEED_RANGE.1).contains(&self.speed)
    }

    /// The simulated time at wall time `wall`.
    #[must_use]
    pub fn sim_at(&self, wall: Duration) -> SimTime {
        let free = if wall >= self.wall {
            self.sim + scaled(wall - self.wall, self.speed)
        } else {
            self.sim - scaled(self.wall - wall, self.speed)
        };
        self.until.map_or(free, |end| free.min(end))
    }

    /// The simulated time at which an agent goes on that wakes at wall time `wall`: where time has leapt, it takes part from before that.
    #[must_use]
    pub fn wakes_at(&self, wall: Duration) -> SimTime {
        self.leapt_from.unwrap_or_else(|| self.sim_at(wall))
    }

    /// The wall time at which simulated time reaches `sim`; `None` if it stops before.
    ///
    /// A time before this piece is mapped as if this piece had always run.
    #[must_use]
    pub fn wall_of(&self, sim: SimTime) -> Option<Duration> {
        if sim < self.sim {
            return Some(self.wall.saturating_sub(self.wall_span(self.sim.since(sim))));
        }
        // a span that begins where time stops never begins: `until` itself is not passed
        if self.until.is_some_and(|end| sim >= end) {
            return None;
        }
        Some(self.wall.saturating_add(self.wall_span(sim.since(self.sim))))
    }

    /// Wall duration of `span` at this speed.
    #[must_use]
    pub fn wall_span(&self, span: SimSpan) -> Duration {
        if self.speed == 1.0 {
            return Duration::from_nanos(span.as_nanos());
        }
        Duration::from_nanos((span.as_nanos() as f64 / self.speed).ceil() as u64)
    }

    /// Simulated time that passes in the wall duration `span` at this speed.
    #[must_use]
    pub fn sim_span(&self, span: Duration) -> SimSpan {
        scaled(span, self.speed)
    }

    /// Simulated seconds per wall second while it runs.
    #[must_use]
    pub const fn speed(&self) -> f64 {
        self.speed
    }

    /// Whether simulated time runs at wall time `wall`.
    #[must_use]
    pub fn runs_at(&self, wall: Duration) -> bool {
        self.until.is_none_or(|end| self.sim_at(wall) < end)
    }

    /// When simulated time stops; `None` if it goes on.
    #[must_use]
    pub const fn until(&self) -> Option<SimTime> {
        self.until
    }

    /// Whether simulated time waits for agents ([`TimelineCommand::Free`], [`TimelineCommand::Leap`]): no step is late then.
    #[must_use]
    pub const fn is_free(&self) -> bool {
        self.free || self.leapt_from.is_some()
    }

    /// Whether it does so until a speed is set ([`TimelineCommand::Free`]).
    #[must_use]
    pub const fn has_free_pace(&self) -> bool {
        self.free
    }

    /// The piece that begins at wall time `to` with the simulated time `sim`, and runs, stands or has as far to go as this one at wall time
    /// `from`: time was set back or on, and whether it passes is another matter. Its number follows that of `other` too.
    #[must_use]
    pub fn set_to(&self, from: Duration, to: Duration, sim: SimTime, other: &Self) -> Self {
        let until = self.until.map(|end| sim + end.since(self.sim_at(from)));
        let leapt_from = self.leapt_from.map(|_| sim);
        Self { wall: to, sim, until, leapt_from, piece: self.piece.max(other.piece) + 1, ..*self }
    }

    /// The number of this piece: it changes with every change to the timeline.
    #[must_use]
    pub const fn piece(&self) -> u64 {
        self.piece
    }

    /// The piece that follows when `drive` is requested at wall time `wall`.
    #[must_use]
    pub fn after(&self, wall: Duration, drive: TimelineCommand) -> Self {
        let sim = self.sim_at(wall);
        let mut next = Self { wall, sim, piece: self.piece + 1, ..*self };
        match drive {
            TimelineCommand::Pause => next.until = Some(sim),
            TimelineCommand::Run => (next.until, next.leapt_from) = (None, None),
            TimelineCommand::Speed(speed) if speed.is_nan() => return *self,
            TimelineCommand::Speed(speed) => {
                (next.speed, next.free) = (speed.clamp(SPEED_RANGE.0, SPEED_RANGE.1), false);
            }
            TimelineCommand::Free => (next.speed, next.free) = (1.0, true),
            TimelineCommand::Step(span) => {
                (next.until, next.leapt_from) = (Some(self.until.unwrap_or(sim) + span), None);
            }
            TimelineCommand::Leap(span) => {
                let since = self.until.unwrap_or(sim);
                next.sim = since + span;
                (next.until, next.leapt_from) = (Some(next.sim), Some(since));
            }
        }
        next
    }
}

impl Default for Timeline {
    fn default() -> Self {
        Self::new()
    }
}

fn scaled(span: Duration, speed: f64) -> SimSpan {
    let nanos = u64::try_from(span.as_nanos()).unwrap_or(u64::MAX);
    if speed == 1.0 { SimSpan::from_nanos(nanos) } else { SimSpan::from_nanos((nanos as f64 * speed) as u64) }
}

/// The timeline shared by all agents of a run: one writer, readers that never wait.
#[derive(Debug)]
pub struct SharedTimeline {
    piece: ArcSwap<Timeline>,
    /// The number of the piece, written after it.
    number: AtomicU64,
}

impl SharedTimeline {
    /// Shares a fresh timeline.
    #[must_use]
    pub fn new() -> Self {
        Self { piece: ArcSwap::from_pointee(Timeline::new()), number: AtomicU64::new(0) }
    }

    /// The piece in force.
    #[must_use]
    pub fn read(&self) -> Timeline {
        **self.piece.load()
    }

    /// Updates `known`, a piece that was read before: costs one load while it is in force.
    pub fn renew(&self, known: &mut Timeline) {
        if self.number.load(Acquire) != known.piece {
            *known = self.read();
        }
    }

    /// Changes the timeline at wall time `wall`. Threads that sleep until a due time must be woken after it.
    pub fn drive(&self, wall: Duration, drive: TimelineCommand) {
        self.set(self.read().after(wall, drive));
    }

    /// Replaces the piece in force by `next`, which has another number.
    pub(crate) fn set(&self, next: Timeline) {
        self.piece.store(Arc::new(next));
        self.number.store(next.piece, Release);
    }
}

impl Default for SharedTimeline {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(n: u64) -> Duration {
        Duration::from_millis(n)
    }

    const fn sim_ms(n: u64) -> SimTime {
        SimTime::from_nanos(n * 1_000_000)
    }

    #[test]
    fn pause_freezes_simulated_time_and_run_goes_on_from_there() {
        let paused = Timeline::new().after(ms(100), TimelineCommand::Pause);
        assert_eq!(paused.sim_at(ms(5000)), sim_ms(100));
        assert!(!paused.runs_at(ms(5000)));
        let running = paused.after(ms(5000), TimelineCommand::Run);
        assert_eq!(running.sim_at(ms(5010)), sim_ms(110));
    }

    #[test]
    fn a_single_step_advances_by_exactly_its_span() {
        let span = SimSpan::from_nanos(16_666_667);
        let paused = Timeline::new().after(ms(100), TimelineCommand::Pause);
        let stepping = paused.after(ms(200), TimelineCommand::Step(span));
        assert!(stepping.runs_at(ms(210)));
        assert_eq!(stepping.sim_at(ms(9000)), sim_ms(100) + span);
        assert!(!stepping.runs_at(ms(9000)));
    }

    #[test]
    fn single_steps_asked_for_in_a_hurry_add_up() {
        let span = SimSpan::from_nanos(10_000_000);
        let paused = Timeline::new().after(ms(100), TimelineCommand::Pause);
        let twice = paused.after(ms(200), TimelineCommand::Step(span)).after(ms(201), TimelineCommand::Step(span));
        assert_eq!(twice.sim_at(ms(9000)), sim_ms(120));
    }

    #[test]
    fn a_change_of_speed_keeps_the_present() {
        let slow = Timeline::new().after(ms(1000), TimelineCommand::Speed(0.25));
        assert_eq!(slow.sim_at(ms(1000)), sim_ms(1000));
        assert_eq!(slow.sim_at(ms(1400)), sim_ms(1100));
        assert_eq!(slow.after(ms(1400), TimelineCommand::Speed(f64::NAN)), slow);
    }

    #[test]
    fn wall_of_is_the_first_moment_that_has_reached_the_time() {
        for speed in [0.001, 0.3, 1.0, 3.0, 7.7] {
            let line = Timeline::new().after(ms(3), TimelineCommand::Speed(speed));
            for nanos in [3_000_000_u64, 3_000_001, 4_567_891, 1_234_567_891] {
                let sim = SimTime::from_nanos(nanos);
                let wall = line.wall_of(sim).unwrap();
                // rounding of one product and one quotient: a nanosecond of either time
                assert!(sim.secs_after(line.sim_at(wall)) <= 1e-9, "speed {speed}, {nanos} ns");
            }
        }
    }

    #[test]
    fn a_step_is_never_due_on_a_timeline_that_stands_still() {
        let paused = Timeline::new().after(ms(100), TimelineCommand::Pause);
        assert_eq!(paused.wall_of(sim_ms(100)), None);
        assert_eq!(paused.wall_of(sim_ms(101)), None);
        assert_eq!(paused.wall_of(sim_ms(90)), Some(ms(90)));
    }
}
