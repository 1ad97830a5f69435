//! Queue of one worker: its agents between their turns, ordered by urgency.
//!
//! In: agents. Out: the most urgent one whose step has been released ([`crate::time::agent_clock`]), earliest deadline first.
//! Under overload deadlines alone would be unfair: an agent past its lag cap drops time, and with it its rank. So deadlines are counted in
//! *served* time: how much simulated time the workers have given the agent, whatever it dropped. While all agents keep up, that is the
//! agent's own time; when they cannot, all fall behind alike, each at the same share of its rate, and none starves. An agent that returns
//! from a rest, or falls behind for reasons of its own, continues from the present served time: it accumulates no credit (start-time fair
//! queueing, (GVC97)). A sleeping worker may sleep a little past a release, by an eighth of the agent's step: then several turns share one
//! wake-up, which costs more than ten cheap turns. Never here: threads, sleeping, turns.

use crate::time::agent_clock::Timeline;
use crate::turn::agent_runner::AgentRunner;
use metachron_core::{SimSpan, SimTime};
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::time::Duration;

/// A time that is never reached, in nanoseconds.
pub(super) const NEVER: u64 = u64::MAX;

/// A turn may begin 1/`SLACK` of its step after its release, if its worker sleeps until then.
const SLACK: u64 = 8;

/// But at most this many nanoseconds after it: of evenly spread turns in a batch, half are late by less than half of it.
const SLACK_MOST: u64 = 1_000_000;

/// Agents waiting for their turns.
#[derive(Default)]
pub(super) struct Queue {
    timeline: Timeline,
    /// By the latest wall time at which their turns are to begin.
    waiting: BinaryHeap<Place<Waiter>>,
    /// By deadline.
    ready: BinaryHeap<Place<Released>>,
    /// The latest served time of the agents taken so far.
    served: SimTime,
    /// Wall time since which an agent has been ready, nanoseconds.
    ready_since: u64,
}

/// Heap entry with its rank: the least comes first. All keys are stored next to the rank, since a waiting agent itself is not in any cache.
struct Place<T> {
    rank: u64,
    of: T,
}

/// An agent whose step is released, and its served time at its arrival.
struct Released {
    served: SimTime,
    actor: Box<AgentRunner>,
}

/// An agent whose step will be released.
struct Waiter {
    /// Wall time of the release, nanoseconds.
    release: u64,
    /// Its rank from then on.
    deadline: u64,
    then: Released,
}

impl Queue {
    /// Switches to `timeline`, if it is newer than the present one.
    pub fn set_timeline(&mut self, timeline: &Timeline, now: Duration) {
        if timeline.piece() <= self.timeline.piece() {
            return;
        }
        self.timeline = *timeline;
        let all: Vec<_> = self.drain().collect();
        all.into_iter().for_each(|actor| self.put_back(actor, now));
    }

    /// Adds `actor`, which comes from outside the queue, to wait for its next turn.
    pub fn put(&mut self, mut actor: Box<AgentRunner>, now: Duration) {
        actor.owed = SimSpan::ZERO;
        self.put_back(actor, now);
    }

    /// Adds `actor`, whose turn was just made, to wait for its next one.
    pub fn put_back(&mut self, mut actor: Box<AgentRunner>, now: Duration) {
        actor.served = actor.served.max(self.served - actor.owed);
        actor.owed = actor.owed.min(self.served.since(actor.served));
        let (due, dt) = (actor.pace.due(&self.timeline), actor.pace.dt());
        let deadline = (actor.served + dt).as_nanos();
        let then = Released { served: actor.served, actor };
        match due {
            Some(due) if due <= now => self.make_ready(deadline, then, now),
            due => {
                let release = due.map_or(NEVER, nanos);
                let slack = nanos(self.timeline.wall_span(dt)) / SLACK;
                let rank = release.saturating_add(slack.min(SLACK_MOST));
                self.waiting.push(Place { rank, of: Waiter { release, deadline, then } });
            }
        }
    }

    /// The most urgent agent whose step is released at `now`; the caller adds the step to its served time.
    pub fn take(&mut self, now: Duration) -> Option<Box<AgentRunner>> {
        self.release(now);
        let Released { served, actor } = self.ready.pop()?.of;
        self.served = self.served.max(served);
        Some(actor)
    }

    /// Moves a ready agent to another worker's queue, `other`, with its claim to service unchanged.
    pub fn give_ready(&mut self, other: &mut Self, now: Duration) -> bool {
        let Some(Place { rank, of: mut given }) = self.ready.pop() else { return false };
        // service that it lacks relative to the new queue is owed to it there
        given.actor.owed = other.served.since(given.served);
        other.make_ready(rank, given, now);
        true
    }

