//! Agents that share one world for a while: one of them, the leader, makes the turns of all.
//!
//! In: agents that hand themselves over ([`seats`]), one world that steps them ([`metachron_contact::Agent::step_island`]).
//! Out: every one's own states, account and ear, as if it made its turns itself: nobody else notices. One turn of a leader:
//!
//! take in    who waits at the door
//! gather     each to the leader's time: who is behind steps alone and shows what it gave, who is ahead waits
//! lead       all that are at one time step as one; where that fails, each goes its own way, to fail alone or not at all
//! write, conclude    every one's state by its own writer
//! part       who has lost touch goes home; several that still belong together go as one, led by the lowest number
//!
//! The leader has the lowest number. Never here: who touches whom, threads, events.

mod seats;

pub(super) use seats::{Company, Seating, assign, empty_door, empty_rooms, move_in};

use super::agent_clock::Start;
use super::agent_clock::Timeline;
use super::agent_runner::{AgentRunner, PendingTurn, StepOutcome, contained};
use super::broad_phase::PlannedStep;
use super::cluster::Span;
use super::fellows::Fellows;
use super::metrics::Entry;
use metachron_contact::{IslandMember, StepContext};
use metachron_core::{DT_MAX_S, SimSpan, SimTime, StepReport};
use std::time::Duration;

impl AgentRunner {
    /// Brings those it leads to its own time; how many steps that took. A leader that gave up time gave it up for all at that
    /// time.
    pub fn gather(&mut self, timeline: &Timeline, wall: Duration, (start, leapt): (&Start, SimSpan)) -> u32 {
        if self.company.is_empty() {
            return 0;
        }
        let (time, clock_offset, mut steps) = (self.pace.time(), self.pace.clock_offset(), 0);
        self.company.each(|seat| {
            let caught_up = contained(|| {
                seat.shared.sleep.clear_wake(seat.id());
                seat.take_commands();
                if seat.pace.time() == time - leapt {
                    seat.pace.drop_time(start.dropped, leapt);
                    seat.pace.follow_clock_offset(clock_offset);
                    return Ok(0);
                }
                seat.pace.follow_clock_offset(clock_offset);
                seat.catch_up(time, timeline, wall)
            });
            match caught_up {
                Ok(made) => steps += made,
                Err(reason) => seat.park(reason),
            }
        });
        self.company.dismiss_parked();
        steps
    }

    /// Steps alone up to `time`; how many steps that took.
    fn catch_up(&mut self, time: SimTime, timeline: &Timeline, wall: Duration) -> Result<u32, String> {
        let mut steps = 0;
        while self.pace.time() < time {
            let span = portion(time.since(self.pace.time()), self.pace.dt());
            let StepOutcome { dt, .. } =
                if self.cluster.is_some() { self.step_cluster(Span::AtMost(span))? } else { self.step(span)? };
            self.write_snapshot(self.pace.time() + dt, false)?;
            self.pace.advance_by(dt);
            let work_s = self.shared.gauges.work_s.get();
            let entry = Entry { now: timeline.sim_at(wall), late: Duration::ZERO, missed: false, work_s };
            self.metrics.write(&self.shared.gauges, &self.pace, entry);
            steps += 1;
        }
        if steps > 0 {
            // what it has given on the way is settled before the first common step
            self.publish(timeline.sim_at(wall));
        }
        Ok(steps)
    }

    /// Steps as one with those it leads that are at its time: the report, and how many those are.
    ///
    /// An error leaves all as they were: they part, and this agent steps alone. After a panic nobody knows how they are: it is
    /// this agent's, and the others go on from where the next step finds them.
    pub fn lead(&mut self, dt: SimSpan) -> Result<(StepOutcome, u32), String> {
        let time = self.pace.time();
        let led = self.company.at(time).count() as u32;
        if led == 0 {
            return Ok((self.step(dt)?, 0));
        }
        match self.step_as_one(dt) {
            Ok(StepOutcome { report, dt }) => {
                let report = StepReport { work: report.work / f64::from(1 + led), ..report };
                Ok((StepOutcome { report, dt }, led))
            }
            Err(_) => {
                self.scatter();
                Ok((self.step(dt)?, 0))
            }
        }
    }

