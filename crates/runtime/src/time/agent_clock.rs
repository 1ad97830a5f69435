//! An agent's own time relative to the scene's: the only place where wall time and simulated time are related.
//!
//! A step from t to t + dt is *released* when the timeline reaches t and has until t + dt to be published, so that a state that is on time
//! covers the present and pictures need no delay. A late agent steps again immediately until it has caught up; an agent that may touch
//! peers makes longer steps while it is behind, so that its contact keeps its time. Past the lag cap its time jumps to the present without
//! a step: the gap is dropped and counted, so that an overloaded agent runs at the rate it can reach, and never falls further behind.
//! Near peers time never jumps: it is postponed ("put off"), and the interaction continues unchanged, but slower.
//! At the free pace time waits for agents ([`TimelineCommand::Free`]): none is late, and none of this happens.
//! Never here: sleeping, the step itself. Theory: the periodic task of real-time scheduling, release and deadline.

mod timeline;

pub use timeline::{SPEED_RANGE, SharedTimeline, Timeline, TimelineCommand};

use metachron_core::{SimSpan, SimTime};
use std::time::Duration;

/// Lag past which an agent drops the gap, wall time.
/// Shorter, a hiccup of the machine costs simulated time; longer, an overload shows as old states (MuJoCo resyncs at the same lag).
pub const LAG_CAP: Duration = Duration::from_millis(100);

/// The same for an agent near peers: it makes up shorter delays, and its time is postponed by the rest.
pub const LAG_CAP_NEAR: Duration = Duration::from_millis(500);

/// Number of waits of two milliseconds of wall time, a second in all, for peers without news. An agent waits for peers with news as long as
/// they are behind.
const PATIENCE: u16 = 500;

/// A lag of this many steps is still made up, however long a step is: an agent of 5 Hz is not late after 100 ms.
const LAG_CAP_STEPS: u64 = 2;

/// Longer than any step.
const NO_LIMIT: u32 = u32::MAX;

/// Longest stretched step of an agent that is behind.
const STRETCHED_MAX: SimSpan = SimSpan::from_nanos(50_000_000);

/// Near peers a stretched step is at most this multiple of the requested one, as a quotient: a sheet of 240 Hz that
/// merges three of its steps into one throws off a body that rests on it.
const STRETCHED_NEAR: (u64, u64) = (5, 2);

/// And at most this long: the longest macro step of a cluster that is behind (docs/theory/clusters.md, section 9).
const STRETCHED_NEAR_MAX: SimSpan = SimSpan::from_nanos(16_666_667);

/// An agent that waits for peers for more than 1/`WAIT_SHARE` of its time is behind because of them.
const WAIT_SHARE: u16 = 4;

/// Unit of waiting times, wall time.
const TICK: Duration = Duration::from_micros(125);

/// Duration of one wait, milliseconds of wall time.
const WAIT_MS: u32 = 2;

/// An agent's own time and the length of its next step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct AgentClock {
    time: SimTime,
    dt: SimSpan,
    /// The step it makes instead of `dt` if that is shorter, nanoseconds; else longer than any step.
    shorter: u32,
    /// The stretched step while it is behind, nanoseconds.
    stretched: u32,
    dropped: SimSpan,
    /// Total postponement: it is on time at the timeline's present less this.
    clock_offset: SimSpan,
    rested: SimSpan,
    /// No step before this wall time, milliseconds: it waits for peers.
    held_until_ms: u32,
    /// Start of the previous step, wall time in [`TICK`]s.
    begun: u32,
    /// Ticks spent waiting for peers, and ticks in all, since the previous step and before, with decaying weight.
    waits: [u16; 2],
    /// Waits used up of [`PATIENCE`].
    waited: u16,
    /// Hash of the last news of the awaited peers.
    news: u16,
}

/// Start of a turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Start {
    /// Delay between the release and the start of the turn, wall time; measured before time is dropped.
    pub late: Duration,
    /// The simulated time dropped at this start; zero for a turn within the lag cap.
    pub dropped: SimSpan,
}

impl AgentClock {
    /// A pace from `time` in steps of `dt` (above zero).
    #[must_use]
    pub const fn new(time: SimTime, dt: SimSpan) -> Self {
        Self {
            time,
            dt,
            shorter: NO_LIMIT,
            stretched: 0,
            dropped: SimSpan::ZERO,
            clock_offset: SimSpan::ZERO,
            rested: SimSpan::ZERO,
            held_until_ms: 0,
            begun: 0,
            waits: [0; 2],
            waited: 0,
            news: 0,
        }
    }

