//! Default executor in real time: a thread per agent.
//!
//! In: agents and a [`Clock`]. Out: [`Run`]. A thread sleeps until its agent is due and is woken by a command, a touch, a changed timeline
//! and the end; a thread whose agent rests or is led by another sleeps without a timer, a thread whose agent is parked ends.
//! Never here: virtual time, declared costs.

mod agent_thread;
mod watch;

use super::archive::{Absent, Cut, CutBetweenTurns};
use super::priority::{Priority, take_priority};
use crate::Run;
use crate::agent::agent_spawn::AgentSpawn;
use crate::agent::agents::Agents;
use crate::agent::agents::RunAgents;
use crate::agent::handle::{AgentHandle, Shared};
use crate::agent::spawn::{AssembledRun, RunError, assemble};
use crate::cluster::{close_remaining, put_back, take_apart};
use crate::commands::mailbox::SendError;
use crate::records::metrics::AgentStats;
use crate::time::agent_clock::{SharedTimeline, Timeline, TimelineCommand};
use crate::time::clock::{Clock, wait_until};
use crate::time::cpu::CpuBatch;
use crate::turn::agent_runner::AgentRunner;
use crate::turn::helpers::Helpers;
use crate::turn::turn_order::TurnOrder;
use crate::turn::watchdog::{CHECKS, StallLimit, Watchdog, WatchdogWord};
use agent_thread::AgentThread;
use metachron_core::{AgentId, Archive, ArchiveError};
use std::collections::BTreeMap;
use std::io;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;
use watch::{Ended, Words, watch};

/// The most agents with a thread each; beyond, waking them costs more than their steps.
pub const THREADS_MAX: usize = 1000;

/// Up to this many agents have a thread each if the scene names no executor: 10 agents of 200 Hz cost 15 µs a turn on threads and 20 in a
/// pool, 100 cost 10 and 6 (`docs/throughput.md`).
pub const AUTO_THREADS_MAX: usize = 64;

/// Agents on threads of their own.
pub struct Threads {
    clock: Arc<dyn Clock>,
    timeline: Arc<SharedTimeline>,
    all: RunAgents,
    /// Of agents that make turns, or that others lead.
    threads: BTreeMap<AgentId, Ended>,
    /// Agents whose threads have ended.
    ended_agents: BTreeMap<AgentId, Box<AgentRunner>>,
    /// Where threads report that they have ended.
    farewells: Sender<AgentId>,
    ended: Receiver<AgentId>,
    priority: Priority,
    /// Where the parts of turns are noted; `None` of a run that is not recorded.
    order: Option<Arc<TurnOrder>>,
    watchdog: Watchdog,
    words: Words,
    /// Ends the thread that watches.
    unwatched: Sender<()>,
    spawner: Spawner,
}

/// Asks the system for a thread.
type Spawner = fn(thread::Builder, Body) -> io::Result<JoinHandle<Option<Box<AgentRunner>>>>;

/// The work of a thread: it gives its agent back where it has it at its end.
type Body = Box<dyn FnOnce() -> Option<Box<AgentRunner>> + Send>;

