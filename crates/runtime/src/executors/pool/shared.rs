//! Shared state of a pool's workers.
//!
//! In: agents between their turns, notifications. Out: for each worker its next turn, or how long it may sleep.
//! Every worker has its own queue, with a lock that is normally uncontended. A worker without work helps one whose turn is overdue, and
//! takes the agent over; at intervals a worker with work checks whether agents of other workers are served worse.
//! Agents at rest are stored in one slot each until they are notified. Never here: threads, turns.

use super::queue::{NEVER, Queue};
use crate::agent::agents::Agents;
use crate::lock_free::sleep::SleepRegistry;
use crate::lock_free::table::Table;
use crate::time::agent_clock::{SharedTimeline, Timeline};
use crate::time::clock::Clock;
use crate::turn::agent_runner::{AgentRunner, Next};
use crate::turn::turn_order::{PartKind, TurnOrder};
use crossbeam_utils::CachePadded;
use crossbeam_utils::atomic::AtomicCell;
use metachron_core::AgentId;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A turn overdue by this much is made by any idle worker: with less, workers would take each other's agents for no gain.
const OVERDUE: Duration = Duration::from_millis(1);

/// An agent of another worker is taken over if it has been served this much less, served nanoseconds.
const IMBALANCE_NS: u64 = 5_000_000;

/// Agents taken over in one go.
const STEAL_MAX: usize = 8;

/// State shared by all workers.
pub(super) struct PoolState {
    pub clock: Arc<dyn Clock>,
    pub timeline: SharedTimeline,
    pub sleep: Arc<SleepRegistry>,
    pub handles: Agents,
    queues: Vec<CachePadded<WorkerQueue>>,
    resting: Table<AtomicCell<Option<Box<AgentRunner>>>>,
    /// Where the parts of turns are noted; `None` of a run that is not recorded. It changes where no worker works.
    pub order: Mutex<Option<Arc<TurnOrder>>>,
    /// Agents that make no more turns.
    parked: Mutex<BTreeMap<AgentId, Box<AgentRunner>>>,
}

/// The queue of one worker, and its key figures, readable without the lock.
#[derive(Default)]
struct WorkerQueue {
    queue: Mutex<Queue>,
    due: AtomicU64,
    frontier: AtomicU64,
}

impl PoolState {
    pub fn new(
        clock: Arc<dyn Clock>,
        sleep: Arc<SleepRegistry>,
        handles: Agents,
        actors: Vec<Option<Box<AgentRunner>>>,
        workers: usize,
    ) -> Self {
        let resting = Table::of(handles.len());
        let queues = std::iter::repeat_with(CachePadded::default).take(workers).collect();
        let (timeline, order, parked) = (SharedTimeline::new(), Mutex::default(), Mutex::default());
        let state = Self { clock, timeline, sleep, handles, queues, resting, order, parked };
        state.distribute(actors, Duration::ZERO);
        state
    }

    /// Gives agents that make turns of their own to workers, by their numbers.
    pub fn distribute(&self, actors: Vec<Option<Box<AgentRunner>>>, now: Duration) {
        let (timeline, order, workers) = (self.timeline.read(), self.order(), self.queues.len());
        // some may have been added by a state that was read
        (self.resting.len()..actors.len()).for_each(|_| self.resting.grow());
        // neighbours in the scene share a worker, and still every worker gets agents of each kind
        let block = (actors.len() / (8 * workers)).clamp(1, 64);
        for (at, mut actor) in actors.into_iter().enumerate().filter_map(|(at, actor)| Some((at, actor?))) {
            if let (Some(order), true) = (&order, actor.open.is_some()) {
                order.hold().note(PartKind::Show, actor.id(), now);
            }
            match actor.next(&timeline, now) {
                Next::Parked => self.store_parked(actor),
                Next::Rest => {
                    if let Some(slot) = self.resting.get(actor.id().0 as usize) {
                        slot.store(Some(actor));
                    }
                }
                Next::Due | Next::Join(_) => self.queues[at / block % workers].with(|queue| queue.put(actor, now)),
            }
        }
    }

