//! A world that is recorded, and one that repeats a recording.
//!
//! In: a world in lockstep, a place to write to; a recording. Out: a recording; a world that does what it says.
//! Never here: the file ([`super::recording`]), what is written down where ([`super::world`]).

use super::assemble::Govern;
use super::checkpoint::{CheckpointError, SceneIdentity};
use super::kinds::ExecutorKind;
use super::log::Log;
use super::recording::{Entry, RecordError, Recorder, Recording, SceneText};
use super::replay::Player;
use super::world::{Shared, State, World};
use super::{Member, Scene};
use metachron_core::SimTime;
use metachron_runtime::{Demand, Governor, TurnMeasure};
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

/// Stands for the governor of an agent in a replay, which has the answers.
struct Silent;

impl Governor for Silent {
    fn after_step(&mut self, _: &TurnMeasure) -> Demand {
        Demand::default()
    }
}

impl World {
    /// Writes down from now on, to the file at `path`, what is done to the world, so that [`World::replay`] can do it again, to the bit. In
    /// lockstep only. A world that has run before begins with a checkpoint. Commands of other threads wait for the call in progress from now on;
    /// one that is sent while this call runs may be left out.
    ///
    /// # Errors
    /// [`RecordError`]; nothing is recorded then.
    pub fn record(&self, path: impl AsRef<Path>) -> Result<(), RecordError> {
        self.check_recordable()?;
        self.record_to(Recorder::file(path.as_ref())?, None)
    }

    /// As [`World::record`], to anything that takes bytes, and with the text of the scene, from which it can be started again.
    ///
    /// # Errors
    /// [`RecordError`]; nothing is recorded then.
    pub fn record_to(&self, out: Box<dyn Write + Send>, scene: Option<SceneText>) -> Result<(), RecordError> {
        self.check_recordable()?;
        let begun = (!self.shared.log.is_fresh()).then(|| self.checkpoint()).transpose();
        let begun = begun.map_err(RecordError::Begun)?;
        let identity = &self.shared.identity;
        if let Some(checkpoint) = &begun {
            identity.check(&checkpoint.of).map_err(RecordError::Begun)?;
        }
        let mut recorder = Recorder::begin(out, identity.clone(), scene)?;
        begun.into_iter().for_each(|checkpoint| recorder.note(Entry::Restore(checkpoint.to_bytes())));
        self.shared.log.record(recorder);
        Ok(())
    }

    fn check_recordable(&self) -> Result<(), RecordError> {
        if self.executor() != ExecutorKind::Lockstep {
            return Err(RecordError::RealTime);
        }
        if self.has_stopped() || self.shared.log.is_replayed() { Err(RecordError::Stopped) } else { Ok(()) }
    }

    /// Ends the recording, as [`World::stop`] does; returns whether there was one.
    ///
    /// # Errors
    /// [`RecordError::Write`] if not all of it could be written.
    pub fn end_recording(&self) -> Result<bool, RecordError> {
        let recorder = self.shared.log.take_recorder();
        recorder.map_or(Ok(false), |recorder| recorder.end(self.hash()).map(|()| true))
    }

    /// Whether something of the recording could not be written, so that it ends there; [`World::end_recording`] says why.
    #[must_use]
    pub fn recording_failed(&self) -> bool {
        self.shared.log.recording_failed()
    }

    /// Starts `scene` in lockstep and does again what `recording` says, as far as time is let pass, but no further than to `until`: the
    /// same bits. It takes no commands. A call that let time pass is repeated whole: time may pass further than it was let, until the last.
    ///
    /// # Errors
    /// [`CheckpointError::OtherScene`] where the recording is of another scene; those of [`World::start`].
    pub fn replay(scene: &Scene, recording: Recording, until: Option<SimTime>) -> Result<Self, CheckpointError> {
        let answered = recording.governed();
        let govern =
            &mut |member: &Member| answered.contains(&member.id).then(|| Box::new(Silent) as Box<dyn Governor>);
        Self::replay_governed(scene, govern, recording, until)
    }

    /// As [`World::replay`], with the governors of the world that was recorded, where a checkpoint within the recording has their state too; the
    /// recording has what they answered.
    ///
    /// # Errors
    /// Those of [`World::replay`].
    pub fn replay_governed(
        scene: &Scene,
        govern: Govern<'_>,
        recording: Recording,
        until: Option<SimTime>,
    ) -> Result<Self, CheckpointError> {
        let identity = SceneIdentity::of(scene);
        identity.check(recording.identity())?;
        let world = Self::start_logged(scene, ExecutorKind::Lockstep, govern, Log::of_replay(&recording))?;
        world.follow(recording, until);
        Ok(world)
    }

    /// From now on its run does what `recording` says.
    fn follow(&self, recording: Recording, until: Option<SimTime>) {
        let Shared { gravity, surroundings, identity, log, .. } = &*self.shared;
        let mut state = self.state();
        let State::Running(run) = &*state else { return };
        let (now, time, timeline) = (run.now(), run.sim_now(), run.timeline());
        let State::Running(run) = std::mem::replace(&mut *state, State::Stopped { now, time, timeline }) else {
            return;
        };
        *state = State::Running(Box::new(Player {
            run,
            recording,
            played: 0,
            until,
            log: Arc::clone(log),
            gravity: *gravity,
            surroundings: Arc::clone(surroundings),
            identity: identity.clone(),
        }));
    }

    /// The share of its recording that a replay has played, 0 … 1, or why it plays no more of it; `None` of other worlds.
    #[must_use]
    pub fn replayed(&self) -> Option<Result<f64, String>> {
        self.shared.log.played()
    }
}
