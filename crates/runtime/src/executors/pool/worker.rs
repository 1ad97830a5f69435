//! One worker of a pool: makes one due turn after the other.
//!
//! In: the pool's shared state, a place in it. Out: turns. Between two turns it serves notifications, and sleeps if no turn is due: it waits for
//! no lock except its own queue's, and its only system call is to sleep. Never here: the choice of the next turn.

use super::shared::PoolState;
use crate::cluster::hand_over;
use crate::records::turns::Took;
use crate::time::agent_clock::Timeline;
use crate::time::cpu::CpuShare;
use crate::turn::agent_runner::{AgentRunner, Next};
use crate::turn::turn_order::{PartKind, TurnOrder, in_force};
use crate::turn::turn_parts::Begun;
use crate::turn::watchdog::{Watchdog, WatchdogWord};
use metachron_core::AgentId;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

/// After this long without sleep a worker yields its core for a moment, above all to the frame loop.
const AWAKE_MAX: Duration = Duration::from_millis(1);

/// An agent that is behind keeps its worker for this long: twenty cheap turns. Ten thousand such periods on two cores last as long as the
/// lag cap: longer ones would make states old.
const CATCH_UP_MAX: Duration = Duration::from_micros(20);

/// Turns between two checks whether agents of other workers are served worse than its own.
const BALANCE_TURNS: u32 = 64;

/// A worker and its state.
pub(super) struct Worker {
    state: Arc<PoolState>,
    at: usize,
    word: Arc<WatchdogWord>,
    watchdog: Watchdog,
    cpu: CpuShare,
    turns: u32,
    timeline: Timeline,
    /// The last reading of the clock.
    now: Duration,
    awake_since: Duration,
    /// Another one works in its place: a turn of its has lasted too long.
    is_replaced: bool,
    order: Option<Arc<TurnOrder>>,
    /// The agent of the last turn, if it waits for another one.
    last: Option<Box<AgentRunner>>,
}

impl Worker {
    pub fn new(state: Arc<PoolState>, at: usize, word: Arc<WatchdogWord>, watchdog: Watchdog) -> Self {
        let (now, timeline, order) = (state.clock.now(), state.timeline.read(), state.order());
        let (cpu, awake_since) = (CpuShare::new(), now);
        Self {
            state,
            at,
            word,
            watchdog,
            cpu,
            turns: 0,
            timeline,
            now,
            awake_since,
            is_replaced: false,
            order,
            last: None,
        }
    }

    /// Works until the run is to end, or until another one works in its place.
    pub fn work(mut self) {
        self.state.sleep.wakeup().inspect(|wakeup| wakeup.register(self.at));
        while !self.state.sleep.stopping() && !self.is_replaced {
            self.round();
        }
        self.last.take().into_iter().for_each(|actor| self.state.put(self.at, actor, self.now));
        self.word.leave();
    }

    /// Makes the next turn, or sleeps until one is due.
    fn round(&mut self) {
        self.state.timeline.renew(&mut self.timeline);
        let timeline = self.timeline;
        self.serve_notified(&timeline);
        match self.state.next_turn(self.at, self.last.take(), &timeline, self.now) {
            Some(actor) => self.last = self.catch_up(actor, &timeline),
            None => self.sleep(),
        }
        self.balance_and_yield(&timeline);
    }

    /// Makes turns of `actor` for as long as it is behind, but for [`CATCH_UP_MAX`] at most; returns it if it waits for another one.
    ///
    /// If all agents are behind, the data of one are still in the cache for its second turn, but no longer after the turns of all others.
    fn catch_up(&mut self, mut actor: Box<AgentRunner>, timeline: &Timeline) -> Option<Box<AgentRunner>> {
        let until = self.now + CATCH_UP_MAX;
        actor.fetch();
        let mut waiting = self.turn(actor, timeline);
        while self.now < until && !self.is_replaced {
            let now = self.now;
            let is_behind = |actor: &mut Box<AgentRunner>| actor.pace.due(timeline).is_some_and(|due| due <= now);
            let Some(actor) = waiting.take_if(is_behind) else { break };
            waiting = self.turn(actor, timeline);
        }
        waiting
    }

