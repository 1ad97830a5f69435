//! One thread, virtual time, declared costs: the executor for tests, tuning, charts and replay.
//!
//! In: agents and a [`Machine`]. Out: a run that is bit-identical every time. Events happen in the order (time, ends before starts,
//! number): a turn sees the states published when it starts, and its own state is seen when its declared cost has passed, on cores that all
//! turns and the frame loop share; at the free pace at once. Never here: a wall clock, except for the CPU time that is reported and for steps that do
//! not end ([`crate::turn::watchdog`]).

mod cores;
mod divided;

use super::archive::{Absent, Cut};
use crate::Run;
use crate::agent::agent_spawn::AgentSpawn;
use crate::agent::agents::Agents;
use crate::agent::agents::RunAgents;
use crate::agent::handle::AgentHandle;
use crate::agent::spawn::{AssembledRun, RunError, assemble};
use crate::cluster::{Place, Placed, close_remaining, hand_over, put_back, take_apart};
use crate::commands::mailbox::SendError;
use crate::records::metrics::AgentStats;
use crate::records::turns::Took;
use crate::time::agent_clock::{Timeline, TimelineCommand};
use crate::time::cpu::CpuBatch;
use crate::time::machine::{FACTOR, Machine, duration};
use crate::time::virtual_events::{FRAME, Phase, Turn, VirtualEvents};
use crate::turn::agent_runner::{AgentRunner, Effort, Next};
use crate::turn::helpers::Helpers;
use crate::turn::watchdog::UnwatchedTurns;
use cores::Cores;
use divided::Division;
use metachron_core::{AgentId, Archive, ArchiveError};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Agents in virtual time on a declared machine.
pub struct Lockstep {
    machine: Machine,
    timeline: Timeline,
    now: Duration,
    entries: Vec<AgentEntry>,
    /// Due times of the turns of waiting agents, without turns that the timeline never reaches.
    due: BinaryHeap<Reverse<(Duration, u32)>>,
    cores: Cores,
    all: RunAgents,
    batch: CpuBatch,
    /// Agents that have made turns in the open batch.
    unsettled: Vec<u32>,
    /// Storage: the jobs of a turn.
    jobs: Vec<Duration>,
    unwatched: Arc<UnwatchedTurns>,
    turns: u64,
    division: Division,
}

/// An agent and the phase of its turns.
struct AgentEntry {
    /// `None` while another agent leads it.
    actor: Option<Box<AgentRunner>>,
    phase: Phase,
    turns: u64,
}

impl Lockstep {
    /// Begins a run at virtual time zero.
    ///
    /// # Errors
    /// [`RunError`] for agents that cannot run as asked.
    pub fn start(spawns: Vec<AgentSpawn>, machine: Machine) -> Result<Self, RunError> {
        let AssembledRun { actors, all } = assemble(spawns, Helpers::none())?;
        let phase = |actor: &Option<Box<AgentRunner>>| match actor {
            None => Phase::Led,
            Some(actor) if actor.is_parked() => Phase::Parked,
            Some(_) => Phase::Waiting,
        };
        let entries = actors.into_iter().map(|actor| AgentEntry { phase: phase(&actor), actor, turns: 0 }).collect();
        let (timeline, cores) = (Timeline::new(), Cores::new(machine.cores));
        let (due, batch, unsettled) = (BinaryHeap::with_capacity(all.handles.len()), CpuBatch::default(), Vec::new());
        let now = Duration::ZERO;
        let (jobs, turns, unwatched) = (Vec::new(), 0, UnwatchedTurns::new(&all.handles));
        let division = Division::default();
        let mut run = Self {
            machine,
            timeline,
            now,
            entries,
            due,
            cores,
            all,
            batch,
            unsettled,
            jobs,
            unwatched,
            turns,
            division,
        };
        run.schedule_all();
        Ok(run)
    }

    /// The declared machine.
    #[must_use]
    pub const fn machine(&self) -> &Machine {
        &self.machine
    }

    fn schedule_all(&mut self) {
        self.due.clear();
        for agent in 0..self.entries.len() {
            self.schedule(agent);
        }
    }

    /// Schedules the next turn, if the agent waits for one.
    fn schedule(&mut self, agent: usize) {
        let entry = &self.entries[agent];
        if entry.phase == Phase::Waiting
            && !self.division.is_away(agent)
            && let Some(due) = entry.actor.as_ref().and_then(|actor| actor.pace.due(&self.timeline))
        {
            self.due.push(Reverse((due.max(self.now), agent as u32)));
        }
    }