    /// The agent's own time.
    #[must_use]
    pub const fn time(&self) -> SimTime {
        self.time
    }

    /// The scene time at which it is on time: its own time plus its postponement.
    #[must_use]
    pub fn scene_time(&self) -> SimTime {
        self.time + self.clock_offset
    }

    /// Its total postponement.
    #[must_use]
    pub const fn clock_offset(&self) -> SimSpan {
        self.clock_offset
    }

    /// The length of its steps: the requested one, or the shorter one that it made last.
    #[must_use]
    pub fn dt(&self) -> SimSpan {
        self.shorter().map_or(self.dt, |shorter| self.dt.min(shorter))
    }

    /// The requested length of step.
    #[must_use]
    pub const fn wanted(&self) -> SimSpan {
        self.dt
    }

    /// Requests steps of `dt` (above zero) from now on.
    pub const fn set_dt(&mut self, dt: SimSpan) {
        self.dt = dt;
    }

    /// The last step, if it was shorter than requested.
    #[must_use]
    pub fn shorter(&self) -> Option<SimSpan> {
        (self.shorter != NO_LIMIT).then(|| SimSpan::from_nanos(self.shorter.into()))
    }

    /// Stores that the agent steps by `made` (above zero, not longer than `wanted`) instead of `wanted`.
    pub fn shorten(&mut self, wanted: SimSpan, made: SimSpan) {
        self.shorter = if made < wanted { u32::try_from(made.as_nanos()).unwrap_or(NO_LIMIT) } else { NO_LIMIT };
    }

    /// Simulated time dropped so far because it could not be made up.
    #[must_use]
    pub const fn dropped(&self) -> SimSpan {
        self.dropped
    }

    /// Simulated time spent at rest so far: no steps were made and none are missing.
    #[must_use]
    pub const fn rested(&self) -> SimSpan {
        self.rested
    }

    /// The wall time at which the next step is released; `None` if the timeline stops before it.
    #[must_use]
    pub fn due(&self, timeline: &Timeline) -> Option<Duration> {
        timeline.wall_of(self.scene_time()).map(|due| due.max(Duration::from_millis(self.held_until_ms.into())))
    }

    /// Waits briefly from wall time `wall` for peers that are behind; returns `false` once its patience is used up. `news` changes with
    /// every news of them.
    pub fn wait(&mut self, wall: Duration, news: u64) -> bool {
        // a different number in nearly all cases
        let news = (news ^ (news >> 16) ^ (news >> 32)) as u16;
        if news != self.news {
            (self.news, self.waited) = (news, 0);
        }
        let waits = self.waited < PATIENCE;
        if waits {
            self.waited += 1;
            self.held_until_ms = u32::try_from(wall.as_millis()).map_or(u32::MAX, |now| now.saturating_add(WAIT_MS));
        }
        waits
    }

    /// Whether it is more than two steps behind.
    #[must_use]
    pub fn is_late(&self, timeline: &Timeline, wall: Duration) -> bool {
        if timeline.is_free() {
            return false;
        }
        let steps = self.dt().as_nanos().saturating_mul(LAG_CAP_STEPS);
        timeline.sim_at(wall).since(self.scene_time()).as_nanos() > steps
    }

    /// Begins a turn at wall time `wall`: measures how late it is. Past the lag cap its time jumps to the present and the lag is dropped;
    /// if it is `near` peers its time is postponed by the excess instead, and continues from where it is.
    pub fn begin(&mut self, timeline: &Timeline, wall: Duration, near: bool) -> Start {
        let cap = if near { LAG_CAP_NEAR } else { LAG_CAP };
        let now = timeline.sim_at(wall);
        let lag = now.since(self.scene_time());
        let late = timeline.wall_span(lag);
        let steps = SimSpan::from_nanos(self.dt().as_nanos().saturating_mul(LAG_CAP_STEPS));
        let mut dropped = SimSpan::ZERO;
        self.count_wait(wall);
        if timeline.is_free() {
            return Start { late: Duration::ZERO, dropped };
        }
        if late > cap && late > timeline.wall_span(steps) {
            if near {
                dropped = timeline.sim_span(late - cap);
                self.clock_offset += dropped;
            } else {
                dropped = lag;
                self.time += lag;
            }
            self.dropped += dropped;
        }
        Start { late, dropped }
    }

