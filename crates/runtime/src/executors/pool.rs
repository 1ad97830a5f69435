//! Executor in real time with a few workers for thousands of agents.
//!
//! In: agents and a [`Clock`]. Out: [`Run`]. Each worker makes the turns that are due, earliest deadline first, and sleeps when none is;
//! agents have their own clocks as on threads, and do not depend on the worker that makes their turns.
//! A thread per agent costs a context switch per turn; a worker just goes from one agent to the next.
//! Under overload every agent falls to the same share of its rate (`pool/queue.rs`). Never here: virtual time, declared costs.

mod queue;
mod shared;
mod supervisor;
mod worker;

use super::archive::{Absent, Cut, CutBetweenTurns};
use super::priority::Priority;
use crate::Run;
use crate::agent::agent_spawn::AgentSpawn;
use crate::agent::agents::Agents;
use crate::agent::agents::RunAgents;
use crate::agent::handle::AgentHandle;
use crate::agent::spawn::{AssembledRun, RunError, assemble};
use crate::cluster::{close_remaining, put_back, take_apart};
use crate::commands::mailbox::SendError;
use crate::lock_free::sleep::Halt;
use crate::records::metrics::AgentStats;
use crate::time::agent_clock::{Timeline, TimelineCommand};
use crate::time::clock;
use crate::time::clock::Clock;
use crate::turn::helpers::Helpers;
use crate::turn::turn_order::TurnOrder;
use crate::turn::watchdog::{StallLimit, Watchdog};
use metachron_core::{AgentId, Archive, ArchiveError};
use shared::PoolState;
use std::num::NonZero;
use std::sync::mpsc::Sender;
use std::sync::{Arc, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;
use supervisor::{Message, Supervisor, Team, WorkerRecord};

/// Agents that share workers.
pub struct Pool {
    state: Arc<PoolState>,
    all: RunAgents,
    messages: Sender<Message>,
    watch: Option<JoinHandle<Vec<WorkerRecord>>>,
    workers: usize,
    watchdog: Watchdog,
    priority: Priority,
    /// Workers whose turns are stalled, in whose places others work.
    stuck: Vec<WorkerRecord>,
}

impl Pool {
    /// Starts a worker per core that the system gives; simulated time is paused until [`TimelineCommand::Run`]. If the system refuses `priority`
    /// ([`crate::ask_priority`]) workers have the ordinary one.
    ///
    /// # Errors
    /// [`RunError`] for agents that cannot run as requested, and if the system gives no thread.
    pub fn start(spawns: Vec<AgentSpawn>, clock: Arc<dyn Clock>, priority: Priority) -> Result<Self, RunError> {
        let workers = thread::available_parallelism().map_or(1, NonZero::get);
        Self::with_workers(spawns, clock, workers, StallLimit::default(), priority)
    }

    /// Starts `workers` workers, at least one, each replaced where a turn lasts longer than `limit` says.
    pub(super) fn with_workers(
        spawns: Vec<AgentSpawn>,
        clock: Arc<dyn Clock>,
        workers: usize,
        limit: StallLimit,
        priority: Priority,
    ) -> Result<Self, RunError> {
        let AssembledRun { actors, all } = assemble(spawns, Helpers::one_per_core(priority))?;
        let workers = workers.clamp(1, all.handles.len().max(1));
        all.sleep.set_workers(workers);
        let (sleep, handles) = (Arc::clone(&all.sleep), all.handles.clone());
        let watchdog = Watchdog::new(&handles, limit);
        let state = Arc::new(PoolState::new(clock, sleep, handles, actors, workers));
        state.timeline.drive(Duration::ZERO, TimelineCommand::Pause);
        let team = Team { places: workers, watchdog: watchdog.clone(), priority, stuck: Vec::new() };
        let (messages, watch) = Self::watched(&state, team)?;
        Ok(Self { state, all, messages, watch: Some(watch), workers, watchdog, priority, stuck: Vec::new() })
    }

    /// Starts workers, and the thread that watches them.
    fn watched(
        state: &Arc<PoolState>,
        team: Team,
    ) -> Result<(Sender<Message>, JoinHandle<Vec<WorkerRecord>>), RunError> {
        let no_thread = |error| RunError::NoThread { name: "the pool's workers".to_owned(), error };
        let supervisor = Supervisor::start(Arc::clone(state), team).map_err(no_thread)?;
        let messages = supervisor.sender();
        let watch =
            thread::Builder::new().name("pool:watch".to_owned()).spawn(|| supervisor.watch()).map_err(|source| {
                state.sleep.stop();
                no_thread(source)
            })?;
        Ok((messages, watch))
    }

    /// Ends all workers, between turns, except workers whose turns are stalled.
    fn halt(&mut self, why: Halt) {
        self.state.sleep.stop();
        // the send fails only if the watchdog has already ended
        let _ = self.messages.send(Message::Stop(why));
        self.stuck = self.watch.take().and_then(|watch| watch.join().ok()).unwrap_or_default();
    }

    /// Starts workers again.
    fn go_on(&mut self) -> Result<(), RunError> {
        self.state.sleep.go_on();
        let stuck = std::mem::take(&mut self.stuck);
        let team = Team { places: self.workers, watchdog: self.watchdog.clone(), priority: self.priority, stuck };
        let (messages, watch) = Self::watched(&self.state, team)?;
        (self.messages, self.watch) = (messages, Some(watch));
        Ok(())
    }

    fn end(&mut self) {
        self.end_turns();
        let (timeline, now) = (self.state.timeline.read(), self.state.clock.now());
        self.state.clear(|mut actor| actor.close_account(&timeline, now));
        close_remaining(&self.state.handles, &timeline, now);
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.end();
    }
}

impl CutBetweenTurns for Pool {
    fn agents_of_run(&self) -> &RunAgents {
        &self.all
    }

    fn cut(
        &mut self,
        act: impl FnOnce(&mut Cut, &mut Option<Arc<TurnOrder>>) -> Result<(), ArchiveError>,
    ) -> Result<(), ArchiveError> {
        let refused = |what: String| ArchiveError::Refused { what };
        let no_thread = |error: RunError| refused(format!("a run that cannot go on ({error})"));
        self.watchdog.await_stalled().map_err(refused)?;
        self.halt(Halt::Cut);
        if self.stuck.iter().any(|worker| worker.watchdog.is_stalled()) {
            let complaint = self.watchdog.complaint();
            self.go_on().map_err(no_thread)?;
            return Err(refused(complaint.unwrap_or_else(|| "a step that does not end".to_owned())));
        }
        let mut homes = Vec::new();
        self.state.clear(|actor| homes.push(Some(actor)));
        let all = take_apart(homes.into_iter(), &self.all.handles);
        let timeline = self.state.timeline.read();
        let mut cut = Cut::new(all, self.all.clone(), timeline, self.state.clock.now());
        let outcome = act(&mut cut, &mut self.state.order.lock().unwrap_or_else(PoisonError::into_inner));
        if cut.timeline != timeline {
            self.state.timeline.set(cut.timeline);
        }
        self.state.distribute(put_back(cut.all, &self.all.handles), cut.now);
        // some may have been woken, or have returned from a leader
        self.all.handles.iter().for_each(|agent| self.state.sleep.notify(agent.id()));
        outcome.and(self.go_on().map_err(no_thread))
    }
}

impl Run for Pool {
    fn now(&self) -> Duration {
        self.state.clock.now()
    }

    fn wait_until(&mut self, until: Duration) {
        clock::wait_until(&*self.state.clock, until);
    }

    fn spend(&mut self, _work: Duration) {}

    fn timeline(&self) -> Timeline {
        self.state.timeline.read()
    }

    fn set_stall_limit(&mut self, limit: Duration) {
        self.watchdog.limit.set(limit);
    }

    fn drive(&mut self, drive: TimelineCommand) {
        self.state.timeline.drive(self.state.clock.now(), drive);
        self.state.sleep.unpark_all();
    }

    fn agents(&self) -> &Agents {
        &self.all.handles
    }

    fn add(&mut self, spawn: AgentSpawn) -> Result<AgentHandle, RunError> {
        let actor = self.all.join(spawn, self.sim_now())?;
        let handle = self.all.handles[actor.id().0 as usize].clone();
        self.state.take_up(actor);
        Ok(handle)
    }

    fn remove(&mut self, id: AgentId) -> Result<(), SendError> {
        let mut home = self.state.take_parked(id);
        let left = self.all.leave(id, &mut home);
        home.into_iter().for_each(|actor| self.state.store_parked(actor));
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
        self.halt(Halt::End);
    }

    fn shutdown(mut self: Box<Self>) -> Vec<AgentStats> {
        self.end();
        self.state.handles.iter().map(AgentHandle::stats).collect()
    }
}

#[cfg(test)]
mod tests;