    /// Serves the notified agents: sleepers that are woken, and agents that return from a leader.
    fn wake_sleepers(&mut self) {
        if !self.all.sleep.take_notified() {
            return;
        }
        for agent in 0..self.entries.len() {
            if self.division.is_away(agent) {
                continue;
            }
            let entry = &mut self.entries[agent];
            match (entry.phase, &mut entry.actor) {
                (Phase::Resting, Some(actor)) => {
                    if !actor.try_wake(&self.timeline, self.now) {
                        continue;
                    }
                    entry.phase = Phase::Waiting;
                }
                (Phase::Led, _) => {
                    let returned = self.all.handles[agent].take_returned();
                    let Some(actor) = returned else { continue };
                    entry.phase = if actor.is_parked() { Phase::Parked } else { Phase::Waiting };
                    entry.actor = actor.kept();
                }
                _ => continue,
            }
            self.schedule(agent);
        }
    }

    /// Advances to the next event; `None` if there is none up to `limit`.
    fn next_event(&mut self, limit: Duration) -> Option<Event> {
        self.wake_sleepers();
        let end = self.cores.until_end().map(|span| self.now.saturating_add(span));
        // at the free pace a turn that is due at the end belongs to the time after it, as no turn is in progress there
        let begins = |due: &Duration| *due < limit || !self.timeline.is_free();
        let due = self.due.peek().map(|&Reverse((due, _))| due).filter(begins);
        let at = end.into_iter().chain(due).min()?;
        if at > limit {
            return None;
        }
        self.cores.pass(at - self.now);
        self.now = at;
        // time advanced to the end of a job or to a due turn, whichever was first
        match self.cores.take_ended() {
            Some(agent) => Some(Event::End(agent)),
            None => self.due.pop().map(|Reverse((_, agent))| Event::Start(agent)),
        }
    }

    /// Processes events until `limit`, or until the frame's own job has ended, an agent of a divided run has left its box, or another thread has
    /// ended the run ([`Agents::end_stalled`]).
    fn run(&mut self, limit: Duration) {
        while !self.has_ended()
            && let Some(event) = self.next_event(limit)
        {
            match event {
                Event::Start(agent) => self.begin(agent as usize),
                Event::End(FRAME) => break,
                Event::End(agent) => self.finish(agent as usize),
            }
        }
        self.settle();
    }

    /// Whether no further turn is to begin; one that has begun ends first where an agent has left its box.
    fn has_ended(&self) -> bool {
        self.all.sleep.stopping() || (self.division.has_escaped() && self.cores.until_end().is_none())
    }

    fn begin(&mut self, agent: usize) {
        self.batch.open();
        let started = Instant::now();
        let entry = &mut self.entries[agent];
        let Some(actor) = &mut entry.actor else { return };
        self.turns += 1;
        let turn = self.unwatched.begin(self.turns, actor.id(), started);
        let effort = actor.begin(&self.timeline, self.now);
        self.unwatched.end(turn);
        match effort {
            Some(Effort { work, steps }) => {
                // at the free pace turns take no time
                let slower = if self.timeline.is_free() { 0.0 } else { self.machine.slower(self.now) };
                let price =
                    |model, work| duration(self.machine.step_s(model, work, agent as u64, entry.turns) * slower);
                self.jobs.clear();
                if actor.cluster.is_some() && steps > 0 {
                    self.jobs.extend(actor.member_costs().map(|cost| price(cost.model, cost.work)));
                    join(&mut self.jobs, self.machine.cores);
                    // one thread factors for all members
                    if let (Some(solved), Some(longest)) = (actor.solved(), self.jobs.iter_mut().max()) {
                        *longest += price(FACTOR, f64::from(solved.of_problem())) * solved.factors;
                    }
                } else {
                    self.jobs.push(price(actor.shared.model(), work) * steps);
                }
                self.jobs.iter().for_each(|job| self.cores.start(agent as u32, *job));
                let [all, longest] = [self.jobs.iter().sum(), self.jobs.iter().copied().max().unwrap_or_default()];
                let cores = if longest.is_zero() { 1.0 } else { all.div_duration_f64(longest) };
                entry.turns += 1;
                entry.phase = Phase::Busy(Turn { since: self.now, jobs: self.jobs.len() as u32, cores });
            }
            None => entry.phase = Phase::Parked,
        }
        self.check_fences(agent);
        self.count_cpu(agent, started.elapsed());
        if self.entries[agent].phase == Phase::Parked {
            self.free(agent);
        }
    }