impl Threads {
    /// Gives every agent its thread; simulated time is paused until [`TimelineCommand::Run`]. If the system refuses `priority` ([`crate::ask_priority`])
    /// the threads have the ordinary one.
    ///
    /// # Errors
    /// [`RunError`] for more than [`THREADS_MAX`] agents, for agents that cannot run as requested, and if the system gives no thread.
    pub fn start(spawns: Vec<AgentSpawn>, clock: Arc<dyn Clock>, priority: Priority) -> Result<Self, RunError> {
        if spawns.len() > THREADS_MAX {
            return Err(RunError::TooMany { agents: spawns.len(), most: THREADS_MAX });
        }
        let AssembledRun { actors, all } = assemble(spawns, Helpers::one_per_core(priority))?;
        let timeline = Arc::new(SharedTimeline::new());
        timeline.drive(Duration::ZERO, TimelineCommand::Pause);
        let (farewells, ended) = channel();
        let (threads, ended_agents, order) = (BTreeMap::new(), BTreeMap::new(), None);
        let watchdog = Watchdog::new(&all.handles, StallLimit::default());
        let words = Words::default();
        let unwatched = watch(watchdog.clone(), Arc::clone(&words))?;
        let mut run = Self {
            clock,
            timeline,
            all,
            threads,
            ended_agents,
            farewells,
            ended,
            priority,
            order,
            watchdog,
            words,
            unwatched,
            spawner: |builder, body| builder.spawn(body),
        };
        for (actor, id) in actors.into_iter().zip((0..).map(AgentId)) {
            // on an error the run so far is dropped, which ends its threads
            run.begin(id)?;
            run.give(id, actor);
        }
        Ok(run)
    }

    /// Starts the thread of an agent that is there; it waits for the agent.
    fn begin(&mut self, id: AgentId) -> Result<(), RunError> {
        let Some(shared) = self.all.handles.of(id).and_then(AgentHandle::live).map(|shared| Arc::clone(&shared)) else {
            return Ok(());
        };
        let ended = self.spawn(shared)?;
        self.words().insert(id, Arc::clone(&ended.word));
        self.threads.insert(id, ended);
        Ok(())
    }

    /// Gives an agent that makes turns of its own to its thread.
    fn give(&mut self, id: AgentId, actor: Option<Box<AgentRunner>>) {
        let Some(actor) = actor else { return };
        match self.threads.get(&id).filter(|_| !actor.is_parked()) {
            Some(ended) => {
                // its place is free: there is only one of it
                drop(ended.given.swap(Some(actor)));
                ended.thread.thread().unpark();
            }
            None => drop(self.ended_agents.insert(id, actor)),
        }
    }

    /// Joins the threads that have ended: until then the system keeps their stacks.
    fn join_ended(&mut self) {
        while let Ok(id) = self.ended.try_recv() {
            self.join(id);
        }
    }

    /// Joins the thread of an agent, which ends.
    fn join(&mut self, id: AgentId) {
        // a panic outside a turn is a bug of metachron: it has been printed, and the other threads must still be joined
        let actor = self.threads.remove(&id).and_then(|ended| ended.thread.join().ok().flatten());
        self.words().remove(&id);
        self.all.sleep.set_thread(id, None);
        self.ended_agents.extend(actor.and_then(AgentRunner::kept).map(|actor| (id, actor)));
    }

    fn words(&self) -> MutexGuard<'_, BTreeMap<AgentId, Arc<WatchdogWord>>> {
        self.words.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn spawn(&self, shared: Arc<Shared>) -> Result<Ended, RunError> {
        let name = format!("agent:{}", shared.name().replace('\0', ""));
        let stage = AgentThread {
            clock: Arc::clone(&self.clock),
            timeline: Arc::clone(&self.timeline),
            batch: CpuBatch::default(),
            order: self.order.clone(),
            awake: Duration::ZERO,
            watchdog: self.watchdog.clone(),
            word: Arc::default(),
            turns: 0,
            given: Arc::default(),
        };
        let (word, given) = (Arc::clone(&stage.word), Arc::clone(&stage.given));
        let farewell = EndNotice { id: shared.id, ended: self.farewells.clone() };
        let builder = thread::Builder::new().name(name.clone());
        let priority = self.priority;
        let body = move || {
            let _farewell = farewell;
            // a refusal was already reported to the caller of `ask_priority`
            drop(take_priority(priority));
            // by itself: where the agent is given back before another thread registers this one, no thread is woken
            shared.sleep.set_thread(shared.id, Some(thread::current()));
            stage.run(&shared)
        };
        let thread = (self.spawner)(builder, Box::new(body)).map_err(|error| RunError::NoThread { name, error })?;
        Ok(Ended { thread, word, given })
    }

