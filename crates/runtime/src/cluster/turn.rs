//! The turn of a leader: it steps all members of its cluster, and nobody else notices.
//!
//! In: agents that hand their turns over ([`super::handover`]). Out: the states, metrics and commands of each as if it made its turns itself.
//!
//! admit      agents that want to be led
//! gather     each to the leader's time: one that is behind steps alone, one that is ahead waits
//! step       all at one time as one problem ([`super::macro_step`]), or without failed members ([`super::exclusion`])
//! write, conclude    the state of each by its own writer
//! part       members that have lost touch go on alone; several that still belong together are led by the lowest number
//!
//! The leader has the lowest number. Never here: which agents touch, threads, events.

use super::Span;
use super::solve_budget::Solved;
use crate::records::metrics::Entry;
use crate::records::turns::Took;
use crate::time::agent_clock::{Start, Timeline};
use crate::turn::agent_runner::{AgentRunner, PendingTurn, StepOutcome};
use crate::turn::model::contained;
use metachron_contact::detect::SolveBudget;
use metachron_core::{DT_MAX_S, SimSpan, SimTime};
use std::time::Duration;

/// The share of a macro step that its turn may take; the rest is a margin for turns that take longer now and then.
const TURN_SHARE: f64 = 0.8;

/// How the time of a leader went on without a step when its turn began.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Leap<'a> {
    pub start: &'a Start,
    /// By how much its own time has jumped.
    pub jumped: SimSpan,
}

impl AgentRunner {
    /// Brings the agents that it leads to its own time; how many steps that took. A leader that gave up time gave it up
    /// for all at that time.
    pub fn gather(&mut self, timeline: &Timeline, wall: Duration, leap: Leap<'_>) -> u32 {
        if self.led.is_empty() {
            return 0;
        }
        let (time, clock_offset, mut steps) = (self.pace.time(), self.pace.clock_offset(), 0);
        self.led.each(|actor| {
            let caught_up = contained(|| {
                actor.shared.sleep.clear_wake(actor.id());
                actor.take_commands()?;
                if actor.pace.time() == time - leap.jumped {
                    actor.pace.drop_time(leap.start.dropped, leap.jumped);
                    actor.pace.follow_clock_offset(clock_offset);
                    return Ok(0);
                }
                actor.pace.follow_clock_offset(clock_offset);
                actor.catch_up(time, timeline, wall)
            });
            match caught_up {
                Ok(made) => steps += made,
                Err(reason) => actor.park(reason),
            }
        });
        self.led.release_parked();
        steps
    }

    /// Forgets the history of its contacts and of its members' on edges and triangles, where one of them has lost some:
    /// the remaining ones are numbered anew.
    pub fn forget_features(&mut self) {
        let Self { led, cluster, carved, .. } = self;
        let mut any = std::mem::take(carved);
        led.each(|actor| any |= std::mem::take(&mut actor.carved));
        if any {
            cluster.iter_mut().for_each(|member| member.forget_features());
            led.each(|actor| actor.cluster.iter_mut().for_each(|member| member.forget_features()));
        }
    }

    /// Steps alone up to `time`; how many steps that took.
    fn catch_up(&mut self, time: SimTime, timeline: &Timeline, wall: Duration) -> Result<u32, String> {
        let mut steps = 0;
        while self.pace.time() < time {
            let span = portion(time.since(self.pace.time()), self.pace.dt(), timeline.is_free());
            let StepOutcome { dt, .. } = self.step_alone(Span::AtMost(span), self.least_factors(timeline))?;
            self.write_snapshot(self.pace.time() + dt, false)?;
            self.pace.advance_by(dt);
            let work_s = self.shared.gauges.work_s.get();
            let entry = Entry {
                steps: self.own_steps(),
                span: dt,
                now: timeline.sim_at(wall),
                late: Duration::ZERO,
                missed: false,
                work_s,
            };
            self.metrics.write(&self.shared.gauges, &self.pace, entry);
            steps += 1;
        }
        if steps > 0 {
            // the impulses that it has given on the way are settled before the first common step
            self.publish(timeline.sim_at(wall));
        }
        Ok(steps)
    }

    /// Whether nothing keeps it from resting, nor any of the agents that it leads.
    pub fn may_rest(&self, now: SimTime) -> bool {
        let time = self.pace.time();
        self.is_undisturbed(now) && self.led.all().all(|actor| actor.pace.time() == time && actor.is_undisturbed(now))
    }

    /// Writes the states of the members that have just stepped with it. A broken member is parked alone.
    pub fn write_led(&mut self, open: &PendingTurn) {
        if self.led.is_empty() {
            return;
        }
        let time = self.pace.time();
        self.led.each(|actor| {
            if actor.pace.time() != time {
                return;
            }
            actor.pace.shorten(actor.pace.wanted(), open.dt);
            match contained(|| actor.write_snapshot(time + open.dt, open.rests)) {
                Ok(()) => {
                    actor.pace.advance_by(open.dt);
                    let (resolution, errors_m) = (actor.resolution(), actor.errors_m());
                    actor.open = Some(PendingTurn { resolution, errors_m, ..*open });
                }
                Err(reason) => actor.park(reason),
            }
        });
        self.led.release_parked();
    }

