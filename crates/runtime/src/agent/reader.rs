//! Reads the newest states of all agents, frame by frame, for display.
//!
//! In: a run's agents and the time of each frame. Out: the states, and which of them are new. Only changed agents are read.
//! Ages are nevertheless counted for every agent in every frame: for an unchanged agent they follow from the times of the frames, and are
//! counted when it changes. Never here: the use of the states.

use super::agents::Agents;
use super::handle::AgentHandle;
use crate::records::metrics::AgentState;
use metachron_core::{SimTime, Snapshot};
use std::collections::VecDeque;
use std::sync::Arc;

/// The ages of an unchanged agent are counted at least once in this many frames.
const FRAMES_KEPT: usize = 256;

/// Reads the agents of one run; a run has one reader.
#[derive(Debug)]
pub struct Reader {
    newest: Vec<Arc<Snapshot>>,
    readings: Vec<LastReading>,
    /// The times of the last frames.
    frames: VecDeque<SimTime>,
    /// Frames read so far.
    read: u64,
}

/// An agent at its last reading.
#[derive(Debug, Clone, Copy)]
struct LastReading {
    /// Number of frames up to which its ages are counted.
    counted: u64,
    time: SimTime,
    rests: bool,
}

impl Reader {
    /// A reader of `agents`, the agents of a run in the order of their numbers.
    #[must_use]
    pub fn new(agents: &Agents) -> Self {
        let newest: Vec<_> = agents.iter().map(AgentHandle::latest).collect();
        let readings =
            newest.iter().map(|state| LastReading { counted: 0, time: state.moment(), rests: false }).collect();
        Self { newest, readings, frames: VecDeque::with_capacity(2 * FRAMES_KEPT), read: 0 }
    }

    /// The states of the last reading, in the order of the agents.
    #[must_use]
    pub fn newest(&self) -> &[Arc<Snapshot>] {
        &self.newest
    }

    /// Reads the states for a frame at `now`; visits the agents whose state or condition has changed since the last frame, in their order,
    /// with the newest state and whether they are running. Agents that joined since are visited first.
    pub fn read(&mut self, agents: &Agents, now: SimTime, mut visit: impl FnMut(&AgentHandle, &Arc<Snapshot>, bool)) {
        self.join(agents, &mut visit);
        agents.sleep.changed.take(|id| {
            let at = id.0 as usize;
            let (Some(agent), true) = (agents.get(at), at < self.readings.len()) else { return };
            self.count(at, agent);
            let state = agent.state();
            self.newest[at] = agent.latest();
            let reading = &mut self.readings[at];
            (reading.time, reading.rests) = (self.newest[at].moment(), state == AgentState::Resting);
            visit(agent, &self.newest[at], state == AgentState::Running);
        });
        self.frames.push_back(now);
        self.read += 1;
        self.catch_up(agents);
    }

    /// Takes up agents that joined the run since the last frame.
    fn join(&mut self, agents: &Agents, visit: &mut impl FnMut(&AgentHandle, &Arc<Snapshot>, bool)) {
        while let Some(agent) = agents.get(self.newest.len()) {
            let state = agent.latest();
            self.readings.push(LastReading { counted: self.read, time: state.moment(), rests: false });
            visit(agent, &state, agent.state() == AgentState::Running);
            self.newest.push(state);
        }
    }

    /// Counts all ages that are not counted yet, at the end of a run.
    pub fn finish(&mut self, agents: &Agents) {
        for (at, agent) in agents.iter().enumerate().take(self.readings.len()) {
            self.count(at, agent);
        }
    }

    /// Counts the ages of agent `at` in the frames since its last count.
    fn count(&mut self, at: usize, agent: &AgentHandle) {
        let reading = &mut self.readings[at];
        let frames = (self.read - reading.counted) as usize;
        let first = self.frames.len().saturating_sub(frames);
        if reading.rests {
            agent.record_no_age(self.frames.len() - first);
        } else {
            agent.record_ages(self.frames.iter().skip(first).map(|now| now.since(reading.time)));
        }
        reading.counted = self.read;
    }

    /// Counts some of the unchanged agents, so that no agent is behind by more frames than are stored.
    fn catch_up(&mut self, agents: &Agents) {
        let share = agents.len().div_ceil(FRAMES_KEPT);
        let from = (self.read as usize % FRAMES_KEPT) * share;
        for (at, agent) in agents.iter().enumerate().take(self.readings.len()).skip(from).take(share) {
            self.count(at, agent);
        }
        if self.frames.len() == 2 * FRAMES_KEPT {
            self.frames.drain(..FRAMES_KEPT);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::executors::testing;
    use crate::executors::testing::Dummy;
    use crate::{Command, Lockstep, Machine, Run};
    use metachron_core::AgentId;
    use std::time::Duration;

    /// Rates of 1 to 30 Hz, one agent that goes to rest and one that fails.
    fn run() -> Box<Lockstep> {
        let mut spawns: Vec<_> = [30.0, 7.0, 2.0, 1.0].map(|hz| Dummy::new(1.0).at(hz)).into();
        spawns.push(Dummy { rest_from: Some(5), ..Dummy::new(1.0) }.at(10.0));
        spawns.push(Dummy { fault: Some((4, testing::Fault::Diverged)), ..Dummy::new(1.0) }.at(10.0));
        Box::new(Lockstep::start(spawns, Machine::two_cores_software()).unwrap())
    }

    #[test]
    fn reading_changed_agents_gives_the_same_as_reading_all() {
        let (mut ours, mut plain) = (run(), run());
        let mut reader = Reader::new(ours.agents());
        let (mut visits, mut last) = (0, vec![true; 6]);
        for frame in 1..=700_u64 {
            let wall = Duration::from_millis(16 * frame);
            ours.wait_until(wall);
            plain.wait_until(wall);
            if frame == 300 {
                [&ours, &plain].iter().for_each(|run| run.send(AgentId(4), Command::wake()).unwrap());
            }
            let now = ours.sim_now();
            reader.read(ours.agents(), now, |agent, _, awake| {
                visits += 1;
                last[agent.id().0 as usize] = awake;
            });
            for (agent, newest) in plain.agents().iter().zip(reader.newest()) {
                let state = agent.latest();
                assert_eq!((state.time, state.steps), (newest.time, newest.steps), "frame {frame}");
                assert_eq!(last[agent.id().0 as usize], agent.state() == AgentState::Running);
                agent.record_age(agent.age_s(&state, now));
            }
        }
        reader.finish(ours.agents());
        for (ours, plain) in ours.agents().iter().zip(plain.agents()) {
            assert_eq!(ours.stats().age, plain.stats().age, "{}", ours.name());
        }
        // 11.2 s of 40 turns a second, not 700 frames of six agents
        assert!((400..500).contains(&visits), "{visits}");
    }

    #[test]
    fn a_frame_without_changes_allocates_nothing_and_visits_no_agent() {
        let mut run = run();
        run.wait_until(Duration::from_millis(100));
        let mut reader = Reader::new(run.agents());
        // every agent's first age makes a page, within as many frames as are kept
        (0..600).for_each(|_| reader.read(run.agents(), run.sim_now(), |_, _, _| ()));
        let frames = allocation_counter::measure(|| {
            for _ in 0..1000 {
                reader.read(run.agents(), run.sim_now(), |_, _, _| panic!("nothing has happened"));
            }
        });
        assert_eq!(frames.count_total, 0, "{frames:?}");
    }
}
