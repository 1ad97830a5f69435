//! One worker of a pool: makes one due turn after the other.
//!
//! In: the pool's shared state, a place in it. Out: turns. Between two turns it serves summons, and sleeps if no turn is due: it waits for
//! no lock except its own queue's, and its only system call is to sleep. Never here: the choice of the next turn.

use super::super::agent_clock::Timeline;
use super::super::agent_runner::{AgentRunner, Next};
use super::super::cpu::CpuShare;
use super::super::island::move_in;
use super::shared::PoolState;
use super::watchdog::WatchdogWord;
use metachron_core::AgentId;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

/// After this long without sleep a worker yields its core for a moment, above all to the frame loop.
const SHIFT: Duration = Duration::from_millis(1);

/// An agent that is behind keeps its worker for this long: twenty cheap turns. Ten thousand such periods on two cores last as long as the
/// lag cap: longer ones would make states old.
const SPELL: Duration = Duration::from_micros(20);

/// Turns between two checks whether agents of other workers are served worse than its own.
const BALANCE_TURNS: u32 = 64;

/// A worker and its state.
pub(super) struct Worker {
    hall: Arc<PoolState>,
    at: usize,
    desk: Arc<WatchdogWord>,
    cpu: CpuShare,
    turns: u32,
    timeline: Timeline,
    /// The last reading of the clock.
    now: Duration,
    awake_since: Duration,
    given_up: bool,
    /// The agent of the last turn, if it waits for another one.
    last: Option<Box<AgentRunner>>,
}

impl Worker {
    pub fn new(hall: Arc<PoolState>, at: usize, desk: Arc<WatchdogWord>) -> Self {
        let (now, timeline) = (hall.clock.now(), hall.timeline.read());
        let cpu = CpuShare::new();
        Self { hall, at, desk, cpu, turns: 0, timeline, now, awake_since: now, given_up: false, last: None }
    }

    /// Works until the run is to end, or until the worker is given up.
    pub fn work(mut self) {
        self.hall.board.bell().inspect(|bell| bell.enter(self.at));
        while !self.hall.board.stopping() && !self.given_up {
            self.round();
        }
        self.last.take().into_iter().for_each(|actor| self.hall.put(self.at, actor, self.now));
    }

    /// Makes the next turn, or sleeps until one is due.
    fn round(&mut self) {
        self.hall.timeline.renew(&mut self.timeline);
        let timeline = self.timeline;
        self.answer(&timeline);
        match self.hall.exchange(self.at, self.last.take(), &timeline, self.now) {
            Some(actor) => self.last = self.spell(actor, &timeline),
            None => self.sleep(),
        }
        self.pause(&timeline);
    }