    fn finish(&mut self, agent: usize) {
        let entry = &mut self.entries[agent];
        let (Phase::Busy(turn), Some(actor)) = (&mut entry.phase, &mut entry.actor) else { return };
        turn.jobs -= 1;
        if turn.jobs > 0 {
            return;
        }
        self.batch.open();
        let started = Instant::now();
        let took = (self.now - turn.since).as_secs_f64() * turn.cores;
        let next = actor.finish(&self.timeline, Took { begun: turn.since, ended: self.now }, took);
        entry.phase = match next {
            Next::Due | Next::Join(_) => Phase::Waiting,
            Next::Rest => Phase::Resting,
            Next::Parked => Phase::Parked,
        };
        self.count_cpu(agent, started.elapsed());
        if let Next::Join(leader) = next {
            self.hand_over(agent, leader);
        }
        self.schedule(agent);
    }

    /// Hands an agent over to `leader`, if the leader accepts it now.
    fn hand_over(&mut self, agent: usize, leader: AgentId) {
        self.settle();
        let entry = &mut self.entries[agent];
        entry.actor = entry.actor.take().and_then(|actor| hand_over(actor, leader).err());
        if entry.actor.is_none() {
            entry.phase = Phase::Led;
        }
    }

    /// Frees the runner of an agent that has left, where it is not kept.
    fn free(&mut self, agent: usize) {
        self.settle();
        let entry = &mut self.entries[agent];
        entry.actor = entry.actor.take().and_then(AgentRunner::kept);
    }

    fn count_cpu(&mut self, agent: usize, wall: Duration) {
        if let Some(actor) = &mut self.entries[agent].actor {
            if actor.unsettled_ns == 0 {
                self.unsettled.push(agent as u32);
            }
            actor.count(wall);
        }
        if self.batch.add(wall) {
            self.settle();
        }
    }

    /// Ends all agents, whatever their phase.
    fn end(&mut self) {
        self.end_turns();
        let actors = self.entries.drain(..).filter_map(|entry| entry.actor);
        actors.for_each(|mut actor| actor.close_account(&self.timeline, self.now));
        close_remaining(&self.all.handles, &self.timeline, self.now);
    }

    /// Writes or reads all agents, which were taken from their places, and the events to come; a cut of a run in real time has none of these.
    fn archive_all(
        &mut self,
        cut: &mut Cut,
        archive: &mut Archive<'_>,
        absent: Absent<'_>,
    ) -> Result<(), ArchiveError> {
        let phases = self.entries.iter().map(|entry| (entry.phase, entry.turns)).collect();
        let (served, jobs) = self.cores.jobs();
        let events = VirtualEvents { due: self.due.clone(), served, jobs, phases };
        let events = cut.archive(archive, absent, Some(events))?;
        if !archive.is_reading() {
            return Ok(());
        }
        let (own, own_now) = (self.timeline, self.now);
        (self.timeline, self.now) = (cut.timeline, cut.now);
        self.entries.resize_with(cut.all.len(), || AgentEntry { actor: None, phase: Phase::Parked, turns: 0 });
        let Some(VirtualEvents { due, served, jobs, phases }) = events else {
            // a world in real time stands still where it was cut; whether this one does is its own matter
            self.timeline = own.set_to(own_now, cut.now, cut.timeline.sim_at(cut.now), &cut.timeline);
            self.due.clear();
            self.cores = Cores::new(self.machine.cores);
            for (entry, one) in self.entries.iter_mut().zip(&cut.all) {
                (entry.phase, entry.turns) = (one.as_ref().map_or(Phase::Parked, phase_of), 0);
            }
            // some may have been notified just before
            cut.all.iter().flatten().for_each(|placed| self.all.sleep.notify(placed.runner.id()));
            return Ok(());
        };
        self.cores.set_jobs(served, jobs);
        self.due = due;
        let phases = phases.into_iter().chain(std::iter::repeat((Phase::Parked, 0)));
        self.entries.iter_mut().zip(phases).for_each(|(entry, (phase, turns))| {
            (entry.phase, entry.turns) = (phase, turns);
        });
        Ok(())
    }

    fn settle(&mut self) {
        if self.batch.is_empty() {
            return;
        }
        let share = self.batch.close();
        for agent in self.unsettled.drain(..) {
            if let Some(actor) = &mut self.entries[agent as usize].actor {
                actor.settle(share);
            }
        }
    }
}