    /// The step to make instead of `wanted` by an agent that may touch peers, at wall time `wall`: a quarter longer with each turn that
    /// finds it more than two steps behind, slowly shorter again when it has caught up.
    ///
    /// Time that it dropped later would be time that its peers simulate without it; and steps of one length disturb its motion less than
    /// single long ones.
    pub fn stretch(&mut self, wanted: SimSpan, timeline: &Timeline, wall: Duration, near: bool) -> SimSpan {
        if timeline.is_free() {
            self.stretched = 0;
            return wanted;
        }
        let lag = timeline.sim_at(wall).since(self.scene_time());
        let now = SimSpan::from_nanos(self.stretched.into()).max(wanted);
        let times = |span: SimSpan, by: u64, of: u64| SimSpan::from_nanos(span.as_nanos().saturating_mul(by) / of);
        let most = if near {
            times(wanted, STRETCHED_NEAR.0, STRETCHED_NEAR.1).min(STRETCHED_NEAR_MAX)
        } else {
            STRETCHED_MAX
        };
        // an agent that waits for peers is behind because of them: longer steps would not help
        let waits = self.waits_often(wall);
        let next = if lag > times(now, LAG_CAP_STEPS, 1) && !waits {
            times(now, 5, 4).min(most).max(wanted)
        } else if lag <= now {
            times(now, 63, 64)
        } else {
            now
        };
        self.stretched = u32::try_from(next.as_nanos()).unwrap_or(0);
        next.max(wanted)
    }

    /// Accounts for the wait that ends at wall time `wall`.
    fn count_wait(&mut self, wall: Duration) {
        let until_ms = std::mem::take(&mut self.held_until_ms);
        if until_ms > 0 {
            let since = Duration::from_millis(u64::from(until_ms.saturating_sub(WAIT_MS)));
            let waited = u16::try_from(ticks(wall.saturating_sub(since))).unwrap_or(u16::MAX);
            self.waits[0] = self.waits[0].saturating_add(waited);
        }
    }

    /// Whether it has lately spent much of its time waiting; called once per step.
    fn waits_often(&mut self, wall: Duration) -> bool {
        let (now, [waited, of]) = (ticks(wall), self.waits);
        let of = of.saturating_add(u16::try_from(now.wrapping_sub(self.begun)).unwrap_or(u16::MAX));
        (self.begun, self.waits) = (now, [waited, of].map(|ticks| ticks - ticks / 8));
        waited > of / WAIT_SHARE
    }

    /// The step is done: advances the agent's time by it.
    pub fn advance(&mut self) {
        self.advance_by(self.dt());
    }

    /// A step of `span` is done, whatever was requested.
    pub fn advance_by(&mut self, span: SimSpan) {
        self.time += span;
    }

    /// Drops the time that this agent's leader has dropped, of which its time jumped by `leapt`.
    pub fn drop_time(&mut self, dropped: SimSpan, leapt: SimSpan) {
        self.dropped += dropped;
        self.time += leapt;
        self.clock_offset += dropped - leapt;
    }

    /// Takes the leader's total postponement `clock_offset`: the increase counts as dropped.
    pub fn follow_clock_offset(&mut self, clock_offset: SimSpan) {
        self.dropped = self.dropped + clock_offset - self.clock_offset;
        self.clock_offset = clock_offset;
    }

    /// Redefines its own time so that its total postponement is `clock_offset`; returns by how many seconds its own time is later.
    pub fn set_clock_offset(&mut self, clock_offset: SimSpan) -> f64 {
        let (moment, before) = (self.scene_time(), self.time);
        (self.time, self.clock_offset) = (moment - clock_offset, clock_offset);
        self.time.secs_after(before)
    }

    /// Goes on by a clock that reads `wall` now: no wait for peers goes on.
    pub fn rebase(&mut self, wall: Duration) {
        (self.held_until_ms, self.begun) = (0, ticks(wall));
    }

    /// The agent wakes at the scene time `now`: its time skips the sleep.
    pub fn wake(&mut self, now: SimTime) {
        let slept = now.since(self.scene_time());
        self.rested += slept;
        self.time += slept;
    }
}

/// Wall time in ticks, which wraps around after some days.
const fn ticks(wall: Duration) -> u32 {
    (wall.as_nanos() / TICK.as_nanos()) as u32
}

#[cfg(test)]
mod tests;
