//! Executor in real time with a few workers for thousands of agents.
//!
//! In: agents and a [`Clock`]. Out: [`Run`]. Each worker makes the turns that are due, earliest deadline first, and sleeps when none is;
//! agents have their own clocks as on threads, and do not depend on the worker that makes their turns.
//! A thread per agent costs a context switch per turn; a worker just goes from one agent to the next.
//! Under overload every agent falls to the same share of its rate (`pool/queue.rs`). Never here: virtual time, declared costs.

mod queue;
mod shared;
mod supervisor;
mod watchdog;
mod worker;

use super::Run;
use super::agent_clock::{Timeline, TimelineCommand};
use super::agents::Agents;
use super::clock::Clock;
use super::handle::AgentHandle;
use super::helpers::Helpers;
use super::mailbox::SendError;
use super::metrics::AgentStats;
use super::priority::Priority;
use super::spawn::{AgentSpawn, AssembledRun, Everyone, RunError, assemble};
use metachron_core::AgentId;
use shared::PoolState;
use std::num::NonZero;
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::thread::{self, JoinHandle};
use std::time::Duration;
use supervisor::{Message, Supervisor};

/// A step that takes longer is given up: its agent is parked, its worker replaced.
const PATIENCE: Duration = Duration::from_secs(5);

/// Agents that share workers.
pub struct Pool {
    state: Arc<PoolState>,
    all: Everyone,
    messages: Sender<Message>,
    watch: Option<JoinHandle<()>>,
}

impl Pool {
    /// Starts a worker per core that the system gives; simulated time is paused until [`TimelineCommand::Run`]. If the system refuses `priority`
    /// ([`Priority::ask`]) workers have the ordinary one.
    ///
    /// # Errors
    /// [`RunError`] for agents that cannot run as requested, and if the system gives no thread.
    pub fn start(spawns: Vec<AgentSpawn>, clock: Arc<dyn Clock>, priority: Priority) -> Result<Self, RunError> {
        let workers = thread::available_parallelism().map_or(1, NonZero::get);
        Self::with_workers(spawns, clock, workers, PATIENCE, priority)
    }

    /// Starts `workers` workers, at least one, each given up after `patience` in one step.
    pub(super) fn with_workers(
        spawns: Vec<AgentSpawn>,
        clock: Arc<dyn Clock>,
        workers: usize,
        patience: Duration,
        priority: Priority,
    ) -> Result<Self, RunError> {
        let AssembledRun { actors, all } = assemble(spawns, Helpers::one_per_core(priority))?;
        let workers = workers.clamp(1, all.handles.len().max(1));
        all.sleep.set_workers(workers);
        let (sleep, handles) = (Arc::clone(&all.sleep), all.handles.clone());
        let state = Arc::new(PoolState::new(clock, sleep, handles, actors, workers));
        state.timeline.drive(Duration::ZERO, TimelineCommand::Pause);
        let no_thread = |source| RunError::NoThread { name: "the pool's workers".to_owned(), source };
        let supervisor = Supervisor::start(Arc::clone(&state), workers, patience, priority).map_err(no_thread)?;
        let messages = supervisor.sender();
        let watch =
            thread::Builder::new().name("pool:watch".to_owned()).spawn(|| supervisor.watch()).map_err(|source| {
                state.sleep.stop();
                no_thread(source)
            })?;
        Ok(Self { state, all, messages, watch: Some(watch) })
    }

    fn end(&mut self) {
        self.state.sleep.stop();
        // the send fails only if the watchdog has already ended
        let _ = self.messages.send(Message::Stop);
        drop(self.watch.take().map(JoinHandle::join));
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.end();
    }
}

impl Run for Pool {
    fn now(&self) -> Duration {
        self.state.clock.now()
    }

    fn wait_until(&mut self, until: Duration) {
        super::clock::wait_until(&*self.state.clock, until);
    }

    fn spend(&mut self, _work: Duration) {}

    fn timeline(&self) -> Timeline {
        self.state.timeline.read()
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
        let shared = Arc::clone(&actor.shared);
        self.state.take_up(actor);
        Ok(AgentHandle { shared })
    }

    fn remove(&mut self, id: AgentId) -> Result<(), SendError> {
        self.all.leave(id)
    }

    fn shutdown(mut self: Box<Self>) -> Vec<AgentStats> {
        self.end();
        self.state.handles.iter().map(AgentHandle::stats).collect()
    }
}

#[cfg(test)]
mod tests;
