//! The turns to come of a run in virtual time: the phases of its agents, due turns, jobs in progress.
//!
//! In: nothing. Out: plain values, as an archive has them. Never here: when an event happens ([`crate::executors::lockstep`]).

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::Duration;

/// Where an agent is between the events of its turns.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) enum Phase {
    Waiting,
    /// In a turn.
    Busy(Turn),
    Resting,
    Led,
    Parked,
}

/// A turn that goes on.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Turn {
    /// When it began.
    pub since: Duration,
    /// Its jobs that have not ended.
    pub jobs: u32,
    /// How many cores it keeps busy in the mean, ≥ 1.
    pub cores: f64,
}

/// The events to come of a run in virtual time.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct VirtualEvents {
    /// Due times of turns.
    pub due: BinaryHeap<Reverse<(Duration, u32)>>,
    /// Service of the cores, and the jobs in progress.
    pub served: u128,
    pub jobs: BinaryHeap<Reverse<(u128, u32)>>,
    /// For each agent its phase and how many turns it has made.
    pub phases: Vec<(Phase, u64)>,
}

/// The number of the frame loop's own job: above every agent's, so that agents' jobs come first at equal end times.
pub(crate) const FRAME: u32 = u32::MAX;

impl VirtualEvents {
    /// The agents whose turns are due or in progress.
    pub fn owners(&self) -> impl Iterator<Item = u32> {
        let due = self.due.iter().map(|Reverse((_, agent))| *agent);
        due.chain(self.jobs.iter().map(|Reverse((_, owner))| *owner)).filter(|owner| *owner != FRAME)
    }

    /// A turn that cannot be in progress at `now`: it begins later, or its jobs are not there.
    pub fn impossible_turn(&self, now: Duration) -> Option<Turn> {
        let mut jobs = vec![0; self.phases.len()];
        let owners = self.jobs.iter().filter_map(|Reverse((_, owner))| usize::try_from(*owner).ok());
        owners.for_each(|owner| jobs.get_mut(owner).into_iter().for_each(|count| *count += 1));
        let turns = self.phases.iter().zip(jobs).filter_map(|((phase, _), jobs)| match phase {
            Phase::Busy(turn) => Some((*turn, jobs)),
            _ => None,
        });
        let is_impossible = |(turn, jobs): &(Turn, u32)| turn.since > now || turn.jobs == 0 || turn.jobs != *jobs;
        turns.filter(is_impossible).map(|(turn, _)| turn).next()
    }
}
