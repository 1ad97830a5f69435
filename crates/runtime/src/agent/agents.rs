//! The agents of a run, with the agents that joined it after its start.
//!
//! In: handles, one after the other. Out: the same by their numbers, from any thread, without waiting. Numbers are never used again.

use super::handle::AgentHandle;
use crate::lock_free::sleep::SleepRegistry;
use crate::neighbours::observation::Peers;
use metachron_core::AgentId;
use std::iter::Map;
use std::ops::Index;
use std::sync::Arc;

/// All agents of a run, in the order of their numbers; copies are the same list.
#[derive(Debug, Clone)]
pub struct Agents {
    all: Arc<boxcar::Vec<AgentHandle>>,
    pub(crate) sleep: Arc<SleepRegistry>,
}

/// The data that all agents of a run share, and agents that join it.
#[derive(Debug, Clone)]
pub(crate) struct RunAgents {
    pub handles: Agents,
    pub sleep: Arc<SleepRegistry>,
    pub peers: Arc<Peers>,
}

impl Agents {
    /// The first agents of a run.
    pub(crate) fn new(sleep: &Arc<SleepRegistry>, first: impl Iterator<Item = AgentHandle>) -> Self {
        Self { all: Arc::new(first.collect()), sleep: Arc::clone(sleep) }
    }

    /// Adds the agent of the next number.
    pub(crate) fn push(&self, agent: AgentHandle) {
        self.all.push(agent);
    }

    /// The number of agents, including agents that have left.
    #[must_use]
    pub fn len(&self) -> usize {
        self.all.count()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// The agent of a number.
    #[must_use]
    pub fn of(&self, id: AgentId) -> Option<&AgentHandle> {
        self.get(id.0 as usize)
    }

    /// The agent at a place.
    #[must_use]
    pub fn get(&self, at: usize) -> Option<&AgentHandle> {
        self.all.get(at)
    }

    /// The first agent.
    #[must_use]
    pub fn first(&self) -> Option<&AgentHandle> {
        self.get(0)
    }

    /// All of them.
    pub fn iter(&self) -> Iter<'_> {
        self.all.iter().map(|(_, agent)| agent)
    }

    /// The agent whose step has kept the caller's thread of a run in virtual time for longer than a turn may last
    /// ([`crate::Run::set_stall_limit`]); `None` where none has, and of a run in real time.
    #[must_use]
    pub fn stalled_on_caller(&self) -> Option<AgentId> {
        self.sleep.callers_turn.judge()
    }

    /// Ends such a run from another thread, as its own thread does not return: the agent and the members of its cluster
    /// are parked, commands are refused, and no further turn begins where this one ends after all. Whether there was
    /// such a turn; nothing is done else.
    #[must_use]
    pub fn end_stalled(&self) -> bool {
        let is_stalled = self.sleep.callers_turn.park();
        if is_stalled {
            self.sleep.end();
            self.sleep.stop();
        }
        is_stalled
    }

    /// Copies of their handles.
    #[must_use]
    pub fn to_vec(&self) -> Vec<AgentHandle> {
        self.iter().cloned().collect()
    }
}

/// The agents of a run, one after the other.
pub type Iter<'a> = Map<boxcar::Iter<'a, AgentHandle>, fn((usize, &'a AgentHandle)) -> &'a AgentHandle>;

impl<'a> IntoIterator for &'a Agents {
    type Item = &'a AgentHandle;
    type IntoIter = Iter<'a>;

    fn into_iter(self) -> Iter<'a> {
        self.iter()
    }
}

impl Index<usize> for Agents {
    type Output = AgentHandle;

    /// # Panics
    /// Where there is no agent at that place.
    fn index(&self, at: usize) -> &AgentHandle {
        self.get(at).unwrap_or_else(|| panic!("the run has {} agents, not one numbered {at}", self.len()))
    }
}