    /// Ends all threads for a cut and waits for them, except threads whose turns are stalled: then all go on. Gives
    /// back the agents that make turns of their own.
    fn pause(&mut self) -> Result<Vec<Option<Box<AgentRunner>>>, ArchiveError> {
        let refused = |what: String| ArchiveError::Refused { what };
        self.watchdog.await_stalled().map_err(refused)?;
        self.all.sleep.stop();
        let mut quiet = 0;
        while !self.threads.is_empty() {
            let Err(_) = self.ended.recv_timeout(self.watchdog.limit.interval()).map(|id| self.join(id)) else {
                quiet = 0;
                continue;
            };
            quiet += 1;
            // others may wait for the place in the order of turns that a stalled one has
            if quiet >= CHECKS && self.threads.values().any(|ended| ended.word.is_stalled()) {
                let complaint = self.watchdog.complaint();
                self.resume_all();
                return Err(refused(complaint.unwrap_or_else(|| "a step that does not end".to_owned())));
            }
        }
        Ok(self.homes())
    }

    /// Lets all go on again, of which some have not ended.
    fn resume_all(&mut self) {
        self.all.sleep.go_on();
        // threads that end nevertheless have said so before
        while self.threads.values().any(|ended| ended.word.has_ended()) {
            let Ok(id) = self.ended.recv() else { break };
            self.join(id);
        }
        let homes = self.homes();
        let cut = self.cut_of(homes);
        self.go_on(cut);
    }

    /// All agents, of which `homes` make turns of their own, taken from their places.
    fn cut_of(&self, homes: Vec<Option<Box<AgentRunner>>>) -> Cut {
        let all = take_apart(homes.into_iter(), &self.all.handles);
        Cut { most: THREADS_MAX, ..Cut::new(all, self.all.clone(), self.timeline.read(), self.clock.now()) }
    }

    /// Ends all threads and waits for them until a timeout: a step that takes longer counts as hung, and its thread is left behind. Gives back the
    /// agents that make turns of their own.
    fn halt(&mut self) -> Vec<Option<Box<AgentRunner>>> {
        self.all.sleep.stop();
        let mut patience = Duration::ZERO;
        while !self.threads.is_empty() {
            patience = self.all.sleep.end_patience(self.threads.keys().copied());
            let Ok(id) = self.ended.recv_timeout(patience) else { break };
            self.join(id);
        }
        for shared in self.threads.keys().filter_map(|id| self.all.handles.of(*id)?.live()) {
            shared.gauges.park(format!("a step did not end within {} s", patience.as_secs_f64()));
        }
        self.threads.clear();
        self.homes()
    }

    /// Takes the agents whose threads have ended, each by its number.
    fn homes(&mut self) -> Vec<Option<Box<AgentRunner>>> {
        let mut homes: Vec<_> = self.all.handles.iter().map(|_| None).collect();
        let ended = std::mem::take(&mut self.ended_agents);
        ended.into_iter().for_each(|(id, actor)| homes[id.0 as usize] = Some(actor));
        homes
    }

    /// Gives the agents their threads again. One for which the system gives none is parked, before others go on.
    fn go_on(&mut self, mut cut: Cut) {
        self.all.sleep.go_on();
        let has_ended = |agent: &AgentHandle| agent.live().is_none_or(|shared| shared.gauges.has_ended());
        let ids: Vec<_> = self.all.handles.iter().filter(|agent| !has_ended(agent)).map(AgentHandle::id).collect();
        for id in ids {
            // the step of one that has a thread has not ended
            if !self.threads.contains_key(&id)
                && let Err(error) = self.begin(id)
            {
                cut.park(id.0 as usize, &error.to_string());
            }
        }
        let homes = put_back(cut.all, &self.all.handles);
        homes.into_iter().zip((0..).map(AgentId)).for_each(|(actor, id)| self.give(id, actor));
        // some return from a leader, and their threads wait already
        self.threads.values().for_each(|ended| ended.thread.thread().unpark());
    }

