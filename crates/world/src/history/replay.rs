//! A run that repeats a recording, and takes no other commands.
//!
//! In: a run from the recorded scene, in lockstep or one that follows turns in real time, a [`Recording`]. Out: the same bits, as far as its reader lets time pass.
//! Never here: the file, what governors answer ([`super::log`]).

use super::checkpoint::{Checkpoint, SceneIdentity};
use super::log::Log;
use super::recording::{Entry, Recording};
use super::saved::read_state;
use crate::description::builder::Part;
use crate::start::joined::{JoinedPart, JoinedTable, Joining};
use metachron_core::{AgentId, Archive, ArchiveError, SimTime};
use metachron_runtime::{
    Absent, AgentHandle, AgentSpawn, AgentStats, Agents, Follower, Lockstep, PartKind, Run, RunError, SendError,
    Timeline, TimelineCommand, TurnPart, state_hash,
};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// A run that follows a recording.
pub(super) struct Player {
    pub run: Followed,
    pub recording: Recording,
    /// Entries that are played.
    pub played: usize,
    /// Parts of turns of the entry played last that are to be made.
    pub turns: VecDeque<TurnPart>,
    /// In real time, when the next object that joins begins, and into which state all are put next.
    pub present: Option<SimTime>,
    pub restored: Option<Checkpoint>,
    /// It plays no further than to this time.
    pub until: Option<SimTime>,
    pub log: Arc<Log>,
    pub joining: Joining,
    pub identity: SceneIdentity,
    pub joined: Arc<JoinedTable>,
}

/// The run that repeats the calls.
pub(super) enum Followed {
    Lockstep(Box<Lockstep>),
    RealTime(Box<Follower>),
}

impl Followed {
    fn run(&self) -> &dyn Run {
        match self {
            Self::Lockstep(run) => &**run,
            Self::RealTime(run) => &**run,
        }
    }

    fn run_mut(&mut self) -> &mut dyn Run {
        match self {
            Self::Lockstep(run) => &mut **run,
            Self::RealTime(run) => &mut **run,
        }
    }

    fn follower(&mut self) -> Result<&mut Follower, String> {
        match self {
            Self::RealTime(run) => Ok(run),
            Self::Lockstep(_) => Err("the recording of a world in lockstep has turns".to_owned()),
        }
    }
}

impl Player {
    /// Plays whole entries until time has come to `until`: a wait in two parts is not always the same to the bit, so that one that waits
    /// longer ends later. Calls at the same moment belong to it.
    fn play(&mut self, until: Duration) {
        loop {
            let outcome = match self.turns.pop_front() {
                Some(part) if part.wall > until => {
                    self.turns.push_front(part);
                    break;
                }
                Some(part) => self.make(part),
                None => {
                    let Some(entry) = self.recording.entries.get(self.played) else { break };
                    if matches!(entry, Entry::Wait(_) | Entry::Spend(_)) && self.run.run().now() >= until {
                        return;
                    }
                    let entry = entry.clone();
                    self.played += 1;
                    self.play_entry(entry)
                }
            };
            let is_over = outcome.is_err() || self.until.is_some_and(|until| self.run.run().sim_now() >= until);
            if is_over {
                self.played = self.recording.entries.len();
                self.turns.clear();
            }
            let played = if self.turns.is_empty() { self.played } else { self.played - 1 };
            self.log.note_played(played, outcome.err());
        }
        if let Followed::RealTime(run) = &mut self.run {
            run.wait_until(until);
        }
    }

    /// Makes a part of a turn.
    fn make(&mut self, part: TurnPart) -> Result<(), String> {
        if part.kind != PartKind::Restore {
            return self.run.follower()?.make(part);
        }
        let checkpoint = self.restored.take().ok_or("the recording does not have the state that was restored")?;
        let Self { run, joining, joined, .. } = self;
        joined.expect(&checkpoint.joined);
        let mut archive = Archive::reader(&checkpoint.state);
        let absent = &mut |id| joining.absent(id, &checkpoint.joined);
        let restored = run.follower()?.restore(&mut archive, part.wall, absent);
        joined.sweep(run.run().agents());
        restored.map_err(|error| error.to_string())
    }

