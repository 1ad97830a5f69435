//! Agents in a run of their own in virtual time, by the program's own runtime, clusters included.
//!
//! In: agents with rates. Out: a run at the free pace, and its agents' newest states. Never here: measurements.

use metachron_contact::audit::Member;
use metachron_core::{AgentId, Snapshot};
use metachron_runtime::{AgentSpawn, Lockstep, Machine, Run, RunError, TimelineCommand};
use std::sync::Arc;
use std::time::Duration;

/// A run.
pub(super) struct LockstepRun(Lockstep);

impl LockstepRun {
    /// Begins a run.
    ///
    /// # Errors
    /// The runtime's refusal.
    pub(super) fn start(spawns: Vec<AgentSpawn>) -> Result<Self, RunError> {
        let mut run = Lockstep::start(spawns, Machine::default())?;
        run.drive(TimelineCommand::Free);
        Ok(Self(run))
    }

    /// Goes on until all agents have reached `seconds`.
    pub(super) fn run_to(&mut self, seconds: f64) {
        self.0.wait_until(Duration::from_secs_f64(seconds));
    }

    /// The newest states.
    pub(super) fn snapshots(&self) -> Vec<Arc<Snapshot>> {
        self.0.agents().iter().map(|agent| agent.latest()).collect()
    }

    /// The number of steps of each agent, and the leader of its cluster.
    pub(super) fn steps(&self) -> Vec<(u64, Option<AgentId>)> {
        self.0.agents().iter().map(|agent| agent.stats()).map(|stats| (stats.steps, stats.led_by)).collect()
    }
}

/// Rigid bodies for an audit.
pub(super) fn members(snapshots: &[Arc<Snapshot>]) -> Vec<Member<'_>> {
    let all = (0..).map(AgentId).zip(snapshots);
    all.map(|(id, snapshot)| Member { id, snapshot, mass_per_length_kg_m: 0.0 }).collect()
}