    fn end(&mut self) {
        self.end_turns();
        // it fails only where that thread has ended
        let _ = self.unwatched.send(());
        let (timeline, now) = (self.timeline.read(), self.clock.now());
        std::mem::take(&mut self.ended_agents).into_values().for_each(|mut actor| actor.close_account(&timeline, now));
        close_remaining(&self.all.handles, &timeline, now);
    }
}

impl Drop for Threads {
    fn drop(&mut self) {
        self.end();
    }
}

impl CutBetweenTurns for Threads {
    fn agents_of_run(&self) -> &RunAgents {
        &self.all
    }

    fn cut(
        &mut self,
        act: impl FnOnce(&mut Cut, &mut Option<Arc<TurnOrder>>) -> Result<(), ArchiveError>,
    ) -> Result<(), ArchiveError> {
        let homes = self.pause()?;
        let mut cut = self.cut_of(homes);
        let outcome = act(&mut cut, &mut self.order);
        if cut.timeline != self.timeline.read() {
            self.timeline.set(cut.timeline);
        }
        self.go_on(cut);
        outcome
    }
}

impl Run for Threads {
    fn now(&self) -> Duration {
        self.clock.now()
    }

    fn wait_until(&mut self, until: Duration) {
        wait_until(&*self.clock, until);
    }

    fn spend(&mut self, _work: Duration) {}

    fn timeline(&self) -> Timeline {
        self.timeline.read()
    }

    fn set_stall_limit(&mut self, limit: Duration) {
        self.watchdog.limit.set(limit);
    }

    fn drive(&mut self, drive: TimelineCommand) {
        self.timeline.drive(self.clock.now(), drive);
        self.all.sleep.unpark_all();
    }

    fn agents(&self) -> &Agents {
        &self.all.handles
    }

    fn add(&mut self, spawn: AgentSpawn) -> Result<AgentHandle, RunError> {
        self.join_ended();
        let running = self.threads.len();
        if running >= THREADS_MAX {
            return Err(RunError::TooMany { agents: running + 1, most: THREADS_MAX });
        }
        let mut actor = self.all.join(spawn, self.sim_now())?;
        let id = actor.id();
        if let Err(error) = self.begin(id) {
            actor.take_out();
            drop(actor.kept());
            return Err(error);
        }
        self.give(id, Some(actor));
        Ok(self.all.handles[id.0 as usize].clone())
    }

    fn remove(&mut self, id: AgentId) -> Result<(), SendError> {
        self.join_ended();
        let mut home = self.ended_agents.remove(&id);
        let left = self.all.leave(id, &mut home);
        self.ended_agents.extend(home.map(|actor| (id, actor)));
        left
    }

    fn archive(&mut self, archive: &mut Archive<'_>, absent: Absent<'_>) -> Result<(), ArchiveError> {
        self.archive_between_turns(archive, absent)
    }

    fn record(&mut self, order: Arc<TurnOrder>, begun: Option<&mut Archive<'_>>) -> Result<(), ArchiveError> {
        self.record_between_turns(order, begun)
    }

    fn end_turns(&mut self) {
        self.all.sleep.end();
        let homes = self.halt().into_iter();
        self.ended_agents = (0..).map(AgentId).zip(homes).filter_map(|(id, home)| Some((id, home?))).collect();
    }

    fn shutdown(mut self: Box<Self>) -> Vec<AgentStats> {
        self.end();
        self.all.handles.iter().map(AgentHandle::stats).collect()
    }
}

/// Reports that a thread has ended, for whatever reason.
struct EndNotice {
    id: AgentId,
    ended: Sender<AgentId>,
}

impl Drop for EndNotice {
    fn drop(&mut self) {
        // the send fails only after the final timeout, when the report is no longer needed
        let _ = self.ended.send(self.id);
    }
}

#[cfg(test)]
mod tests;
