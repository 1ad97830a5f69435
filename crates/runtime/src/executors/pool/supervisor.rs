//! Supervisor of a pool's workers: starts, watches, replaces and joins them.
//!
//! In: the pool's shared state. Out: a thread for each worker's place, until the end. A step that lasts too long costs one thread: its agent is
//! stalled, and another worker takes the place; the first one ends with that step. Never here: turns.

use super::super::priority::{Priority, take_priority};
use super::shared::PoolState;
use super::worker::Worker;
use crate::agent::handle::AgentHandle;
use crate::cluster::return_arrivals;
use crate::lock_free::sleep::Halt;
use crate::turn::watchdog::{Seen, Watchdog, WatchdogWord, WatchedTurn};
use metachron_core::AgentId;
use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// All workers and their state.
pub(super) struct Supervisor {
    state: Arc<PoolState>,
    workers: Vec<WorkerRecord>,
    team: Team,
    started: u32,
    sender: Sender<Message>,
    messages: Receiver<Message>,
}

/// The settings with which a supervisor begins.
pub(super) struct Team {
    /// How many workers there are to be.
    pub places: usize,
    pub watchdog: Watchdog,
    pub priority: Priority,
    /// Workers in whose places others work: their turns have not ended.
    pub stuck: Vec<WorkerRecord>,
}

/// A message to the supervisor.
pub(super) enum Message {
    /// All workers are to end.
    Stop(Halt),
    /// The worker started under this number has ended.
    Ended(u32),
}

/// One worker.
pub(super) struct WorkerRecord {
    number: u32,
    pub watchdog: Arc<WatchdogWord>,
    thread: Option<JoinHandle<()>>,
    seen: Seen,
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
    /// Starts a worker for each place.
    pub fn start(state: Arc<PoolState>, team: Team) -> io::Result<Self> {
        let ((sender, messages), places) = (channel(), team.places);
        // no worker has the number of one that is stuck
        let started = team.stuck.iter().map(|worker| worker.number + 1).max().unwrap_or(0);
        let mut supervisor = Self { state, workers: Vec::new(), team, started, sender, messages };
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

    /// Watches the workers until the run is to end, and ends it; workers whose turns do not end are left.
    pub fn watch(mut self) -> Vec<WorkerRecord> {
        let why = loop {
            match self.messages.recv_timeout(self.team.watchdog.limit.interval()) {
                Ok(Message::Stop(why)) => break why,
                Ok(Message::Ended(number)) => self.on_ended(number),
                Err(_) => self.check(),
            }
        };
        self.join_all(why);
        self.team.stuck
    }

    fn start_worker(&mut self, at: usize) -> io::Result<WorkerRecord> {
        let (number, watchdog) = (self.started, Arc::new(WatchdogWord::default()));
        self.started += 1;
        let (state, notice) = (Arc::clone(&self.state), EndNotice { number, sender: self.sender.clone() });
        let body = {
            let (word, watchdog, priority) = (Arc::clone(&watchdog), self.team.watchdog.clone(), self.team.priority);
            move || {
                let _notice = notice;
                // a refusal was already reported to the caller of `ask_priority`
                drop(take_priority(priority));
                Worker::new(state, at, word, watchdog).work();
            }
        };
        let thread = thread::Builder::new().name(format!("pool:{at}")).spawn(body)?;
        Ok(WorkerRecord { number, watchdog, thread: Some(thread), seen: Seen::default() })
    }

    fn check(&mut self) {
        let watchdog = self.team.watchdog.clone();
        self.team.stuck.retain_mut(|worker| {
            watchdog.judge(&worker.watchdog, &mut worker.seen);
            !worker.has_ended()
        });
        for at in 0..self.workers.len() {
            let worker = &mut self.workers[at];
            if watchdog.judge(&worker.watchdog, &mut worker.seen) {
                self.replace(at);
            }
        }
    }

    /// A worker has ended. Before the end of the run that is a bug of metachron where no other works in its place, and the others must continue.
    fn on_ended(&mut self, number: u32) {
        let all = self.workers.iter().chain(&self.team.stuck);
        let turn = all.filter(|worker| worker.number == number).find_map(|worker| worker.watchdog.current());
        if let Some(turn) = turn {
            self.park(turn.agent(), "the worker thread of the agent panicked, which is a bug in metachron");
        }
        match self.workers.iter().position(|worker| worker.number == number) {
            Some(at) if !self.state.sleep.stopping() => self.replace(at),
            _ => self.join(number),
        }
    }

    /// If the system gives no more threads, the other workers continue without this one.
    fn replace(&mut self, at: usize) {
        if let Ok(worker) = self.start_worker(at) {
            let before = std::mem::replace(&mut self.workers[at], worker);
            self.team.stuck.extend(Some(before).filter(|worker| !worker.has_ended()));
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
        let worker = self.workers.iter_mut().chain(&mut self.team.stuck).find(|worker| worker.number == number);
        // a panic outside a turn has been printed, and the other workers must still be joined
        drop(worker.and_then(|worker| worker.thread.take()).map(JoinHandle::join));
    }

    /// Waits for the workers: for a cut until only workers are left whose turns are stalled, at the end until a
    /// timeout, where a step that takes longer counts as hung. The threads of these are left behind.
    fn join_all(&mut self, why: Halt) {
        let mut patience = Duration::ZERO;
        let watchdog = self.team.watchdog.clone();
        loop {
            self.team.stuck.retain(|worker| !worker.has_ended());
            let mut missing = self.workers.iter().filter(|worker| worker.thread.is_some()).peekable();
            // one whose turn has ended late still has its agent until it ends itself
            let is_left = |worker: &WorkerRecord| why == Halt::Cut && worker.watchdog.is_stalled();
            if missing.peek().is_none() && self.team.stuck.iter().all(is_left) {
                break;
            }
            let turns = missing.chain(&self.team.stuck).filter_map(|worker| worker.watchdog.current());
            patience = match why {
                Halt::End => self.state.sleep.end_patience(turns.map(WatchedTurn::agent)),
                Halt::Cut => watchdog.limit.interval(),
            };
            match (self.messages.recv_timeout(patience), why) {
                (Ok(Message::Ended(number)), _) => self.on_ended(number),
                (Ok(Message::Stop(_)), _) => {}
                (Err(_), Halt::End) => break,
                (Err(_), Halt::Cut) => self.set_stuck_aside(),
            }
        }
        if why == Halt::Cut {
            return;
        }
        let left = self.workers.iter().filter(|worker| worker.thread.is_some()).chain(&self.team.stuck);
        left.filter_map(|worker| worker.watchdog.current()).for_each(|turn| self.park_stuck(turn.agent(), patience));
    }

    /// Waits no longer for workers whose turns are stalled.
    fn set_stuck_aside(&mut self) {
        let watchdog = &self.team.watchdog;
        for worker in self.workers.iter_mut().filter(|worker| worker.thread.is_some()) {
            watchdog.judge(&worker.watchdog, &mut worker.seen);
        }
        let stuck = self.workers.extract_if(.., |worker| worker.thread.is_some() && worker.watchdog.is_stalled());
        self.team.stuck.extend(stuck);
    }
}

impl WorkerRecord {
    fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }
}
