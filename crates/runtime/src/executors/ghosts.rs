//! A run of ghosts: agents whose steps are made elsewhere, and that are shown here.
//!
//! In: agents, their newest states and the time there. Out: the handles, slots and statistics of a run that steps. Never here: a turn, how
//! states come, what becomes of commands.

use super::archive::Absent;
use crate::Run;
use crate::agent::agent_spawn::AgentSpawn;
use crate::agent::agents::{Agents, RunAgents};
use crate::agent::handle::AgentHandle;
use crate::agent::spawn::{AssembledRun, RunError, assemble};
use crate::cluster::take_apart;
use crate::commands::mailbox::SendError;
use crate::records::metrics::AgentStats;
use crate::time::agent_clock::{SharedTimeline, Timeline, TimelineCommand};
use crate::time::clock::{Clock, SystemClock, wait_until};
use crate::turn::agent_runner::AgentRunner;
use crate::turn::helpers::Helpers;
use metachron_core::{AgentId, Archive, ArchiveError, SimTime, Snapshot};
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Agents whose steps are made elsewhere; copies are the same run. Its time stands where it was set to.
#[derive(Clone)]
pub struct Ghosts {
    all: RunAgents,
    clock: Arc<SystemClock>,
    timeline: Arc<SharedTimeline>,
    ghosts: Arc<Mutex<Vec<Ghost>>>,
}

/// An agent with the model that describes it and never steps.
struct Ghost {
    /// `None` of one that has left and is not kept.
    runner: Option<Box<AgentRunner>>,
    /// Its own time, and the steps that it had made then: its rate is counted from here.
    counted: (SimTime, u64),
}

/// The least time over which a rate is counted, seconds of the agent.
const RATE_WINDOW_S: f64 = 0.5;

impl Ghost {
    const fn of(runner: Option<Box<AgentRunner>>) -> Self {
        Self { runner, counted: (SimTime::ZERO, 0) }
    }

    /// Shows a state; of one that had left it is the first again.
    fn show(&mut self, agent: &AgentHandle, state: Arc<Snapshot>) {
        let Some(runner) = &mut self.runner else { return };
        let gauges = &runner.shared.gauges;
        gauges.set_resting(state.at_rest);
        gauges.steps.store(state.steps, Relaxed);
        // its rests are not known here
        let lived = state.time.since(SimTime::ZERO);
        gauges.stepped.store(lived.as_nanos(), Relaxed);
        gauges.mean_hz.set(state.steps as f64 / lived.as_secs_f64().max(f64::MIN_POSITIVE));
        let (since, steps) = self.counted;
        let passed_s = state.time.secs_after(since);
        // one that was put back to an earlier state counts anew
        if passed_s < 0.0 || state.steps < steps {
            self.counted = (state.time, state.steps);
        } else if passed_s >= RATE_WINDOW_S {
            gauges.rate_hz.set((state.steps - steps) as f64 / passed_s);
            self.counted = (state.time, state.steps);
        }
        runner.writer.replace(state);
        agent.record.set_left(false);
        runner.notify_reader();
    }
}

impl Ghosts {
    /// Begins with these agents in their first states, at time zero of `clock`.
    ///
    /// # Errors
    /// [`RunError`] for agents that cannot run as asked, here or elsewhere.
    pub fn start(spawns: Vec<AgentSpawn>, clock: Arc<SystemClock>) -> Result<Self, RunError> {
        let AssembledRun { actors, all } = assemble(spawns, Helpers::none())?;
        let placed = take_apart(actors.into_iter(), &all.handles).into_iter();
        let ghosts = placed.map(|placed| Ghost::of(placed.map(|placed| placed.runner))).collect();
        let timeline = SharedTimeline::new();
        timeline.drive(Duration::ZERO, TimelineCommand::Pause);
        Ok(Self { all, clock, timeline: Arc::new(timeline), ghosts: Arc::new(Mutex::new(ghosts)) })
    }

    fn ghosts(&self) -> MutexGuard<'_, Vec<Ghost>> {
        self.ghosts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Sets the time, which stands there.
    pub fn set_time(&self, time: SimTime) {
        let (now, known) = (self.clock.now(), self.timeline.read());
        self.timeline.set(known.set_to(now, now, time, &known));
    }

    /// Shows the newest state of an agent; nothing of a number without one.
    pub fn show(&self, id: AgentId, state: Arc<Snapshot>) {
        if let (Some(agent), Some(ghost)) = (self.all.handles.of(id), self.ghosts().get_mut(id.0 as usize)) {
            ghost.show(agent, state);
        }
    }

