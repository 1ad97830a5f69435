//! The calls of a world that are answered wherever it runs: in this process, or by a host elsewhere.
//!
//! In: names, objects, commands, parts. Out: states, events, checkpoints, or the error of a [`World`]. Never here: a
//! connection, threads.

use crate::history::checkpoint::{SceneIdentity, SceneMark};
use crate::placing::divided::DividedCalls;
use crate::reading::events::{Event, EventFilter, Events};
use crate::reading::object::{Object, Touched};
use crate::{Checkpoint, CheckpointError, Part, Scene, World, WorldError};
use metachron_core::{AgentId, Body, SimSpan, SimTime, Snapshot};
use metachron_runtime::{Command, TimelineCommand};
use std::sync::Arc;
use std::time::Duration;

impl Scene {
    /// The scene in short.
    #[must_use]
    pub fn mark(&self) -> SceneMark {
        SceneIdentity::of(self).mark()
    }
}

/// How the states of a world elsewhere come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StateLink {
    /// How long ago the newest message came.
    pub age: Duration,
    /// The time from a message to the next.
    pub period: Duration,
    /// From the last command that was posted and answered to its answer; zero where none was.
    pub round_trip: Duration,
}

/// A reader of events.
pub trait EventReader: Send {
    /// All events since the last call, in the order of their times.
    fn take(&mut self) -> Vec<Event>;
    /// How many were overwritten before they were read.
    fn lost(&self) -> u64;
}

impl EventReader for Events {
    fn take(&mut self) -> Vec<Event> {
        self.drain().collect()
    }

    fn lost(&self) -> u64 {
        Self::lost(self)
    }
}

/// A world, here or elsewhere, by its calls. Each does as the method of [`World`] of the same name, and has its errors; a world
/// that runs elsewhere has [`WorldError::Silent`] and [`WorldError::Elsewhere`] besides.
pub trait WorldCalls: Send + Sync {
    /// The scene that it was started with.
    fn scene(&self) -> SceneMark;
    /// All objects that are there.
    fn all_objects(&self) -> Vec<Object>;
    /// The object of that name.
    ///
    /// # Errors
    /// [`WorldError::NoObject`].
    fn object(&self, name: &str) -> Result<Object, WorldError>;
    /// The object whose agent has this number.
    ///
    /// # Errors
    /// [`WorldError::NoAgent`].
    fn object_of(&self, id: AgentId) -> Result<Object, WorldError>;
    /// The name of an object or a fixed solid.
    ///
    /// # Errors
    /// [`WorldError::Foreign`].
    fn name(&self, of: Touched) -> Result<Arc<str>, WorldError>;
    /// The newest state of an object.
    ///
    /// # Errors
    /// [`WorldError::Foreign`] and [`WorldError::Gone`].
    fn latest(&self, object: Object) -> Result<Arc<Snapshot>, WorldError>;
    /// The part as which an object joined since the start; `None` of an object of the scene.
    ///
    /// # Errors
    /// [`WorldError::Foreign`] and [`WorldError::Gone`].
    fn part(&self, object: Object) -> Result<Option<Part>, WorldError>;
    /// Simulated time now; of a world elsewhere that of the newest states that came.
    fn time(&self) -> SimTime;
    /// Hash of the newest states of all objects.
    ///
    /// # Errors
    /// Only of a world elsewhere.
    fn hash(&self) -> Result<u64, WorldError>;
    /// Changes the flow of time.
    ///
    /// # Errors
    /// Only of a world elsewhere.
    fn drive(&self, drive: TimelineCommand) -> Result<(), WorldError>;
    /// Lets it live for `span`.
    ///
    /// # Errors
    /// Only of a world elsewhere.
    fn advance(&self, span: SimSpan) -> Result<(), WorldError>;
    /// Sends a command to an object.
    ///
    /// # Errors
    /// The errors of [`World::command`].
    fn command(&self, object: Object, command: Command) -> Result<(), WorldError>;
    /// Sends a command to an object, and waits for nothing.
    ///
    /// # Errors
    /// The errors of [`World::command`]; of a world elsewhere, that of a command which was posted before.
    fn post(&self, object: Object, command: Command) -> Result<(), WorldError> {
        self.command(object, command)
    }
    /// How its states come; `None` where they are read as they are made.
    fn link(&self) -> Option<StateLink> {
        None
    }
    /// Puts an object into another state.
    ///
    /// # Errors
    /// The errors of [`World::set_state`].
    fn set_state(&self, object: Object, state: &Body) -> Result<(), WorldError>;
    /// Takes up another object.
    ///
    /// # Errors
    /// The errors of [`World::add`].
    fn add(&self, name: &str, part: Part) -> Result<Object, WorldError>;
    /// Takes an object out.
    ///
    /// # Errors
    /// The errors of [`World::remove`].
    fn remove(&self, object: Object) -> Result<(), WorldError>;
    /// Its state now.
    ///
    /// # Errors
    /// The errors of [`World::checkpoint`].
    fn checkpoint(&self) -> Result<Checkpoint, CheckpointError>;
    /// Puts it back into the state of a checkpoint.
    ///
    /// # Errors
    /// The errors of [`World::restore`].
    fn restore(&self, checkpoint: &Checkpoint) -> Result<(), CheckpointError>;
    /// Whether it answers calls.
    ///
    /// # Errors
    /// [`WorldError::Silent`] of a world elsewhere.
    fn answers(&self) -> Result<(), WorldError>;
    /// Events from now on.
    fn listen(&self, filter: EventFilter) -> Box<dyn EventReader>;
    /// The name of the host that steps an object; `None` where all are stepped by one.
    fn host_of(&self, _object: Object) -> Option<&str> {
        None
    }
    /// The world as one that is stepped by several hosts ([`crate::PlacedWorld`]); `None` of one that cannot be.
    fn divided(&self) -> Option<&dyn DividedCalls> {
        None
    }
}

