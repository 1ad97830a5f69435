//! A session whose run is recorded, and one that repeats a recording.
//!
//! In: a session before its first frame, a place to write to; a recording. Out: a recording; a session whose frames show it.
//! Never here: the contents of a recording ([`metachron_world::Recording`]), arguments.

use super::super::assemble::Governors;
use super::super::error::SessionError;
use super::Session;
use metachron_core::SimTime;
use metachron_world::{RecordError, Recording, Scene, SceneText, World};
use std::io::Write;

impl Session {
    /// Plays `scene` again as `recording` has it, at most to the simulated time `until`: frames see it, and change
    /// nothing.
    ///
    /// # Errors
    /// [`SessionError::Replay`] where the recording is of another scene; [`SessionError::World`].
    pub fn replay(scene: Scene, recording: Recording, until: Option<SimTime>) -> Result<Self, SessionError> {
        let governors = Governors::of(&scene);
        Self::open_as(scene, governors, |scene, govern| Ok(World::replay_governed(scene, govern, recording, until)?))
    }

    /// Writes down from now on all commands to its agents, with the text of the scene, so that [`Session::replay`] can
    /// repeat them.
    ///
    /// # Errors
    /// [`RecordError`]; nothing is recorded then.
    pub fn begin_recording(&self, out: Box<dyn Write + Send>, scene: SceneText) -> Result<(), RecordError> {
        self.world.record_to(out, Some(scene))
    }

    /// Ends the recording; returns whether there was one.
    ///
    /// # Errors
    /// [`RecordError::Write`] if not all of it could be written.
    pub fn end_recording(&self) -> Result<bool, RecordError> {
        self.world.end_recording()
    }

    /// Whether something of the recording could not be written; [`Session::end_recording`] says why.
    #[must_use]
    pub fn recording_failed(&self) -> bool {
        self.world.recording_failed()
    }

    /// The share of its recording that a replay has played, 0 … 1, or why it plays no more of it; `None` of other sessions.
    #[must_use]
    pub fn replayed(&self) -> Option<Result<f64, String>> {
        self.world.replayed()
    }
}