    /// Makes a turn of `actor`; returns it if it waits for another one.
    fn turn(&mut self, mut actor: Box<AgentRunner>, timeline: &Timeline) -> Option<Box<AgentRunner>> {
        self.cpu.open();
        self.turns = self.turns.wrapping_add(1);
        let began = self.now;
        let watched = self.word.begin(self.turns, actor.id());
        let order = in_force(&mut self.order);
        let held = order.as_deref().map(TurnOrder::hold);
        // a part uses the piece that is in force when its place in the order comes
        let timeline = &held.as_ref().map_or(*timeline, |_| self.state.timeline.read());
        let Begun { effort, mut held } = actor.begin_in(timeline, began, held);
        if !self.word.end(watched) {
            self.is_replaced = true;
            self.watchdog.resume(actor.id());
        }
        if actor.open.is_some() {
            actor.served += actor.pace.dt();
        }
        // the clock is read once per turn: the time after the step counts for the next one
        self.now = self.state.clock.now();
        let wall = self.now.saturating_sub(began);
        held.iter_mut().for_each(|held| held.note_end(self.now));
        let next = match effort {
            None => Next::Parked,
            Some(_) => actor.finish(timeline, Took { begun: began, ended: self.now }, wall.as_secs_f64()),
        };
        actor.count(wall);
        actor.settle(self.cpu.count(wall));
        if let (Next::Join(_), Some(held)) = (next, &mut held) {
            held.note(PartKind::Join, actor.id(), self.now);
        }
        if let Next::Join(leader) = next {
            return hand_over(actor, leader).err();
        }
        drop(held);
        match next {
            Next::Due | Next::Join(_) => Some(actor),
            Next::Rest => self.store_resting(actor, timeline),
            Next::Parked => {
                self.state.store_parked(actor);
                None
            }
        }
    }

    /// Serves the notified agents.
    fn serve_notified(&mut self, timeline: &Timeline) {
        let Some(wakeup) = self.state.sleep.wakeup().filter(|wakeup| wakeup.is_notified()) else { return };
        self.now = self.state.clock.now();
        if wakeup.take_notified(|id| self.serve(id, timeline)) > 1 {
            // several agents may be too much for one worker: wake another
            wakeup.wake_one();
        }
    }

    fn serve(&self, id: AgentId, timeline: &Timeline) {
        let woken = self.state.take_resting(id).and_then(|actor| self.wake(actor, timeline));
        let returned = self.state.take_returned(id).and_then(|actor| {
            if actor.is_parked() {
                self.state.store_parked(actor);
                return None;
            }
            Some(actor)
        });
        woken.into_iter().chain(returned).for_each(|actor| self.state.put(self.at, actor, self.now));
    }

    /// Stores `actor` at rest, unless it was woken: then returns it to wait for a turn.
    fn store_resting(&self, actor: Box<AgentRunner>, timeline: &Timeline) -> Option<Box<AgentRunner>> {
        self.state.store_resting(actor).and_then(|actor| self.wake(actor, timeline))
    }

    /// Wakes `actor` if it was woken by a caller; else stores it at rest again.
    fn wake(&self, mut actor: Box<AgentRunner>, timeline: &Timeline) -> Option<Box<AgentRunner>> {
        loop {
            let mut held = self.order.as_deref().map(TurnOrder::hold);
            let timeline = &held.as_ref().map_or(*timeline, |_| self.state.timeline.read());
            if actor.try_wake(timeline, self.now) {
                held.iter_mut().for_each(|held| held.note(PartKind::Wake, actor.id(), self.now));
                return Some(actor);
            }
            drop(held);
            actor = self.state.store_resting(actor)?;
        }
    }

    fn sleep(&mut self) {
        let span = self.state.pause(self.at, self.now);
        self.state.sleep.wakeup().inspect(|wakeup| wakeup.sleep(self.at, span));
        self.now = self.state.clock.now();
        self.awake_since = self.now;
    }