    /// Repeats the call of an entry.
    ///
    /// # Errors
    /// Why it cannot be done as it was.
    fn play_entry(&mut self, entry: Entry) -> Result<(), String> {
        match entry {
            Entry::Wait(end) => {
                let end = self.last_wall().map_or(end, |last| last.min(end));
                self.run.run_mut().wait_until(end);
            }
            Entry::Spend(work) => self.run.run_mut().spend(work),
            Entry::Drive(drive) => self.run.run_mut().drive(drive),
            Entry::Begin(bytes) => self.begin(&self.known(&bytes)?)?,
            Entry::Timeline(timeline) => self.run.follower()?.set_timeline(timeline),
            Entry::Present(at) => self.present = Some(at),
            Entry::Turns(turns) => self.turns.extend(turns.parts()),
            Entry::Command(to, command) => self.run.run().send(to, command).map_err(|error| error.to_string())?,
            Entry::SetState(id, state) => {
                let agent = self.run.run().agents().of(id).ok_or_else(|| format!("there is no agent {}", id.0))?;
                agent.set_state(*state).map_err(|error| error.to_string())?;
            }
            Entry::Add(name, part) => self.add(name, *part)?,
            Entry::Remove(id) => self.run.run_mut().remove(id).map_err(|error| error.to_string())?,
            Entry::Restore(bytes) => self.restore(&bytes)?,
            Entry::Start(..) | Entry::Demand(..) => {}
            Entry::Check(expected) => self.check(expected, "has")?,
            Entry::End(expected) => self.check(expected, "ends with")?,
        }
        Ok(())
    }

    /// Whether all states are the recorded ones.
    fn check(&self, expected: u64, what: &str) -> Result<(), String> {
        let run = self.run.run();
        let (found, at_s) = (state_hash(run.agents()), run.sim_now().as_secs_f64());
        if found == expected {
            return Ok(());
        }
        Err(format!(
            "the replay {what} the state hash {found:016x} at {at_s:.3} s, the recording {what} {expected:016x}"
        ))
    }

    /// The wall time at which it plays no further.
    fn last_wall(&self) -> Option<Duration> {
        self.run.run().timeline().wall_of(self.until?)
    }

    fn add(&mut self, name: String, part: Part) -> Result<(), String> {
        let id = AgentId(self.run.run().agents().len() as u32);
        let spawn = self.joining.spawn(id, &name, &part).map_err(|error| error.to_string())?;
        self.joined.add(id, JoinedPart { name, part: Some(Arc::new(part)) }, self.run.run().agents());
        let added = match (&mut self.run, self.present.take()) {
            (Followed::RealTime(run), Some(at)) => run.add_at(spawn, at),
            (run, _) => run.run_mut().add(spawn),
        };
        added.map(drop).map_err(|error| error.to_string())
    }

    /// The checkpoint in these bytes, of the recorded scene.
    fn known(&self, bytes: &[u8]) -> Result<Checkpoint, String> {
        let checkpoint = Checkpoint::from_bytes(bytes).map_err(|error| error.to_string())?;
        self.identity.check(&checkpoint.of).map_err(|error| error.to_string())?;
        Ok(checkpoint)
    }

    /// Puts the run into the state of a checkpoint.
    fn begin(&mut self, checkpoint: &Checkpoint) -> Result<(), String> {
        let Self { run, joining, joined, .. } = self;
        joined.expect(&checkpoint.joined);
        let outcome = read_state(run.run_mut(), checkpoint, joining);
        joined.sweep(run.run().agents());
        outcome.map_err(|error| error.to_string())
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), String> {
        let checkpoint = self.known(bytes)?;
        if let Followed::Lockstep(_) = &self.run {
            return self.begin(&checkpoint);
        }
        // turns that were in progress come first
        self.restored = Some(checkpoint);
        Ok(())
    }
}

impl Run for Player {
    fn now(&self) -> Duration {
        self.run.run().now()
    }

    fn wait_until(&mut self, until: Duration) {
        self.play(until);
    }

    fn spend(&mut self, work: Duration) {
        self.play(self.run.run().now() + work);
    }

    fn timeline(&self) -> Timeline {
        self.run.run().timeline()
    }

    fn set_stall_limit(&mut self, limit: Duration) {
        self.run.run_mut().set_stall_limit(limit);
    }

    /// Without effect: the recording says how time flows.
    fn drive(&mut self, _drive: TimelineCommand) {}

    fn agents(&self) -> &Agents {
        self.run.run().agents()
    }

    fn add(&mut self, spawn: AgentSpawn) -> Result<AgentHandle, RunError> {
        self.run.run_mut().add(spawn)
    }

    fn remove(&mut self, id: AgentId) -> Result<(), SendError> {
        self.run.run_mut().remove(id)
    }

    fn archive(&mut self, archive: &mut Archive<'_>, absent: Absent<'_>) -> Result<(), ArchiveError> {
        self.run.run_mut().archive(archive, absent)
    }

    fn end_turns(&mut self) {
        self.run.run_mut().end_turns();
    }

    fn shutdown(self: Box<Self>) -> Vec<AgentStats> {
        match self.run {
            Followed::Lockstep(run) => run.shutdown(),
            Followed::RealTime(run) => run.shutdown(),
        }
    }
}