impl WorldCalls for World {
    fn scene(&self) -> SceneMark {
        self.shared.identity.mark()
    }

    fn all_objects(&self) -> Vec<Object> {
        Self::all_objects(self).collect()
    }

    fn object(&self, name: &str) -> Result<Object, WorldError> {
        Self::object(self, name)
    }

    fn object_of(&self, id: AgentId) -> Result<Object, WorldError> {
        Self::object_of(self, id)
    }

    fn name(&self, of: Touched) -> Result<Arc<str>, WorldError> {
        Self::name(self, of).map(Arc::from)
    }

    fn latest(&self, object: Object) -> Result<Arc<Snapshot>, WorldError> {
        Self::latest(self, object)
    }

    fn part(&self, object: Object) -> Result<Option<Part>, WorldError> {
        Self::latest(self, object)?;
        let joined = self.shared.joined.get(object.id());
        Ok(joined.and_then(|joined| joined.part).map(|part| Part::clone(&part)))
    }

    fn time(&self) -> SimTime {
        Self::time(self)
    }

    fn hash(&self) -> Result<u64, WorldError> {
        Ok(Self::hash(self))
    }

    fn drive(&self, drive: TimelineCommand) -> Result<(), WorldError> {
        Self::drive(self, drive);
        Ok(())
    }

    fn advance(&self, span: SimSpan) -> Result<(), WorldError> {
        Self::advance(self, span);
        Ok(())
    }

    fn command(&self, object: Object, command: Command) -> Result<(), WorldError> {
        Self::command(self, object, command)
    }

    fn set_state(&self, object: Object, state: &Body) -> Result<(), WorldError> {
        Self::set_state(self, object, state)
    }

    fn add(&self, name: &str, part: Part) -> Result<Object, WorldError> {
        Self::add(self, name, part)
    }

    fn remove(&self, object: Object) -> Result<(), WorldError> {
        Self::remove(self, object)
    }

    fn checkpoint(&self) -> Result<Checkpoint, CheckpointError> {
        Self::checkpoint(self)
    }

    fn restore(&self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        Self::restore(self, checkpoint)
    }

    fn answers(&self) -> Result<(), WorldError> {
        Ok(())
    }

    fn listen(&self, filter: EventFilter) -> Box<dyn EventReader> {
        Box::new(self.events(filter))
    }

    fn divided(&self) -> Option<&dyn DividedCalls> {
        Some(self)
    }
}
