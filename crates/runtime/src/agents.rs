//! The agents of a run, those included that joined it after its start.
//!
//! In: handles, one after the other. Out: the same by their numbers, from any thread, without waiting. Numbers are never used again.

use super::handle::AgentHandle;
use metachron_core::AgentId;
use std::iter::Map;
use std::ops::Index;
use std::sync::Arc;

/// All agents of a run, in the order of their numbers; copies are the same list.
#[derive(Debug, Clone, Default)]
pub struct Agents(Arc<boxcar::Vec<AgentHandle>>);

impl Agents {
    /// Adds the agent of the next number.
    pub(super) fn push(&self, agent: AgentHandle) {
        self.0.push(agent);
    }

    /// How many there are, those that have left included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.count()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The agent of a number.
    #[must_use]
    pub fn of(&self, id: AgentId) -> Option<&AgentHandle> {
        self.get(id.0 as usize)
    }

    /// The agent at a place.
    #[must_use]
    pub fn get(&self, at: usize) -> Option<&AgentHandle> {
        self.0.get(at)
    }

    /// The first agent.
    #[must_use]
    pub fn first(&self) -> Option<&AgentHandle> {
        self.get(0)
    }

    /// All of them.
    pub fn iter(&self) -> Iter<'_> {
        self.0.iter().map(|(_, agent)| agent)
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

impl FromIterator<AgentHandle> for Agents {
    fn from_iter<I: IntoIterator<Item = AgentHandle>>(all: I) -> Self {
        let agents = Self::default();
        all.into_iter().for_each(|agent| agents.push(agent));
        agents
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
