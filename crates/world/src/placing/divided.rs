//! A world of which this process steps a part, and others the rest.
//!
//! In: numbers of objects, packed objects, boxes. Out: packed objects, where objects are. Never here: who steps which object.

use crate::control::pace::Pace;
use crate::error::WorldError;
use crate::world::{State, World};
use metachron_core::{AgentId, ArchiveError, SimSpan};
use metachron_runtime::{AgentHandle, Lockstep, Reach};
use std::time::{Duration, Instant};

/// A part of a world's steps: how far it has come.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct PartAdvanced {
    /// An object that has left the box that it was not to leave: the span has not passed whole then, and the part is to be put back.
    pub escaped: Option<AgentId>,
    /// Where the objects that are stepped here may be found near others.
    pub reaches: Vec<Reach>,
    /// Which of them belong together, however far apart they are.
    pub bonds: Vec<[AgentId; 2]>,
    /// Wall time that it took.
    pub took: Duration,
    /// CPU time of all steps made here so far; none where states are not shown.
    pub cpu: Option<Duration>,
}

/// A world in lockstep whose steps several processes share: each has all of its objects, and steps some.
pub trait DividedCalls: Send + Sync {
    /// Steps these objects no more: another process does. Steps take no virtual time from then on ([`Pace::Free`]).
    ///
    /// # Errors
    /// [`WorldError::Undivided`].
    fn release(&self, objects: &[AgentId]) -> Result<(), WorldError>;
    /// The whole state of these objects, whose numbers rise: 200 bytes to some hundred kilobytes each; `None` where they take more than a message
    /// of a world elsewhere holds.
    ///
    /// # Errors
    /// [`WorldError::Undivided`].
    fn pack(&self, objects: &[AgentId]) -> Result<Option<Vec<u8>>, WorldError>;
    /// Steps objects from now on, as another process has packed them, at the moment at which it did.
    ///
    /// # Errors
    /// [`WorldError::Undivided`]: nothing has changed then.
    fn adopt(&self, packed: &[u8]) -> Result<(), WorldError>;
    /// Lets `span` pass for the objects that are stepped here, each inside its box, or until one of them leaves it. Who reads states of a world
    /// elsewhere sees those of then only where it `shows` them.
    ///
    /// # Errors
    /// [`WorldError::Undivided`].
    fn advance_within(&self, span: SimSpan, boxes: &[Reach], shows: bool) -> Result<PartAdvanced, WorldError>;
}

impl World {
    fn with_lockstep<T>(&self, act: impl FnOnce(&mut Lockstep) -> Result<T, ArchiveError>) -> Result<T, WorldError> {
        let undivided = |reason: &str| WorldError::Undivided { reason: reason.to_owned() };
        let mut state = self.state()?;
        let State::Running(run) = &mut *state else { return Err(WorldError::Stopped) };
        if self.shared.log.is_recorded() || self.shared.log.is_replayed() {
            return Err(undivided("it is recorded, or a replay"));
        }
        let lockstep = run.as_lockstep().ok_or_else(|| undivided("it does not run in lockstep"))?;
        let done = act(lockstep).map_err(|error| undivided(&error.to_string()))?;
        self.see(run.as_ref());
        Ok(done)
    }
}

impl DividedCalls for World {
    fn release(&self, objects: &[AgentId]) -> Result<(), WorldError> {
        self.with_lockstep(|lockstep| lockstep.release(objects.iter().copied()))?;
        self.set_pace(Pace::Free)
    }

    fn pack(&self, objects: &[AgentId]) -> Result<Option<Vec<u8>>, WorldError> {
        self.with_lockstep(|lockstep| lockstep.pack(objects)).map(Some)
    }

    fn adopt(&self, packed: &[u8]) -> Result<(), WorldError> {
        let (joining, joined) = (self.joining(), &self.shared.joined);
        let parts = |id: AgentId| joined.get(id).map(|joined| (id, joined)).into_iter().collect();
        self.with_lockstep(|lockstep| lockstep.adopt(packed, &mut |id| joining.absent(id, &parts(id))))
    }

    fn advance_within(&self, span: SimSpan, boxes: &[Reach], shows: bool) -> Result<PartAdvanced, WorldError> {
        let fenced = |lockstep: &mut Lockstep| {
            lockstep.set_fences(boxes.iter().copied());
            Ok(())
        };
        let begun = Instant::now();
        self.with_lockstep(fenced)?;
        self.advance(span);
        let cpu = shows.then(|| Duration::from_secs_f64(self.agents().iter().map(AgentHandle::cpu_s).sum()));
        self.with_lockstep(|lockstep| {
            let (escaped, reaches, bonds) = (lockstep.escaped(), lockstep.reaches(), lockstep.bonds());
            lockstep.set_fences([]);
            Ok(PartAdvanced { escaped, reaches, bonds, took: begun.elapsed(), cpu })
        })
    }
}