    fn step_as_one(&mut self, dt: SimSpan) -> Result<StepOutcome, String> {
        let (me, time) = (self.shared.id, self.pace.time());
        self.company.gather_fellows(me, time);
        let Self { agent, observer, hands, links, company, peers, writer, pace, .. } = self;
        observer.update(peers, writer, PlannedStep { start: pace.scene_time(), dt }, &company.fellows);
        let around = StepContext { me, time, neighbours: observer.neighbours(), hands, links };
        let mut others = emptied(std::mem::take(&mut company.companions));
        for seat in company.seats.iter_mut().filter(|seat| seat.actor.pace.time() == time) {
            others.push(seat.actor.companion((time, dt), &company.fellows));
        }
        company.apart.clear();
        // nobody's step is longer than any of them may make
        let own = agent.longest_step(dt, &around).min(dt);
        let dt = others.iter().map(|c| c.agent.longest_step(dt, &c.context)).fold(own, SimSpan::min);
        let report = agent.step_island(dt, &around, &mut others, &mut company.apart).map_err(|e| e.to_string());
        company.companions = emptied(others);
        company.note_apart(time);
        report.map(|report| StepOutcome { report, dt })
    }

    /// This agent, as one who leads it wants it.
    fn companion(&mut self, (time, dt): (SimTime, SimSpan), fellows: &Fellows) -> IslandMember<'_> {
        let id = self.shared.id;
        self.observer.update(&self.peers, &self.writer, PlannedStep { start: self.pace.scene_time(), dt }, fellows);
        let neighbours = self.observer.neighbours();
        let around = StepContext { me: id, time, neighbours, hands: &self.hands, links: &self.links };
        IslandMember { id, agent: &mut *self.agent, context: around }
    }

    /// Whether nothing keeps it from resting, nor any of those it leads.
    pub fn may_rest(&self, now: SimTime) -> bool {
        let time = self.pace.time();
        self.is_undisturbed(now)
            && self.company.seats.iter().all(|s| s.actor.pace.time() == time && s.actor.is_undisturbed(now))
    }

    /// Writes the states of those that have just stepped with it. One that is broken is parked alone.
    pub fn write_led(&mut self, open: &PendingTurn) {
        if self.company.is_empty() {
            return;
        }
        let time = self.pace.time();
        self.company.each(|seat| {
            if seat.pace.time() != time {
                return;
            }
            seat.pace.shorten(seat.pace.wanted(), open.dt);
            match contained(|| seat.write_snapshot(time + open.dt, open.rests)) {
                Ok(()) => {
                    seat.pace.advance_by(open.dt);
                    seat.open = Some(*open);
                }
                Err(reason) => seat.park(reason),
            }
        });
        self.company.dismiss_parked();
    }

    /// Accounts for the steps of those that stepped with it and shows their states; whether all can be seen.
    pub fn conclude_led(&mut self, now: SimTime, work_s: f64) -> bool {
        let share_s = work_s / (1 + self.company.len()) as f64;
        let mut published = true;
        self.company.each(|seat| {
            if let Some(open) = seat.open.take() {
                published &= seat.record_step(&open, now, share_s);
            }
        });
        published
    }
}

/// How much of what is `left` to catch up one step takes, where steps are `dt` long: no step is a sliver.
fn portion(left: SimSpan, dt: SimSpan) -> SimSpan {
    let half_more = SimSpan::from_nanos(dt.as_nanos() / 2);
    let longest = SimSpan::from_secs_f64(DT_MAX_S).unwrap_or(dt);
    if left <= dt + half_more { left.min(longest) } else { dt }
}

/// The storage of `companions` for other ones.
fn emptied<'b>(mut companions: Vec<IslandMember<'_>>) -> Vec<IslandMember<'b>> {
    companions.clear();
    // nothing is left to be mapped; the standard library collects in place, so that the storage stays
    companions.into_iter().map(|_| unreachable!("cleared above")).collect()
}

#[cfg(test)]
mod tests;
