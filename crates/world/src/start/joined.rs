//! The parts that joined a world after its start, as they were given: an agent is made from its part when it joins and
//! when a checkpoint brings it back.
//!
//! In: parts, by the numbers of their agents. Out: members and spawns of them, from any thread; bytes for checkpoints.
//! A world keeps the parts of the agents that are there, a checkpoint its own. Never here: the states of agents.

use super::assemble;
use crate::description::builder::{Part, Rigid, SceneBuildError, member};
use crate::description::kinds::ExecutorKind;
use crate::description::scene::{Member, Spec};
use crate::error::WorldError;
use glam::DVec3;
use metachron_contact::detect::ClusterScene;
use metachron_core::{AgentId, Archive, ArchiveError};
use metachron_models::synthetic::SyntheticSpec;
use metachron_runtime::{AgentSpawn, AgentState, Agents};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Parts that joined, by the numbers of their agents.
pub(crate) type JoinedParts = BTreeMap<AgentId, JoinedPart>;

/// One that joined.
#[derive(Debug, Clone)]
pub(crate) struct JoinedPart {
    pub name: String,
    /// `None` where a file has the name alone: of an agent of somebody's own.
    pub part: Option<Arc<Part>>,
}

/// The same in a file.
#[derive(serde::Serialize, serde::Deserialize)]
struct SavedPart {
    id: AgentId,
    name: String,
    part: Option<Part>,
}

impl JoinedPart {
    /// Whether no file can have the part that makes it again.
    pub fn is_own(&self) -> bool {
        self.saved().is_none()
    }

    fn saved(&self) -> Option<&Arc<Part>> {
        self.part.as_ref().filter(|part| !matches!(***part, Part::Custom(_)))
    }

    fn bytes(&self) -> Option<Vec<u8>> {
        let mut part = Part::clone(self.saved()?);
        let mut archive = Archive::writer();
        archive.value(&mut part).ok()?;
        Some(archive.into_bytes())
    }
}

impl PartialEq for JoinedPart {
    fn eq(&self, other: &Self) -> bool {
        let is_same = || self.part.as_ref().map(Arc::as_ptr) == other.part.as_ref().map(Arc::as_ptr);
        self.name == other.name && (is_same() || self.bytes() == other.bytes())
    }
}

/// Writes or reads parts; of agents of somebody's own the names.
///
/// # Errors
/// The errors of the archive.
pub(crate) fn archive_parts(parts: &mut JoinedParts, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
    let saved = |(id, joined): (&AgentId, &JoinedPart)| {
        let part = joined.saved().map(|part| Part::clone(part));
        SavedPart { id: *id, name: joined.name.clone(), part }
    };
    let mut all: Vec<SavedPart> = parts.iter().map(saved).collect();
    archive.value(&mut all)?;
    if archive.is_reading() {
        let read = |SavedPart { id, name, part }: SavedPart| (id, JoinedPart { name, part: part.map(Arc::new) });
        *parts = all.into_iter().map(read).collect();
    }
    Ok(())
}

/// Makes agents of parts.
pub(crate) struct Joining {
    /// Gravity, m/s².
    pub gravity: DVec3,
    pub surroundings: Arc<ClusterScene>,
    pub executor: ExecutorKind,
}

impl Joining {
    /// The member that an agent is built from.
    ///
    /// # Errors
    /// [`SceneBuildError`].
    pub fn member(&self, id: AgentId, name: &str, part: &Part) -> Result<Member, SceneBuildError> {
        member(id, name.to_owned(), part.clone(), self.gravity)
    }

    /// The agent, ready to run.
    ///
    /// # Errors
    /// [`WorldError::Part`] and [`WorldError::Build`].
    pub fn spawn(&self, id: AgentId, name: &str, part: &Part) -> Result<AgentSpawn, WorldError> {
        assemble::lone(&self.member(id, name, part)?, &self.surroundings, self.executor)
    }

    /// One of `parts` that is not in the run which reads the state that it is in.
    ///
    /// # Errors
    /// [`ArchiveError::Mismatch`] for one that is not among them, or cannot be made.
    pub fn absent(&self, id: AgentId, parts: &JoinedParts) -> Result<AgentSpawn, ArchiveError> {
        let known = parts.get(&id).and_then(|joined| Some((&joined.name, joined.part.as_ref()?)));
        let wrong = |found: String| {
            let expected = "one that can be built".to_owned();
            ArchiveError::Mismatch { what: "an agent that joined", found, expected }
        };
        let (name, part) = known.ok_or_else(|| wrong(format!("number {}, of which nothing more is known,", id.0)))?;
        self.spawn(id, name, part).map_err(|error| wrong(format!("\"{name}\", which cannot be built ({error}),")))
    }
}

impl Member {
    /// One that nothing touches and nobody sees.
    ///
    /// # Errors
    /// The errors of parts.
    pub(crate) fn without_matter(id: AgentId, name: &str) -> Result<Self, SceneBuildError> {
        let nothing = SyntheticSpec { cost_us: 0.0, cost_order: 0.0, error_m: 0.0, error_order: 0.0 };
        let shaped = member(id, name.to_owned(), Rigid::ball(1.0).into(), DVec3::ZERO)?;
        Ok(Self { spec: Spec::Synthetic(nothing), ..shaped })
    }
}

/// The parts of a world, by the numbers of the agents that joined it.
#[derive(Debug, Default)]
pub(crate) struct JoinedTable(Mutex<Table>);

#[derive(Debug, Default)]
struct Table {
    parts: JoinedParts,
    /// How many parts the last sweep left.
    swept: usize,
}

/// Parts of agents that have left are swept out once there are twice as many parts as the last sweep left, and so many more: an agent that joins
/// costs O(1) in the mean.
const SLACK: usize = 16;

impl JoinedTable {
    /// Adds one, and sweeps out the parts of agents that have left where there may be many of them.
    pub fn add(&self, id: AgentId, joined: JoinedPart, agents: &Agents) {
        let mut table = self.lock();
        if table.parts.len() >= 2 * table.swept + SLACK {
            table.sweep(agents);
        }
        table.parts.insert(id, joined);
    }

    /// Takes one back: its agent could not be started.
    pub fn take_back(&self, id: AgentId) {
        self.lock().parts.remove(&id);
    }

    /// The one of an agent.
    pub fn get(&self, id: AgentId) -> Option<JoinedPart> {
        self.lock().parts.get(&id).cloned()
    }

    /// The parts of agents that have not left; the others are swept out.
    pub fn present(&self, agents: &Agents) -> JoinedParts {
        let mut table = self.lock();
        table.sweep(agents);
        table.parts.clone()
    }

    /// Adds the parts of a checkpoint that is about to be read: a reader that sees an agent can ask for its part.
    pub fn expect(&self, parts: &JoinedParts) {
        let mut table = self.lock();
        for (id, joined) in parts.iter().filter(|(_, joined)| joined.part.is_some()) {
            table.parts.entry(*id).or_insert_with(|| joined.clone());
        }
    }

    /// Keeps the parts of agents that are there.
    pub fn sweep(&self, agents: &Agents) {
        self.lock().sweep(agents);
    }

    fn lock(&self) -> MutexGuard<'_, Table> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Table {
    fn sweep(&mut self, agents: &Agents) {
        self.parts.retain(|id, _| agents.of(*id).is_some_and(|agent| agent.state() != AgentState::Gone));
        self.swept = self.parts.len();
    }
}