    /// Where the parts of turns are noted.
    pub fn order(&self) -> Option<Arc<TurnOrder>> {
        self.order.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Stores one that makes no more turns, unless it has left and is not kept.
    pub fn store_parked(&self, actor: Box<AgentRunner>) {
        if let Some(actor) = actor.kept() {
            self.parked().insert(actor.id(), actor);
        }
    }

    /// Takes one that makes no more turns.
    pub fn take_parked(&self, id: AgentId) -> Option<Box<AgentRunner>> {
        self.parked().remove(&id)
    }

    fn parked(&self) -> MutexGuard<'_, BTreeMap<AgentId, Box<AgentRunner>>> {
        self.parked.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next turn of worker `at`, which returns the agent of the last one as `back`; `None` if none is due.
    pub fn next_turn(
        &self,
        at: usize,
        back: Option<Box<AgentRunner>>,
        timeline: &Timeline,
        now: Duration,
    ) -> Option<Box<AgentRunner>> {
        let taken = self.queues[at].with(|queue| {
            queue.set_timeline(timeline, now);
            back.into_iter().for_each(|actor| queue.put_back(actor, now));
            queue.take(now)
        });
        taken.or_else(|| self.steal_overdue(at, timeline, now))
    }

    /// Takes up an agent that joins the run, as the next number.
    pub fn take_up(&self, actor: Box<AgentRunner>) {
        self.resting.grow();
        let (at, now) = (actor.id().0 as usize % self.queues.len(), self.clock.now());
        if actor.is_parked() {
            self.store_parked(actor)
        } else {
            self.put(at, actor, now)
        }
        self.sleep.unpark_all();
    }

    /// Adds `actor` to the queue of worker `at`.
    pub fn put(&self, at: usize, actor: Box<AgentRunner>, now: Duration) {
        self.queues[at].with(|queue| queue.put(actor, now));
    }

    /// Stores `actor` at rest; returns it if it has been woken meanwhile.
    pub fn store_resting(&self, actor: Box<AgentRunner>) -> Option<Box<AgentRunner>> {
        let id = actor.id();
        let slot = self.resting.get(id.0 as usize)?;
        // a notification before this found the slot empty: then its mark is seen here; a later one finds the agent
        drop(slot.swap(Some(actor)));
        if self.sleep.is_woken(id) { slot.take() } else { None }
    }

    /// Takes the agent out of its resting slot.
    pub fn take_resting(&self, id: AgentId) -> Option<Box<AgentRunner>> {
        self.resting.get(id.0 as usize)?.take()
    }

    /// The agent that has returned from a leader.
    pub fn take_returned(&self, id: AgentId) -> Option<Box<AgentRunner>> {
        self.handles.of(id)?.take_returned()
    }

    /// How long worker `at` may sleep from `now` on; `None`: until it is woken.
    pub fn pause(&self, at: usize, now: Duration) -> Option<Duration> {
        let mine = moment(self.queues[at].due.load(Relaxed));
        let next = (at + 1) % self.queues.len();
        // each worker watches the next one; a worker that finds it late searches further
        let theirs = moment(self.queues[next].due.load(Relaxed)).filter(|_| next != at);
        let watch = theirs.map(|due| due.saturating_add(OVERDUE).max(now + OVERDUE / 4));
        let until = mine.into_iter().chain(watch).min()?;
        Some(until.saturating_sub(now))
    }

    /// Takes over agents that another worker serves worse than worker `at` serves its own.
    pub fn balance(&self, at: usize, timeline: &Timeline, now: Duration) {
        let mine = self.queues[at].frontier.load(Relaxed);
        let is_imbalanced = |worker: &WorkerQueue| worker.frontier.load(Relaxed).saturating_add(IMBALANCE_NS) < mine;
        if mine == NEVER || !self.queues.iter().any(|worker| is_imbalanced(worker)) {
            return;
        }
        let Some(worker) = self.queues.iter().find(|worker| is_imbalanced(worker)) else { return };
        let mut stolen = Queue::default();
        worker.try_with(|queue| {
            queue.set_timeline(timeline, now);
            let _ = (0..STEAL_MAX).take_while(|_| queue.give_ready(&mut stolen, now)).count();
        });
        self.queues[at].with(|queue| while stolen.give_ready(queue, now) {});
    }

    /// Visits and removes all agents that make turns of their own, or would: between turns.
    pub fn clear(&self, mut visit: impl FnMut(Box<AgentRunner>)) {
        self.resting.iter().filter_map(AtomicCell::take).for_each(&mut visit);
        std::mem::take(&mut *self.parked()).into_values().for_each(&mut visit);
        self.queues.iter().for_each(|worker| worker.with(|queue| queue.drain().for_each(&mut visit)));
    }

    /// An overdue turn of another worker.
    fn steal_overdue(&self, at: usize, timeline: &Timeline, now: Duration) -> Option<Box<AgentRunner>> {
        let count = self.queues.len();
        let others = (1..count).map(|k| &self.queues[(at + k) % count]);
        let late = |worker: &WorkerQueue| moment(worker.due.load(Relaxed)).is_some_and(|due| due + OVERDUE <= now);
        others.filter(|worker| late(worker)).find_map(|worker| {
            worker.try_with(|queue| {
                queue.set_timeline(timeline, now);
                queue.take(now)
            })
        })
    }
}

impl WorkerQueue {
    fn with<R>(&self, act: impl FnOnce(&mut Queue) -> R) -> R {
        self.update_keys(self.queue.lock().unwrap_or_else(PoisonError::into_inner), act)
    }

    /// As [`Self::with`], if the queue's lock is free.
    fn try_with<R: Default>(&self, act: impl FnOnce(&mut Queue) -> R) -> R {
        self.queue.try_lock().map_or_else(|_| R::default(), |queue| self.update_keys(queue, act))
    }

    fn update_keys<R>(&self, mut queue: MutexGuard<'_, Queue>, act: impl FnOnce(&mut Queue) -> R) -> R {
        let result = act(&mut queue);
        self.due.store(queue.due(), Relaxed);
        self.frontier.store(queue.frontier(), Relaxed);
        result
    }
}

fn moment(nanos: u64) -> Option<Duration> {
    (nanos != NEVER).then(|| Duration::from_nanos(nanos))
}
