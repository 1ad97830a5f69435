//! Default executor in real time: a thread per agent.
//!
//! In: agents and a [`Clock`]. Out: [`Run`]. A thread sleeps until its agent is due and is woken by a command, a touch, a changed timeline
//! and the end; a thread whose agent rests or is led by another sleeps without a timer, a thread whose agent is parked ends.
//! Never here: virtual time, declared costs.

use super::Run;
use super::agent_clock::{SharedTimeline, Timeline, TimelineCommand};
use super::agent_runner::{AgentRunner, Next};
use super::agents::Agents;
use super::archive::{Absent, Cut, CutBetweenTurns};
use super::clock::{Clock, wait_until};
use super::cluster::{Handover, close_remaining, hand_over, put_back, take_apart};
use super::cpu::CpuBatch;
use super::handle::{AgentHandle, Shared};
use super::helpers::Helpers;
use super::mailbox::SendError;
use super::metrics::AgentStats;
use super::priority::Priority;
use super::sleep::Halt;
use super::spawn::{AgentSpawn, AssembledRun, RunAgents, RunError, assemble};
use super::turn_order::{Held, PartKind, TurnOrder, in_force};
use super::turn_parts::Begun;
use super::turns::Took;
use metachron_core::{AgentId, Archive, ArchiveError};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// The most agents with a thread each; beyond, waking them costs more than their steps.
pub const THREADS_MAX: usize = 1000;

/// Up to this many agents have a thread each if the scene names no executor: 10 agents of 200 Hz cost 15 µs a turn on threads and 20 in a
/// pool, 100 cost 10 and 6 (`docs/throughput.md`).
pub const AUTO_THREADS_MAX: usize = 64;

/// An agent that is behind keeps its core for this long, then yields it: of a thousand threads that have more to do than two cores can, each waits
/// for tenths of a second then. The system's own slices, milliseconds each, would let it wait for seconds.
const CATCH_UP_MAX: Duration = Duration::from_micros(20);

/// A thread that gives back its agent when it ends, if it has it.
type Ended = JoinHandle<Option<Box<AgentRunner>>>;

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
}