    /// The steps of its own within the last turn.
    pub fn own_steps(&self) -> u32 {
        self.cluster.as_ref().and_then(|member| member.state).map_or(1, |state| state.parts)
    }

    /// Shares the time of a turn out among itself and the members that stepped with it, by their work; its own share.
    /// Each governor answers for its agent alone: of the deformables in one cluster the one that is too fine gives way.
    pub fn share_work(&mut self, work_s: f64) -> f64 {
        let work = |actor: &Self| actor.cluster.as_ref().map_or(0.0, |member| member.work);
        let own = work(self);
        let all = own + self.led.all().filter(|actor| actor.open.is_some()).map(work).sum::<f64>();
        let share_s = |part: f64| if all > 0.0 { work_s * part / all } else { work_s };
        self.led.each(|actor| {
            let part = work(actor);
            if let Some(member) = &mut actor.cluster {
                member.work_s = share_s(part);
            }
        });
        share_s(own)
    }

    /// Accounts for the steps of the members that stepped with it, lets their governors answer and shows their states;
    /// whether all can be seen.
    pub fn conclude_led(&mut self, timeline: &Timeline, took: Took) -> bool {
        let (mut published, leader) = (true, self.id());
        self.led.each(|actor| {
            let Some(open) = actor.open.take() else { return };
            let work_s = actor.cluster.as_ref().map_or(0.0, |member| member.work_s);
            published &= actor.record_step(&open, timeline, took.ended, work_s);
            actor.record_turn(&open, leader, took);
            if let Err(reason) = contained(|| actor.run_governor(timeline, &open, work_s)) {
                actor.park(reason);
            }
        });
        self.led.release_parked();
        published
    }
}

/// How much of the time `left` to catch up one step takes, where steps are `dt` long: no step is a sliver. Where
/// `none_longer` is, the last two are half of it each.
fn portion(left: SimSpan, dt: SimSpan, none_longer: bool) -> SimSpan {
    let half_more = SimSpan::from_nanos(dt.as_nanos() / 2);
    if none_longer && left > dt && left <= dt + half_more {
        return SimSpan::from_nanos(left.as_nanos().div_ceil(2));
    }
    let longest = SimSpan::from_secs_f64(DT_MAX_S).unwrap_or(dt);
    if left <= dt + half_more { left.min(longest) } else { dt }
}

impl AgentRunner {
    /// How many steps each solve has time for in a macro step of `dt` that begins `late`; `None` for as many as the laws take.
    pub fn factors_within(&self, timeline: &Timeline, late: Duration, dt: SimSpan) -> Option<u32> {
        let least = self.least_factors(timeline)?;
        let turn_s = TURN_SHARE * timeline.wall_span(dt).as_secs_f64();
        self.cluster.as_ref()?.price.factors_max(turn_s, late.as_secs_f64(), least)
    }

    /// The steps that each solve may make in any case: all that one may that is behind its leader. `None` where nothing bounds them: at the free
    /// pace there is time for all.
    pub fn least_factors(&self, timeline: &Timeline) -> Option<u32> {
        match self.cluster.as_ref()?.scene.budget() {
            SolveBudget::Timed { least_steps } if !timeline.is_free() => Some(least_steps),
            _ => None,
        }
    }

    /// The solves of the turn in progress; `None` where it has made no macro step.
    pub fn solved(&self) -> Option<Solved> {
        self.cluster.as_ref()?.solved
    }

    /// Learns the price of a factor from the turn that `took` so long.
    pub fn note_price(&mut self, timeline: &Timeline, took: Took) {
        let Some(member) = &mut self.cluster else { return };
        if let Some(solved) = member.solved.take()
            && !timeline.is_free()
        {
            member.price.note(solved, took.ended.saturating_sub(took.begun).as_secs_f64());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_no_step_may_be_longer_what_is_left_is_caught_up_by_none_that_is() {
        let dt = SimSpan::from_nanos(1001);
        for total in 1..4000 {
            let (mut left, mut steps) = (SimSpan::from_nanos(total), 0);
            while left > SimSpan::ZERO {
                let span = portion(left, dt, true);
                assert!(span > SimSpan::ZERO && span <= dt.min(left), "{span:?} of {left:?}");
                left = SimSpan::from_nanos(left.as_nanos() - span.as_nanos());
                steps += 1;
            }
            assert_eq!(steps, total.div_ceil(1001), "no sliver of {total} ns");
        }
        assert_eq!(portion(SimSpan::from_nanos(1400), dt, false), SimSpan::from_nanos(1400));
    }
}
