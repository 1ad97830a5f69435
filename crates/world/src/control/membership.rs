//! Objects that join a world which runs, and leave it.
//!
//! In: a part and its name, an object. Out: an object of the world, or one less. Never here: how an agent begins or ends
//! ([`metachron_runtime`]).

use super::commands::REPLAYED;
use crate::description::builder::{Part, SceneBuildError};
use crate::description::kinds::ExecutorKind;
use crate::description::scene::Member;
use crate::error::WorldError;
use crate::history::log::Mode;
use crate::history::recording::{Entry, added};
use crate::reading::object::Object;
use crate::start::joined::{JoinedPart, Joining};
use crate::world::{Shared, State, World};
use metachron_core::AgentId;
use metachron_runtime::{AgentHandle, RunError};
use std::sync::Arc;

impl World {
    /// Takes up another object: it lives from its first step on, and collides with objects that are there. No other
    /// object waits for it.
    ///
    /// # Errors
    /// [`WorldError::SameName`], [`WorldError::Part`], [`WorldError::Build`], [`WorldError::Run`], [`WorldError::Stopped`] and
    /// [`WorldError::Stalled`]; nothing was done then.
    pub fn add(&self, name: impl Into<String>, part: impl Into<Part>) -> Result<Object, WorldError> {
        let name = name.into();
        if name.is_empty() {
            return Err(SceneBuildError::NoName.into());
        }
        let (part, log) = (part.into(), &self.shared.log);
        if log.is_replayed() {
            return Err(WorldError::Refused { name, reason: REPLAYED.to_owned() });
        }
        let entry = added(&name, &part);
        let mut state = self.state()?;
        let State::Running(run) = &mut *state else { return Err(WorldError::Stopped) };
        // under the lock: no other thread adds one meanwhile
        if self.object(&name).is_ok() {
            return Err(WorldError::SameName { name });
        }
        if log.is_recorded() && entry.is_none() {
            let reason =
                "a recording has rigid bodies, tubes and soft bodies that join, and no agent of your own".to_owned();
            return Err(WorldError::Refused { name, reason });
        }
        let id = AgentId(self.agents().len() as u32);
        let spawn = self.joining().spawn(id, &name, &part)?;
        let note = |log: &mut Mode, joined: &Result<AgentHandle, RunError>| {
            let (Ok(joined), Some(entry)) = (joined, entry) else { return log.note_begun() };
            if self.executor() != ExecutorKind::Lockstep {
                log.note(|| Entry::Present(joined.latest().moment()));
            }
            log.note(|| entry);
        };
        // a caller that sees the agent can ask for its member
        let kept = &self.shared.joined;
        kept.add(id, JoinedPart { name, part: Some(Arc::new(part)) }, self.agents());
        let joined = self.in_order(|| run.add(spawn), note).inspect_err(|_| kept.take_back(id))?;
        Ok(self.tag().object(joined.id()))
    }

    /// Takes an object out: at its next step nothing of it is left, and bodies that rested on it fall. Its name is free
    /// again; it itself is an error from then on.
    ///
    /// # Errors
    /// [`WorldError::Foreign`], [`WorldError::Gone`], [`WorldError::Stopped`] and [`WorldError::Stalled`].
    pub fn remove(&self, object: Object) -> Result<(), WorldError> {
        let agent = self.agent(object)?;
        let refused = |reason: String| WorldError::Refused { name: agent.name().to_owned(), reason };
        let log = &self.shared.log;
        if log.is_replayed() {
            return Err(refused(REPLAYED.to_owned()));
        }
        let mut state = self.state()?;
        let State::Running(run) = &mut *state else { return Err(WorldError::Stopped) };
        let note = |log: &mut Mode, left: &Result<(), String>| {
            if left.is_ok() {
                log.note(|| Entry::Remove(object.id()));
            }
        };
        self.in_order(|| run.remove(object.id()).map_err(|error| error.to_string()), note).map_err(refused)
    }

    /// How many agents its scene has; agents of higher numbers joined it since ([`World::joined`]).
    #[must_use]
    pub fn agents_of_scene(&self) -> usize {
        self.shared.of_scene
    }

    /// The member that an agent which joined since the start was built from, as a scene has it of its own; of one that
    /// has left a member without matter, once it is forgotten. `None` of agents of the scene and of numbers without an
    /// agent.
    #[must_use]
    pub fn joined(&self, id: AgentId) -> Option<Member> {
        let agent = self.agents().of(id).filter(|_| id.0 as usize >= self.shared.of_scene);
        let kept = self.shared.joined.get(id);
        match kept.and_then(|JoinedPart { name, part }| Some((name, part?))) {
            Some((name, part)) => self.joining().member(id, &name, &part).ok(),
            None => Member::without_matter(id, agent?.name()).ok(),
        }
    }

    /// The settings that agents which join it are made with.
    pub(crate) fn joining(&self) -> Joining {
        let Shared { gravity, surroundings, .. } = &*self.shared;
        Joining { gravity: *gravity, surroundings: Arc::clone(surroundings), executor: self.executor() }
    }
}