    /// The latest wall time, in nanoseconds, at which a turn is to begin, or since which one has been ready; [`NEVER`] if there is none.
    pub fn due(&self) -> u64 {
        if self.ready.is_empty() { self.waiting.peek().map_or(NEVER, |place| place.rank) } else { self.ready_since }
    }

    /// Served time of the most urgent ready agent, nanoseconds; [`NEVER`] if none is ready.
    pub fn frontier(&self) -> u64 {
        self.ready.peek().map_or(NEVER, |place| place.of.served.as_nanos())
    }

    /// All remaining agents, at the end of a run.
    pub fn drain(&mut self) -> impl Iterator<Item = Box<AgentRunner>> {
        let waiting = self.waiting.drain().map(|place| place.of.then);
        waiting.chain(self.ready.drain().map(|place| place.of)).map(|released| released.actor)
    }

    fn release(&mut self, now: Duration) {
        let until = nanos(now);
        while self.waiting.peek().is_some_and(|place| place.of.release <= until && place.of.release != NEVER) {
            if let Some(Place { of: Waiter { deadline, then, .. }, .. }) = self.waiting.pop() {
                self.make_ready(deadline, then, now);
            }
        }
    }

    fn make_ready(&mut self, deadline: u64, released: Released, now: Duration) {
        if self.ready.is_empty() {
            self.ready_since = nanos(now);
        }
        self.ready.push(Place { rank: deadline, of: released });
    }
}

/// `span` as a rank.
fn nanos(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap_or(NEVER)
}

impl<T> PartialEq for Place<T> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<T> Eq for Place<T> {}

impl<T> PartialOrd for Place<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T> Ord for Place<T> {
    /// Reversed, since the standard library's heap returns the greatest first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.rank.cmp(&self.rank)
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::testing::Dummy;
    use super::*;
    use crate::agent::agent_spawn::AgentSpawn;
    use crate::agent::spawn::assemble;
    use crate::time::agent_clock::TimelineCommand;
    use crate::turn::helpers::Helpers;

    const COST: Duration = Duration::from_micros(1000);

    fn queue(spawns: Vec<AgentSpawn>) -> Queue {
        let mut queue = Queue::default();
        let actors = assemble(spawns, Helpers::none()).unwrap().actors.into_iter().flatten();
        actors.for_each(|actor| queue.put(actor, Duration::ZERO));
        queue
    }

    /// The most urgent agent, with the step for which it is taken added to its served time.
    fn take(queue: &mut Queue, now: Duration) -> Option<Box<AgentRunner>> {
        let mut actor = queue.take(now)?;
        actor.served += actor.pace.dt();
        Some(actor)
    }

    /// Makes turns of [`COST`] each on one worker until `end`, and calls `made` for each.
    fn work(queue: &mut Queue, mut now: Duration, end: Duration, mut made: impl FnMut(usize)) {
        let line = Timeline::new();
        while now < end {
            let Some(mut actor) = take(queue, now) else {
                now = Duration::from_nanos(queue.due());
                continue;
            };
            made(actor.id().0 as usize);
            actor.pace.begin(&line, now, false);
            now += COST;
            actor.pace.advance();
            queue.put(actor, now);
        }
    }

    fn turns<const N: usize>(queue: &mut Queue, seconds: u64) -> [u32; N] {
        let mut counts = [0; N];
        work(queue, Duration::ZERO, Duration::from_secs(seconds), |id| counts[id] += 1);
        counts
    }

    #[test]
    fn without_overload_every_agent_keeps_its_rate_and_short_deadlines_go_first() {
        // 100 + 50 + 4 · 10 turns of 1 ms a second: a load of 0.19
        let rates = [100.0, 50.0, 10.0, 10.0, 10.0, 10.0];
        let mut queue = queue(rates.map(|hz| Dummy::new(1.0).at(hz)).into());
        let counts: [u32; 6] = turns(&mut queue, 10);
        for (count, hz) in counts.iter().zip(rates) {
            assert!((f64::from(*count) - 10.0 * hz).abs() <= 1.0, "{count} at {hz} Hz");
        }
    }

