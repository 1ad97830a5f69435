//! Supervisor of a pool's workers: starts, watches, replaces and joins them.
//!
//! In: the pool's shared state. Out: a thread for each worker's place, until the end. A step that does not return costs one agent and one
//! thread: the agent is parked with the reason, and another worker takes the place. Never here: turns.

use super::super::cluster::return_arrivals;
use super::super::handle::AgentHandle;
use super::super::priority::Priority;
use super::super::sleep::Halt;
use super::shared::PoolState;
use super::watchdog::{WatchdogWord, WatchedTurn};
use super::worker::Worker;
use metachron_core::AgentId;
use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// A worker is given up when it is found in the same turn this many times in a row: after a suspension of the whole machine it is found so
/// only once.
const CHECKS_MAX: u32 = 4;

/// All workers and their state.
pub(super) struct Supervisor {
    state: Arc<PoolState>,
    workers: Vec<WorkerRecord>,
    started: u32,
    patience: Duration,
    priority: Priority,
    sender: Sender<Message>,
    messages: Receiver<Message>,
}

/// A message to the supervisor.
pub(super) enum Message {
    /// All workers are to end.
    Stop(Halt),
    /// The worker started under this number has ended.
    Ended(u32),
}

/// One worker.
struct WorkerRecord {
    number: u32,
    watchdog: Arc<WatchdogWord>,
    thread: Option<JoinHandle<()>>,
    seen: Option<WatchedTurn>,
    checks: u32,
}

/// Reports that a worker has ended, for whatever reason.
struct EndNotice {
    number: u32,
    sender: Sender<Message>,
}

impl Drop for EndNotice {
    fn drop(&mut self) {
        // the send fails only after the end, when the report is no longer needed
        let _ = self.sender.send(Message::Ended(self.number));
    }
}

impl Supervisor {
    /// Starts a worker for each of `places`; a step that takes longer than `patience` is given up.
    pub fn start(state: Arc<PoolState>, places: usize, patience: Duration, priority: Priority) -> io::Result<Self> {
        let (sender, messages) = channel();
        let mut supervisor = Self { state, workers: Vec::new(), started: 0, patience, priority, sender, messages };
        for at in 0..places {
            match supervisor.start_worker(at) {
                Ok(worker) => supervisor.workers.push(worker),
                Err(error) => {
                    supervisor.state.sleep.stop();
                    supervisor.join_all(Halt::End);
                    return Err(error);
                }
            }
        }
        Ok(supervisor)
    }

    /// The sender for messages to the supervisor.
    pub fn sender(&self) -> Sender<Message> {
        self.sender.clone()
    }

    /// Watches the workers until the run is to end, and ends it.
    pub fn watch(mut self) {
        let why = loop {
            match self.messages.recv_timeout(self.patience / CHECKS_MAX) {
                Ok(Message::Stop(why)) => break why,
                Ok(Message::Ended(number)) => self.on_ended(number),
                Err(_) => self.check(),
            }
        };
        self.join_all(why);
    }

    fn start_worker(&mut self, at: usize) -> io::Result<WorkerRecord> {
        let (number, watchdog) = (self.started, Arc::new(WatchdogWord::default()));
        self.started += 1;
        let (state, notice) = (Arc::clone(&self.state), EndNotice { number, sender: self.sender.clone() });
        let body = {
            let (watchdog, priority) = (Arc::clone(&watchdog), self.priority);
            move || {
                let _notice = notice;
                // a refusal was already reported to the caller of `Priority::ask`
                drop(priority.take());
                Worker::new(state, at, watchdog).work();
            }
        };
        let thread = thread::Builder::new().name(format!("pool:{at}")).spawn(body)?;
        Ok(WorkerRecord { number, watchdog, thread: Some(thread), seen: None, checks: 0 })
    }

    fn check(&mut self) {
        for at in 0..self.workers.len() {
            let worker = &mut self.workers[at];
            let turn = worker.watchdog.current();
            worker.checks = if turn.is_some() && turn == worker.seen { worker.checks + 1 } else { 0 };
            worker.seen = turn;
            if let Some(turn) = turn.filter(|turn| worker.checks >= CHECKS_MAX && worker.watchdog.give_up(*turn)) {
                self.park_stuck(turn.agent(), self.patience);
                self.replace(at);
            }
        }
    }

    /// A worker has ended. Before the end of the run that is a bug of metachron, and the other workers must continue.
    fn on_ended(&mut self, number: u32) {
        let Some(at) = self.workers.iter().position(|worker| worker.number == number) else { return };
        if let Some(turn) = self.workers[at].watchdog.current() {
            self.park(turn.agent(), "the worker thread of the agent panicked, which is a bug in metachron");
        }
        if self.state.sleep.stopping() { self.join(number) } else { self.replace(at) }
    }

    /// If the system gives no more threads, the other workers continue without this one.
    fn replace(&mut self, at: usize) {
        if let Ok(worker) = self.start_worker(at) {
            self.workers[at] = worker;
        }
    }

    fn park_stuck(&self, id: AgentId, patience: Duration) {
        self.park(id, &format!("a step did not end within {} s", patience.as_secs_f64()));
    }

    /// Parks an agent that is stuck in a turn, and all agents it leads, from outside.
    fn park(&self, id: AgentId, reason: &str) {
        let PoolState { sleep, handles, .. } = &*self.state;
        sleep.close(id);
        let led = || handles.iter().filter(|agent| sleep.leader(agent.id()) == id);
        led().filter_map(AgentHandle::live).for_each(|shared| return_arrivals(&shared));
        led().for_each(|agent| {
            sleep.close(agent.id());
            agent.live().into_iter().for_each(|shared| shared.gauges.park(reason.to_owned()));
            sleep.changed.mark(agent.id());
        });
    }

    fn join(&mut self, number: u32) {
        let worker = self.workers.iter_mut().find(|worker| worker.number == number);
        // a panic outside a turn has been printed, and the other workers must still be joined
        drop(worker.and_then(|worker| worker.thread.take()).map(JoinHandle::join));
    }

    /// Waits for the workers until a timeout, for a cut that after which a step is given up anyway: one that takes longer counts as hung, and
    /// its thread is left behind.
    fn join_all(&mut self, why: Halt) {
        let mut patience = Duration::ZERO;
        while self.workers.iter().any(|worker| worker.thread.is_some()) {
            let turns = self.workers.iter().filter_map(|worker| worker.watchdog.current());
            patience = match why {
                Halt::End => self.state.sleep.end_patience(turns.map(WatchedTurn::agent)),
                Halt::Cut => self.patience,
            };
            match self.messages.recv_timeout(patience) {
                Ok(Message::Ended(number)) => self.join(number),
                Ok(Message::Stop(_)) => {}
                Err(_) => break,
            }
        }
        for worker in self.workers.iter().filter(|worker| worker.thread.is_some()) {
            if let Some(turn) = worker.watchdog.current().filter(|turn| worker.watchdog.give_up(*turn)) {
                self.park_stuck(turn.agent(), patience);
            }
        }
    }
}