    /// Periodic work of a worker while it has turns to make.
    fn balance_and_yield(&mut self, timeline: &Timeline) {
        if self.turns.is_multiple_of(BALANCE_TURNS) {
            self.state.balance(self.at, timeline, self.now);
        }
        if self.now.saturating_sub(self.awake_since) >= AWAKE_MAX {
            thread::yield_now();
            self.now = self.state.clock.now();
            self.awake_since = self.now;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::testing::Dummy;
    use super::*;
    use crate::agent::agents::RunAgents;
    use crate::agent::spawn::{AssembledRun, assemble};
    use crate::time::agent_clock::TimelineCommand;
    use crate::turn::helpers::Helpers;
    use crate::turn::watchdog::StallLimit;
    use crate::{Clock, ManualClock};

    fn worker(spawns: Vec<crate::AgentSpawn>, clock: &Arc<ManualClock>) -> Worker {
        let AssembledRun { actors, all: RunAgents { handles, sleep, .. } } = assemble(spawns, Helpers::none()).unwrap();
        sleep.set_workers(1);
        let clock = Arc::clone(clock) as Arc<dyn Clock>;
        let watchdog = Watchdog::new(&handles, StallLimit::default());
        let state = Arc::new(PoolState::new(clock, sleep, handles, actors, 1));
        state.timeline.drive(Duration::ZERO, TimelineCommand::Run);
        Worker::new(state, 0, Arc::default(), watchdog)
    }

    /// Increase of the allocated heap, in bytes.
    fn held<T>(make: impl FnOnce() -> T) -> (T, i64) {
        let mut made = None;
        let measured = allocation_counter::measure(|| made = Some(make()));
        (made.unwrap(), measured.bytes_current)
    }

    #[test]
    fn an_agent_takes_two_kilobytes_beyond_its_physics_and_its_states() {
        const COUNT: u32 = 2000;
        let clock = Arc::new(ManualClock::new());
        // an agent that can be touched also stores the agents near it
        for (radius_m, most) in [(None, 2048), (Some(0.1), 2560)] {
            let dummy = |k: u32| Dummy { ball: radius_m.map(|r| (r, 0.0)), z: f64::from(k), ..Dummy::new(1.0) };
            let (_physics, own) = held(|| (0..COUNT).map(|k| Box::new(dummy(k))).collect::<Vec<_>>());
            let (_states, state) =
                held(|| (0..COUNT).map(|_| Arc::new(metachron_core::Snapshot::default())).collect::<Vec<_>>());
            let (_worker, all) = held(|| {
                let mut worker = worker((0..COUNT).map(|k| dummy(k).at(100.0)).collect(), &clock);
                for _ in 0..5 * COUNT {
                    clock.advance(Duration::from_micros(5));
                    worker.now = clock.now();
                    worker.round();
                }
                worker
            });
            // one state is published, one is written
            let each = (all - own - 2 * state) / i64::from(COUNT);
            assert!(each <= most, "{each} bytes, and {} a state", state / i64::from(COUNT));
        }
    }

    #[test]
    fn a_worker_with_only_sleeping_agents_sleeps_without_a_timeout() {
        let clock = Arc::new(ManualClock::new());
        let sleepy = |_| Dummy { rest_from: Some(1), ..Dummy::new(1.0) }.at(100.0);
        let mut worker = worker((0..1000).map(sleepy).collect(), &clock);
        for _ in 0..1000 {
            let timeline = worker.state.timeline.read();
            let actor = worker.state.next_turn(0, worker.last.take(), &timeline, worker.now).unwrap();
            worker.last = worker.turn(actor, &timeline);
        }
        assert!(worker.last.is_none());
        assert_eq!(worker.state.pause(0, worker.now), None, "no agent is due");
        assert!(worker.state.handles.iter().all(|agent| agent.state() == crate::AgentState::Resting));
    }

    #[test]
    fn a_steady_turn_allocates_nothing() {
        let clock = Arc::new(ManualClock::new());
        let mut worker = worker((0..50).map(|k| Dummy::new(1.0).at(200.0 + f64::from(k))).collect(), &clock);
        let mut rounds = |count: u32| {
            for _ in 0..count {
                // 50 agents of 225 Hz: a turn every 89 µs, and sometimes none
                clock.advance(Duration::from_micros(80));
                worker.now = clock.now();
                worker.round();
            }
        };
        let warm_up = allocation_counter::measure(|| rounds(20_000));
        assert!(warm_up.count_total > 0, "the counter counts");
        let steady = allocation_counter::measure(|| rounds(50_000));
        assert_eq!(steady.count_total, 0, "{steady:?}");
        let steps: u64 = worker.state.handles.iter().map(|agent| agent.steps()).sum();
        // 5.6 s of simulated time
        assert!((62_000..64_000).contains(&steps), "{steps}");
    }
}