impl Drop for Lockstep {
    fn drop(&mut self) {
        self.end();
    }
}

/// Joins the steps of a cluster's members, side by side, to as many jobs as there are cores: the dearest first, each to the job that has
/// least. The turn ends with the last job.
fn join(jobs: &mut Vec<Duration>, cores: u32) {
    let cores = cores.max(1) as usize;
    jobs.sort_unstable_by_key(|job| Reverse(*job));
    for at in cores..jobs.len() {
        let more = jobs[at];
        if let Some(least) = jobs[..cores].iter_mut().min() {
            *least += more;
        }
    }
    jobs.truncate(cores);
}

/// The phase of an agent between two of its turns.
fn phase_of(Placed { runner, place }: &Placed) -> Phase {
    match place {
        Place::Home if runner.is_parked() => Phase::Parked,
        Place::Home if runner.shared.gauges.is_resting() => Phase::Resting,
        Place::Home => Phase::Waiting,
        Place::Led { .. } | Place::Waiting { .. } | Place::Returning => Phase::Led,
    }
}

/// An event in virtual time.
enum Event {
    /// An agent's turn begins.
    Start(u32),
    /// The job of an agent, or of the frame, ends.
    End(u32),
}

impl Run for Lockstep {
    fn now(&self) -> Duration {
        self.now
    }

    fn wait_until(&mut self, until: Duration) {
        if until < self.now {
            return;
        }
        self.run(until);
        if self.all.sleep.stopping() || self.division.has_escaped() {
            return;
        }
        self.cores.pass(until - self.now);
        self.now = until;
    }

    fn spend(&mut self, work: Duration) {
        self.cores.start(FRAME, work);
        self.run(Duration::MAX);
    }

    fn timeline(&self) -> Timeline {
        self.timeline
    }

    fn set_stall_limit(&mut self, limit: Duration) {
        self.unwatched.set_limit(limit);
    }

    fn drive(&mut self, drive: TimelineCommand) {
        self.timeline = self.timeline.after(self.now, drive);
        self.schedule_all();
    }

    fn agents(&self) -> &Agents {
        &self.all.handles
    }

    fn add(&mut self, spawn: AgentSpawn) -> Result<AgentHandle, RunError> {
        let actor = self.all.join(spawn, self.sim_now())?;
        let (agent, handle) = (self.entries.len(), self.all.handles[actor.id().0 as usize].clone());
        let phase = if actor.is_parked() { Phase::Parked } else { Phase::Waiting };
        self.entries.push(AgentEntry { actor: Some(actor), phase, turns: 0 });
        self.schedule(agent);
        Ok(handle)
    }

    fn archive(&mut self, archive: &mut Archive<'_>, absent: Absent<'_>) -> Result<(), ArchiveError> {
        if !archive.is_reading() && self.division.is_divided() {
            return Err(ArchiveError::Refused { what: "a world that others make a part of".to_owned() });
        }
        self.settle();
        let all = take_apart(self.entries.iter_mut().map(|entry| entry.actor.take()), &self.all.handles);
        let mut cut = Cut::new(all, self.all.clone(), self.timeline, self.now);
        let outcome = self.archive_all(&mut cut, archive, absent);
        let homes = put_back(cut.all, &self.all.handles);
        for (entry, home) in self.entries.iter_mut().zip(homes) {
            entry.actor = home;
            if entry.actor.as_ref().is_some_and(|actor| actor.is_parked()) {
                entry.phase = Phase::Parked;
            }
        }
        if archive.is_reading() && outcome.is_ok() {
            self.division.end();
        }
        if archive.is_reading() && self.due.is_empty() {
            self.schedule_all();
        }
        outcome
    }

    fn remove(&mut self, id: AgentId) -> Result<(), SendError> {
        if self.division.is_away(id.0 as usize) {
            return self.take_out(id);
        }
        let home = self.entries.get_mut(id.0 as usize).map(|entry| &mut entry.actor);
        self.all.leave(id, home.unwrap_or(&mut None))
    }

    fn as_lockstep(&mut self) -> Option<&mut Self> {
        Some(self)
    }

    /// No turn is in progress between two calls.
    fn end_turns(&mut self) {
        self.all.sleep.end();
    }

    fn shutdown(mut self: Box<Self>) -> Vec<AgentStats> {
        self.end();
        self.all.handles.iter().map(AgentHandle::stats).collect()
    }
}

#[cfg(test)]
mod tests;