    /// Makes turns of `actor` for as long as it is behind, but for [`SPELL`] at most; returns it if it waits for another one.
    ///
    /// If all agents are behind, the data of one are still in the cache for its second turn, but no longer after the turns of all others.
    fn spell(&mut self, actor: Box<AgentRunner>, timeline: &Timeline) -> Option<Box<AgentRunner>> {
        let until = self.now + SPELL;
        actor.fetch();
        let mut waiting = self.turn(actor, timeline);
        while self.now < until {
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
        let sitting = self.desk.sit(self.turns, actor.id());
        let begun = actor.begin(timeline, began);
        if !self.desk.rise(sitting) {
            self.given_up = true;
            return None;
        }
        if actor.open.is_some() {
            actor.served += actor.pace.dt();
        }
        // the clock is read once per turn: the time after the step counts for the next one
        self.now = self.hall.clock.now();
        let wall = self.now.saturating_sub(began);
        let next = match begun {
            None => Next::Parked,
            Some(_) => actor.finish(timeline, self.now, wall.as_secs_f64()),
        };
        actor.count(wall);
        actor.settle(self.cpu.count(wall));
        match next {
            Next::Due => Some(actor),
            Next::Rest => self.lay(actor, timeline),
            Next::Join(leader) => move_in(actor, leader).err(),
            Next::Parked => None,
        }
    }

    /// Serves the summoned agents.
    fn answer(&mut self, timeline: &Timeline) {
        let Some(bell) = self.hall.board.bell().filter(|bell| bell.has_rung()) else { return };
        self.now = self.hall.clock.now();
        if bell.answer(|id| self.attend(id, timeline)) > 1 {
            // several agents may be too much for one worker: wake another
            bell.rouse();
        }
    }

    fn attend(&self, id: AgentId, timeline: &Timeline) {
        let woken = self.hall.lift(id).and_then(|actor| self.wake(actor, timeline));
        let home = self.hall.come_home(id).filter(|actor| !actor.is_parked());
        woken.into_iter().chain(home).for_each(|actor| self.hall.put(self.at, actor, self.now));
    }

    /// Stores `actor` at rest, unless it was woken: then returns it to wait for a turn.
    fn lay(&self, actor: Box<AgentRunner>, timeline: &Timeline) -> Option<Box<AgentRunner>> {
        self.hall.lay(actor).and_then(|actor| self.wake(actor, timeline))
    }

    /// Wakes `actor` if it was woken by a caller; else stores it at rest again.
    fn wake(&self, mut actor: Box<AgentRunner>, timeline: &Timeline) -> Option<Box<AgentRunner>> {
        loop {
            if actor.wakes(timeline, self.now) {
                return Some(actor);
            }
            actor = self.hall.lay(actor)?;
        }
    }

    fn sleep(&mut self) {
        let span = self.hall.pause(self.at, self.now);
        self.hall.board.bell().inspect(|bell| bell.sleep(self.at, span));
        self.now = self.hall.clock.now();
        self.awake_since = self.now;
    }

    /// Periodic work of a worker while it has turns to make.
    fn pause(&mut self, timeline: &Timeline) {
        if self.turns.is_multiple_of(BALANCE_TURNS) {
            self.hall.balance(self.at, timeline, self.now);
        }
        if self.now.saturating_sub(self.awake_since) >= SHIFT {
            thread::yield_now();
            self.now = self.hall.clock.now();
            self.awake_since = self.now;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::agent_clock::Drive;
    use super::super::super::spawn::{AssembledRun, assemble};
    use super::super::super::testing::Dummy;
    use super::super::super::{Clock, ManualClock};
    use super::*;

    fn worker(spawns: Vec<crate::AgentSpawn>, clock: &Arc<ManualClock>) -> Worker {
        let AssembledRun { actors, handles, board } = assemble(spawns).unwrap();
        board.hire(1);
        let clock = Arc::clone(clock) as Arc<dyn Clock>;
        let hall = Arc::new(PoolState::new(clock, board, handles, actors, 1));
        hall.timeline.drive(Duration::ZERO, Drive::Run);
        Worker::new(hall, 0, Arc::default())
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
    fn a_worker_of_sleepers_has_nothing_to_wake_for() {
        let clock = Arc::new(ManualClock::new());
        let sleepy = |_| Dummy { rest_from: Some(1), ..Dummy::new(1.0) }.at(100.0);
        let mut worker = worker((0..1000).map(sleepy).collect(), &clock);
        for _ in 0..1000 {
            let timeline = worker.hall.timeline.read();
            let actor = worker.hall.exchange(0, worker.last.take(), &timeline, worker.now).unwrap();
            worker.last = worker.turn(actor, &timeline);
        }
        assert!(worker.last.is_none());
        assert_eq!(worker.hall.pause(0, worker.now), None, "nobody is due");
        assert!(worker.hall.handles.iter().all(|agent| agent.state() == crate::AgentState::Resting));
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
        let steps: u64 = worker.hall.handles.iter().map(|agent| agent.steps()).sum();
        // 5.6 s of simulated time
        assert!((62_000..64_000).contains(&steps), "{steps}");
    }
}
