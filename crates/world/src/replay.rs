//! A run that does again what a recording says, instead of what it is asked for.
//!
//! In: a run in lockstep from the recorded scene, a [`Recording`]. Out: the same bits, as far as its reader lets time pass.
//! Never here: the file, what governors answer ([`super::log`]).

use super::assemble;
use super::builder::{Part, member};
use super::checkpoint::{Checkpoint, SceneIdentity};
use super::joined::Joined;
use super::kinds::ExecutorKind;
use super::log::Log;
use super::recording::{Entry, Recording};
use super::world::read_state;
use glam::DVec3;
use metachron_contact::stepper::ClusterScene;
use metachron_core::{AgentId, Archive, ArchiveError, SimTime};
use metachron_runtime::{
    AgentHandle, AgentSpawn, AgentStats, Agents, Run, RunError, SendError, Timeline, TimelineCommand, state_hash,
};
use std::sync::Arc;
use std::time::Duration;

/// A run that follows a recording.
pub(super) struct Player {
    pub run: Box<dyn Run>,
    pub recording: Recording,
    /// Entries that are played.
    pub played: usize,
    /// It plays no further than to this time.
    pub until: Option<SimTime>,
    pub log: Arc<Log>,
    pub gravity: DVec3,
    pub surroundings: Arc<ClusterScene>,
    pub identity: SceneIdentity,
    pub joined: Arc<Joined>,
}

impl Player {
    /// Plays whole entries until time has come to `until`: a wait in two parts is not always the same to the bit, so that one that waits
    /// longer ends later. What was done at the same moment belongs to it.
    fn play(&mut self, until: Duration) {
        while let Some(entry) = self.recording.entries.get(self.played) {
            if matches!(entry, Entry::Wait(_) | Entry::Spend(_)) && self.run.now() >= until {
                return;
            }
            let entry = entry.clone();
            let outcome = self.play_entry(entry);
            self.played += 1;
            let is_over = outcome.is_err() || self.until.is_some_and(|until| self.run.sim_now() >= until);
            if is_over {
                self.played = self.recording.entries.len();
            }
            self.log.note_played(self.played, outcome.err());
        }
    }

    /// Does what an entry says.
    ///
    /// # Errors
    /// Why it cannot be done as it was.
    fn play_entry(&mut self, entry: Entry) -> Result<(), String> {
        match entry {
            Entry::Wait(end) => self.run.wait_until(self.last_wall().map_or(end, |last| last.min(end))),
            Entry::Spend(work) => self.run.spend(work),
            Entry::Drive(drive) => self.run.drive(drive),
            Entry::Command(to, command) => self.run.send(to, command).map_err(|error| error.to_string())?,
            Entry::SetState(id, state) => {
                let agent = self.run.agents().of(id).ok_or_else(|| format!("there is no agent {}", id.0))?;
                agent.set_state(*state);
            }
            Entry::AddRigid(name, rigid) => self.add(name, Part::Rigid(*rigid))?,
            Entry::AddTube(name, tube) => self.add(name, Part::Tube(*tube))?,
            Entry::AddSoft(name, soft) => self.add(name, Part::Soft(*soft))?,
            Entry::Remove(id) => self.run.remove(id).map_err(|error| error.to_string())?,
            Entry::Restore(bytes) => self.restore(&bytes)?,
            Entry::Demand(..) => {}
            Entry::End(expected) => {
                let found = state_hash(self.run.agents());
                if found != expected {
                    return Err(format!(
                        "the replay ends with the state hash {found:016x}, the recording with {expected:016x}"
                    ));
                }
            }
        }
        Ok(())
    }

    /// The wall time at which it plays no further.
    fn last_wall(&self) -> Option<Duration> {
        self.run.timeline().wall_of(self.until?)
    }

    fn add(&mut self, name: String, part: Part) -> Result<(), String> {
        let id = AgentId(self.run.agents().len() as u32);
        let member = member(id, name, part, self.gravity).map_err(|error| error.to_string())?;
        let spawn = assemble::lone(&member, &self.surroundings, ExecutorKind::Lockstep);
        let spawn = spawn.map_err(|error| error.to_string())?;
        self.joined.push(member);
        self.run.add(spawn).map(drop).map_err(|error| error.to_string())
    }

    fn restore(&mut self, bytes: &[u8]) -> Result<(), String> {
        let checkpoint = Checkpoint::from_bytes(bytes).map_err(|error| error.to_string())?;
        self.identity.now(self.run.agents()).check(&checkpoint.of).map_err(|error| error.to_string())?;
        read_state(self.run.as_mut(), &checkpoint.state)
    }
}

impl Run for Player {
    fn now(&self) -> Duration {
        self.run.now()
    }

    fn wait_until(&mut self, until: Duration) {
        self.play(until);
    }

    fn spend(&mut self, work: Duration) {
        self.play(self.run.now() + work);
    }

    fn timeline(&self) -> Timeline {
        self.run.timeline()
    }

    /// Without effect: the recording says how time flows.
    fn drive(&mut self, _drive: TimelineCommand) {}

    fn agents(&self) -> &Agents {
        self.run.agents()
    }

    fn add(&mut self, spawn: AgentSpawn) -> Result<AgentHandle, RunError> {
        self.run.add(spawn)
    }

    fn remove(&mut self, id: AgentId) -> Result<(), SendError> {
        self.run.remove(id)
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.run.archive(archive)
    }

    fn shutdown(self: Box<Self>) -> Vec<AgentStats> {
        self.run.shutdown()
    }
}