    /// Takes an agent out at once.
    pub fn leave(&self, id: AgentId) {
        if let Some(ghost) = self.ghosts().get_mut(id.0 as usize)
            && let Some(mut runner) = ghost.runner.take()
        {
            runner.take_out();
            *ghost = Ghost::of(runner.kept());
        }
    }

    /// Adds numbers, of which nothing is known but that their agents have left, until the next one is `next`.
    pub fn reach(&self, next: AgentId) {
        let mut ghosts = self.ghosts();
        self.all.reach(next.0 as usize, |_| None);
        ghosts.resize_with(self.all.handles.len(), || Ghost::of(None));
    }
}

impl Run for Ghosts {
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

    /// No turn is made here.
    fn set_stall_limit(&mut self, _limit: Duration) {}

    /// Time passes elsewhere alone.
    fn drive(&mut self, _drive: TimelineCommand) {}

    fn agents(&self) -> &Agents {
        &self.all.handles
    }

    fn add(&mut self, spawn: AgentSpawn) -> Result<AgentHandle, RunError> {
        let mut ghosts = self.ghosts();
        let runner = self.all.join(spawn, self.sim_now())?;
        let handle = self.all.handles[runner.id().0 as usize].clone();
        ghosts.push(Ghost::of(Some(runner)));
        Ok(handle)
    }

    fn remove(&mut self, id: AgentId) -> Result<(), SendError> {
        self.all.handles.of(id).ok_or(SendError::NoAgent(id))?;
        self.leave(id);
        Ok(())
    }

    /// The states from which agents go on are elsewhere.
    fn archive(&mut self, _archive: &mut Archive<'_>, _absent: Absent<'_>) -> Result<(), ArchiveError> {
        Err(ArchiveError::Refused { what: "a world that runs elsewhere, and is only shown here,".to_owned() })
    }

    fn end_turns(&mut self) {
        self.all.sleep.end();
    }

    fn shutdown(mut self: Box<Self>) -> Vec<AgentStats> {
        self.end_turns();
        self.all.handles.iter().map(AgentHandle::stats).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::executors::testing::Dummy;
    use crate::{AgentState, Lockstep, Machine, Reader};

    fn spawns() -> Vec<AgentSpawn> {
        vec![Dummy::new(1.0).at(100.0), Dummy::new(2.0).at(40.0)]
    }

    #[test]
    fn ghosts_show_the_states_of_a_run_that_steps_and_its_rates() {
        let mut run = Lockstep::start(spawns(), Machine::two_cores_software()).unwrap();
        let ghosts = Ghosts::start(spawns(), Arc::default()).unwrap();
        let mut reader = Reader::new(ghosts.agents());
        for frame in 1..=120_u64 {
            run.wait_until(Duration::from_millis(10 * frame));
            ghosts.set_time(run.sim_now());
            run.agents().iter().for_each(|agent| ghosts.show(agent.id(), agent.latest()));
            assert_eq!(ghosts.sim_now(), run.sim_now());
            let mut seen = 0;
            reader.read(ghosts.agents(), ghosts.sim_now(), |_, _, awake| seen += u32::from(awake));
            assert_eq!(seen, 2, "frame {frame}");
        }
        for (ghost, agent) in ghosts.agents().iter().zip(run.agents()) {
            assert!(Arc::ptr_eq(&ghost.latest(), &agent.latest()));
            let (shown, is) = (ghost.stats(), agent.stats());
            assert_eq!((shown.steps, shown.state), (is.steps, AgentState::Running));
            // a window of half a second has at most one step more or less
            assert!((shown.rate_hz - is.wanted_hz).abs() <= 2.01, "{} Hz", shown.rate_hz);
            assert!((shown.mean_hz - is.mean_hz).abs() <= 2.01, "{} and {} Hz", shown.mean_hz, is.mean_hz);
            assert_eq!(shown.lived, is.lived);
        }
    }

    #[test]
    fn a_ghost_leaves_comes_back_and_keeps_its_number() {
        let mut ghosts = Ghosts::start(spawns(), Arc::default()).unwrap();
        let first = ghosts.agents()[0].latest();
        ghosts.leave(AgentId(0));
        assert_eq!(ghosts.agents()[0].state(), AgentState::Gone);
        ghosts.show(AgentId(0), first);
        assert_eq!(ghosts.agents()[0].state(), AgentState::Running);
        ghosts.reach(AgentId(4));
        let joined = ghosts.add(Dummy::new(3.0).at(10.0)).unwrap();
        assert_eq!((joined.id(), ghosts.agents()[3].state()), (AgentId(4), AgentState::Gone));
        ghosts.show(AgentId(9), Arc::default());
        assert!(ghosts.save(&mut Archive::writer()).is_err());
        assert_eq!(Box::new(ghosts).shutdown().len(), 5);
    }
}
