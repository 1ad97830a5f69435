//! A world that runs elsewhere, as a session here shows it.
//!
//! In: a scene, the calls of a world of it. Out: ghosts that follow it, whether its time passes, errors. Never here: frames, a connection.

use metachron_core::SimTime;
use metachron_runtime::TimelineCommand;
use metachron_world::{GhostWorld, Scene, World, WorldCalls, WorldError};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The time there is taken to stand when no later one has come for so long.
const STANDS_AFTER: Duration = Duration::from_millis(250);

/// So many notes are kept: a hundred objects that cannot be shown say no more than a few of them.
const NOTES_MAX: usize = 8;

/// The world that is shown.
pub(super) struct Elsewhere {
    pub calls: Arc<dyn WorldCalls>,
    ghosts: GhostWorld,
    /// Its time when it began to be shown.
    pub first: SimTime,
    /// Its newest time, and when that came.
    newest: SimTime,
    came: Instant,
    /// Why it was not shown whole, or did not take what a user did.
    pub error: Option<WorldError>,
    /// Warnings about all that is shown of it.
    pub notes: Vec<String>,
}

impl Elsewhere {
    /// The world of `calls`, which was started from `scene`, as it is now.
    ///
    /// # Errors
    /// [`WorldError::Build`] and [`WorldError::Run`].
    pub fn new(scene: &Scene, calls: Arc<dyn WorldCalls>) -> Result<Self, WorldError> {
        let (ghosts, first) = (GhostWorld::of(scene)?, calls.time());
        let mut elsewhere =
            Self { calls, ghosts, first, newest: first, came: Instant::now(), error: None, notes: Vec::new() };
        elsewhere.follow();
        Ok(elsewhere)
    }

    /// Counts from now on: opening an adapter takes seconds, in which its time may pass or stand.
    pub fn begin(&mut self) {
        (self.first, self.newest, self.came) = (self.calls.time(), self.calls.time(), Instant::now());
    }

    /// The world that shows it.
    pub const fn shown(&self) -> &World {
        self.ghosts.world()
    }

    /// Shows its newest states.
    pub fn follow(&mut self) {
        let error = self.ghosts.follow(&*self.calls).err();
        self.error = error.or(self.error.take());
        if self.calls.time() != self.newest {
            (self.newest, self.came) = (self.calls.time(), Instant::now());
        }
    }

    /// Whether its time passes.
    pub fn passes(&self) -> bool {
        self.stood() < STANDS_AFTER
    }

    /// For how long its time has stood.
    pub fn stood(&self) -> Duration {
        self.came.elapsed()
    }

    /// Keeps a note, once.
    pub fn note(&mut self, text: String) {
        if self.notes.len() < NOTES_MAX && !self.notes.contains(&text) {
            self.notes.push(text);
        }
    }

    /// Changes the flow of its time.
    pub fn drive(&mut self, drive: TimelineCommand) {
        let error = self.calls.drive(drive).err();
        self.error = error.or(self.error.take());
    }
}