impl Threads {
    /// Gives every agent its thread; simulated time is paused until [`TimelineCommand::Run`]. If the system refuses `priority` ([`Priority::ask`])
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
        let mut run = Self { clock, timeline, all, threads, ended_agents, farewells, ended, priority, order };
        for (actor, id) in actors.into_iter().zip((0..).map(AgentId)) {
            // on an error the run so far is dropped, which ends its threads
            run.begin(id, actor)?;
        }
        Ok(run)
    }

    /// Gives an agent its thread.
    fn begin(&mut self, id: AgentId, actor: Option<Box<AgentRunner>>) -> Result<(), RunError> {
        let Some(shared) = self.all.handles.of(id).and_then(AgentHandle::live).map(|shared| Arc::clone(&shared)) else {
            return Ok(());
        };
        self.threads.insert(id, self.spawn(actor, shared)?);
        Ok(())
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
        let actor = self.threads.remove(&id).and_then(|thread| thread.join().ok().flatten());
        self.all.sleep.set_thread(id, None);
        self.ended_agents.extend(actor.and_then(AgentRunner::kept).map(|actor| (id, actor)));
    }

    fn spawn(&self, actor: Option<Box<AgentRunner>>, shared: Arc<Shared>) -> Result<Ended, RunError> {
        let name = format!("agent:{}", shared.name().replace('\0', ""));
        let stage = AgentThread {
            clock: Arc::clone(&self.clock),
            timeline: Arc::clone(&self.timeline),
            batch: CpuBatch::default(),
            order: self.order.clone(),
            awake: Duration::ZERO,
        };
        let farewell = EndNotice { id: shared.id, ended: self.farewells.clone() };
        let builder = thread::Builder::new().name(name.clone());
        let priority = self.priority;
        let body = move || {
            let _farewell = farewell;
            // a refusal was already reported to the caller of `Priority::ask`
            drop(priority.take());
            // by itself: where the agent is given back before another thread registers this one, no thread is woken
            shared.sleep.set_thread(shared.id, Some(thread::current()));
            stage.run(actor, &shared)
        };
        builder.spawn(body).map_err(|error| RunError::NoThread { name, error })
    }

    /// Ends all threads and waits for them: at the end of the run until a timeout, where a step that takes longer counts as hung, and its thread
    /// is left behind. Gives back the agents that make turns of their own.
    fn halt(&mut self, why: Halt) -> Vec<Option<Box<AgentRunner>>> {
        self.all.sleep.stop();
        let mut patience = Duration::ZERO;
        while !self.threads.is_empty() {
            patience = self.all.sleep.end_patience(self.threads.keys().copied());
            let ended = match why {
                Halt::End => self.ended.recv_timeout(patience).ok(),
                Halt::Cut => self.ended.recv().ok(),
            };
            let Some(id) = ended else { break };
            self.join(id);
        }
        for shared in self.threads.keys().filter_map(|id| self.all.handles.of(*id)?.live()) {
            shared.gauges.park(format!("a step did not end within {} s", patience.as_secs_f64()));
        }
        self.threads.clear();
        let mut homes: Vec<_> = self.all.handles.iter().map(|_| None).collect();
        let ended = std::mem::take(&mut self.ended_agents);
        ended.into_iter().for_each(|(id, actor)| homes[id.0 as usize] = Some(actor));
        homes
    }

    /// Gives the agents their threads again.
    fn go_on(&mut self, homes: Vec<Option<Box<AgentRunner>>>) -> Result<(), RunError> {
        self.all.sleep.go_on();
        for (mut actor, id) in homes.into_iter().zip((0..).map(AgentId)) {
            match actor.take_if(|actor| actor.is_parked()) {
                Some(actor) => drop(self.ended_agents.insert(id, actor)),
                None => self.begin(id, actor)?,
            }
        }
        Ok(())
    }

    fn end(&mut self) {
        self.end_turns();
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
        let homes = self.halt(Halt::Cut);
        let all = take_apart(homes.into_iter(), &self.all.handles);
        let mut cut = Cut::new(all, self.all.clone(), self.timeline.read(), self.clock.now());
        cut.most = THREADS_MAX;
        let outcome = act(&mut cut, &mut self.order);
        if cut.timeline != self.timeline.read() {
            self.timeline.set(cut.timeline);
        }
        let gone_on = self.go_on(put_back(cut.all, &self.all.handles));
        let no_thread = |error: RunError| ArchiveError::Refused { what: format!("a run that cannot go on ({error})") };
        outcome.and(gone_on.map_err(no_thread))
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
        let actor = self.all.join(spawn, self.sim_now())?;
        let id = actor.id();
        self.begin(id, Some(actor))?;
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
        let homes = self.halt(Halt::End).into_iter();
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

/// Working state of an agent's thread.
struct AgentThread {
    clock: Arc<dyn Clock>,
    timeline: Arc<SharedTimeline>,
    batch: CpuBatch,
    order: Option<Arc<TurnOrder>>,
    /// How long it has made turns since it last slept or yielded its core.
    awake: Duration,
}

impl AgentThread {
    /// The thread's main loop: turn after turn until the agent is asked to end, or is parked. While it is led, its leader has the actor.
    fn run(mut self, mut here: Option<Box<AgentRunner>>, shared: &Shared) -> Option<Box<AgentRunner>> {
        while !shared.sleep.stopping() {
            here = match here {
                Some(actor) => match self.make_own_turns(actor) {
                    Some(actor) if actor.is_parked() => return actor.kept(),
                    moved => moved,
                },
                None => self.wait_for(shared.handover()),
            };
        }
        here.iter_mut().for_each(|actor| self.settle(actor));
        here
    }

    /// Makes the turns of `actor` until it hands them over (`None`), is asked to end, or is parked.
    fn make_own_turns(&mut self, mut actor: Box<AgentRunner>) -> Option<Box<AgentRunner>> {
        let sleep = Arc::clone(&actor.shared.sleep);
        let mut next = self.take_up(&mut actor);
        while !sleep.stopping() {
            next = match next {
                Next::Due => self.wait_or_turn(&mut actor),
                Next::Rest => self.rest(&mut actor),
                Next::Join(leader) => {
                    self.settle(&mut actor);
                    actor = self.hand_over(actor, leader).err()?;
                    Next::Due
                }
                Next::Parked => {
                    self.settle(&mut actor);
                    break;
                }
            };
        }
        Some(actor)
    }

    /// How `actor` goes on, of which this thread has just taken the turns.
    fn take_up(&mut self, actor: &mut AgentRunner) -> Next {
        let order = in_force(&mut self.order);
        let mut held = order.as_deref().map(TurnOrder::hold);
        let (timeline, now) = (self.timeline.read(), self.clock.now());
        if let (Some(held), true) = (&mut held, actor.open.is_some()) {
            held.note(PartKind::Show, actor.id(), now);
        }
        actor.next(&timeline, now)
    }

    /// Hands `actor` over to `leader`, if that admits it now.
    fn hand_over(&mut self, actor: Box<AgentRunner>, leader: AgentId) -> Result<(), Box<AgentRunner>> {
        let order = in_force(&mut self.order);
        let mut held = order.as_deref().map(TurnOrder::hold);
        held.iter_mut().for_each(|held| held.note(PartKind::Join, actor.id(), self.clock.now()));
        hand_over(actor, leader)
    }

    /// Waits until the agent returns from its leader.
    fn wait_for(&self, handover: Option<&Handover>) -> Option<Box<AgentRunner>> {
        let returned = handover.and_then(Handover::take_returned);
        if returned.is_none() {
            thread::park();
        }
        returned
    }

    /// Makes a turn if one is due, else sleeps until it is. A wake in between ends the sleep early, which is harmless.
    fn wait_or_turn(&mut self, actor: &mut AgentRunner) -> Next {
        let order = in_force(&mut self.order);
        let held = order.as_deref().map(TurnOrder::hold);
        let timeline = self.timeline.read();
        let now = self.clock.now();
        match actor.pace.due(&timeline) {
            Some(due) if due <= now && self.awake >= CATCH_UP_MAX => {
                drop(held);
                thread::yield_now();
                self.awake = Duration::ZERO;
                Next::Due
            }
            Some(due) if due <= now => self.turn(actor, &timeline, now, held),
            Some(due) => {
                drop(held);
                self.awake = Duration::ZERO;
                thread::park_timeout(due - now);
                Next::Due
            }
            None => {
                drop(held);
                self.settle(actor);
                thread::park();
                Next::Due
            }
        }
    }

    fn rest(&mut self, actor: &mut AgentRunner) -> Next {
        let order = in_force(&mut self.order);
        let mut held = order.as_deref().map(TurnOrder::hold);
        let (timeline, now) = (self.timeline.read(), self.clock.now());
        if actor.try_wake(&timeline, now) {
            held.iter_mut().for_each(|held| held.note(PartKind::Wake, actor.id(), now));
            return Next::Due;
        }
        drop(held);
        self.settle(actor);
        thread::park();
        Next::Rest
    }

    fn turn(&mut self, actor: &mut AgentRunner, timeline: &Timeline, began: Duration, held: Option<Held<'_>>) -> Next {
        self.batch.open();
        let started = Instant::now();
        let Begun { effort, mut held } = actor.begin_in(timeline, began, held);
        let now = self.clock.now();
        held.iter_mut().for_each(|held| held.note_end(now));
        let next = match effort {
            None => Next::Parked,
            Some(_) => {
                let turn_s = now.saturating_sub(began).as_secs_f64();
                actor.finish(timeline, Took { begun: began, ended: now }, turn_s)
            }
        };
        drop(held);
        let wall = started.elapsed();
        actor.count(wall);
        self.awake += wall;
        if self.batch.add(wall) {
            self.settle(actor);
        }
        next
    }

    fn settle(&mut self, actor: &mut AgentRunner) {
        if !self.batch.is_empty() {
            actor.settle(self.batch.close());
        }
    }
}

#[cfg(test)]
mod tests;