    #[test]
    fn a_sleep_may_end_an_eighth_of_a_step_late_and_then_all_that_are_released_are_taken() {
        let mut queue = queue([100.0, 1000.0, 100.0].map(|hz| Dummy::new(1.0).at(hz)).into());
        let line = Timeline::new();
        let turns = |queue: &mut Queue, now: Duration| {
            let mut made = Vec::new();
            while let Some(mut actor) = take(queue, now) {
                made.push(actor.id().0);
                actor.pace.begin(&line, now, false);
                actor.pace.advance();
                queue.put_back(actor, now);
            }
            made
        };
        assert_eq!(turns(&mut queue, Duration::ZERO)[0], 1, "the earliest deadline");
        assert_eq!(queue.due(), 1_125_000, "1 ms and an eighth");
        for ms in 1..10 {
            assert_eq!(turns(&mut queue, Duration::from_millis(ms)), [1]);
        }
        // the slow agents could wait for another millisecond
        assert_eq!(queue.due(), 10_125_000);
        assert_eq!(turns(&mut queue, Duration::from_millis(10)).len(), 3);
    }

    #[test]
    fn under_overload_each_falls_to_the_same_share_of_its_rate() {
        for (rates, share) in [([400.0, 800.0, 200.0, 600.0], 0.5), ([100_000.0, 1000.0, 5000.0, 94_000.0], 0.005)] {
            let mut queue = queue(rates.map(|hz| Dummy::new(1.0).at(hz)).into());
            let counts: [u32; 4] = turns(&mut queue, 20);
            for (count, hz) in counts.iter().zip(rates) {
                let wanted = 20.0 * hz * share;
                // one turn at either end, and the rounding to whole turns
                assert!((f64::from(*count) - wanted).abs() <= 2.0 + 0.01 * wanted, "{count} of {wanted} at {hz} Hz");
            }
        }
    }

    #[test]
    fn an_absent_agent_accumulates_no_claim() {
        let mut queue = queue([1000.0; 3].map(|hz| Dummy::new(1.0).at(hz)).into());
        let away = take(&mut queue, Duration::ZERO).unwrap();
        let (came_back, end) = (Duration::from_secs(4), Duration::from_secs(6));
        work(&mut queue, Duration::ZERO, came_back, |_| ());
        queue.put(away, came_back);
        let mut counts = [0; 3];
        work(&mut queue, came_back, end, |id| counts[id] += 1);
        // 2000 turns for three agents
        assert!(counts.iter().all(|count| (660..=673).contains(count)), "{counts:?}");
    }

    #[test]
    fn a_stopped_timeline_releases_no_agent_and_a_running_one_all() {
        let mut queue = queue(vec![Dummy::new(1.0).at(100.0), Dummy::new(1.0).at(10.0)]);
        let paused = Timeline::new().after(Duration::ZERO, TimelineCommand::Pause);
        queue.set_timeline(&paused, Duration::ZERO);
        assert!(queue.take(Duration::from_secs(9)).is_none());
        assert_eq!((queue.due(), queue.frontier()), (NEVER, NEVER));
        let running = paused.after(Duration::from_secs(9), TimelineCommand::Run);
        queue.set_timeline(&running, Duration::from_secs(9));
        assert_eq!(queue.take(Duration::from_secs(9)).unwrap().id().0, 0, "the earlier deadline");
        assert_eq!(queue.take(Duration::from_secs(9)).unwrap().id().0, 1);
    }

    #[test]
    fn rights_move_with_the_agent_that_another_worker_takes() {
        let mut mine = queue([1000.0; 4].map(|hz| Dummy::new(1.0).at(hz)).into());
        let mut theirs = Queue::default();
        let taken = take(&mut mine, Duration::ZERO).unwrap();
        assert!(mine.give_ready(&mut theirs, COST));
        assert_eq!(theirs.due(), 1_000_000);
        assert_eq!((theirs.frontier(), mine.frontier()), (0, 0));
        assert_eq!(taken.served, SimTime::from_nanos(1_000_000));
        assert_eq!((mine.drain().count(), theirs.drain().count()), (2, 1));
    }

    #[test]
    fn an_agent_served_worse_is_compensated_by_its_new_worker() {
        // two agents with steps of 1 ms in a queue served up to 100 ms, and one from a queue served up to 70 ms
        let mut theirs = queue([1000.0; 2].map(|hz| Dummy::new(1.0).at(hz)).into());
        let mut mine = queue([1000.0; 3].map(|hz| Dummy::new(1.0).at(hz)).into());
        let late = Duration::from_secs(1);
        work(&mut theirs, Duration::ZERO, Duration::from_millis(200), |_| ());
        work(&mut mine, Duration::ZERO, Duration::from_millis(210), |_| ());
        assert!(mine.give_ready(&mut theirs, late));
        let mut turns = 0;
        loop {
            let actor = take(&mut theirs, late).unwrap();
            let is_owed = actor.owed > SimSpan::ZERO;
            theirs.put_back(actor, late);
            if !is_owed {
                break;
            }
            turns += 1;
        }
        assert!((27..=31).contains(&turns), "{turns} turns before the others'");
    }
}
