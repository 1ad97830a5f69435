//! A world that is recorded, and one that repeats a recording.
//!
//! In: a world, a place to write to; a recording. Out: a recording; a world that repeats it.
//! Never here: the file ([`super::recording`]), which call is written down where ([`crate::world`]).

use super::checkpoint::{Checkpoint, CheckpointError, SceneIdentity};
use super::log::{Log, TurnsToLog, logged};
use super::output_file::RecordingFile;
use super::recording::{Entry, RecordError, Recorder, Recording, SceneText};
use super::replay::{Followed, Player};
use crate::description::kinds::ExecutorKind;
use crate::error::{Waited, WorldError};
use crate::start::assemble;
use crate::start::assemble::Govern;
use crate::start::joined::{JoinedTable, Joining};
use crate::world::{Setting, Shared, State, World};
use crate::{Member, Scene};
use metachron_core::{Archive, SimTime};
use metachron_runtime::{Demand, Follower, Governor, Lockstep, Run, SystemClock, TurnMeasure, TurnOrder};
use std::collections::VecDeque;
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
    /// Writes down from now on, to the file at `path`, all calls that change the world, so that [`World::replay`] can
    /// repeat them, to the bit: of a world on threads or in a pool also the order of its turns. A world that has run
    /// before begins with a checkpoint, whatever joined it and left it; one with an agent of your own that joined does
    /// not begin. In lockstep commands of other threads wait for the call in progress from now on.
    ///
    /// # Errors
    /// [`RecordError`]; nothing is recorded then. In lockstep the file is as it was unless it is that which cannot be written.
    pub fn record(&self, path: impl AsRef<Path>) -> Result<(), RecordError> {
        self.begin_recording(|| Ok(Box::new(RecordingFile::create(path.as_ref())?)), None)
    }

    /// As [`World::record`], with the text of the scene, from which a replay can start it.
    ///
    /// # Errors
    /// The errors of [`World::record`].
    pub fn record_scene(&self, path: impl AsRef<Path>, scene: SceneText) -> Result<(), RecordError> {
        self.begin_recording(|| Ok(Box::new(RecordingFile::create(path.as_ref())?)), Some(scene))
    }

    /// As [`World::record`], to anything that takes bytes, and with the text of the scene, from which it can be started again.
    ///
    /// # Errors
    /// [`RecordError`]; nothing is recorded then.
    pub fn record_to(&self, out: Box<dyn Write + Send>, scene: Option<SceneText>) -> Result<(), RecordError> {
        self.begin_recording(|| Ok(out), scene)
    }

    /// Begins a recording to the file that `open` gives. Time and commands wait: each call is in the state with which
    /// it begins, or written down.
    fn begin_recording(
        &self,
        open: impl FnOnce() -> Result<Box<dyn Write + Send>, RecordError>,
        scene: Option<SceneText>,
    ) -> Result<(), RecordError> {
        let Shared { log, identity, .. } = &*self.shared;
        let mut state = self.state().map_err(|waited| RecordError::Begun(CheckpointError::Refused(waited.into())))?;
        let State::Running(run) = &mut *state else { return Err(RecordError::Stopped) };
        if log.is_replayed() {
            return Err(RecordError::Stopped);
        }
        if self.executor() != ExecutorKind::Lockstep {
            return self.record_turns(run.as_mut(), open, scene);
        }
        log.record(|is_fresh| {
            let begun = (!is_fresh).then(|| self.cut(run.as_mut())).transpose().map_err(RecordError::Begun)?;
            begun.iter().try_for_each(Checkpoint::check_saved).map_err(RecordError::Begun)?;
            let mut recorder = Recorder::begin(open()?, identity.clone(), scene, false)?;
            begun.into_iter().for_each(|checkpoint| recorder.note(Entry::Restore(checkpoint.to_bytes())));
            Ok((recorder, None))
        })
    }

    /// Begins to record a world in real time, between two turns of all of its objects.
    fn record_turns(
        &self,
        run: &mut dyn Run,
        open: impl FnOnce() -> Result<Box<dyn Write + Send>, RecordError>,
        scene: Option<SceneText>,
    ) -> Result<(), RecordError> {
        let (Shared { identity, log, joined, .. }, agents) = (&*self.shared, self.agents());
        let turns = TurnsToLog { log: Arc::downgrade(log), agents: agents.clone() };
        let order = Arc::new(TurnOrder::new(Box::new(turns)));
        // no turn is made in this order before the log has its beginning
        let _held = order.between();
        log.record(|is_fresh| {
            let (joined, mut archive) = (joined.present(agents), Archive::writer());
            let mut begun = Checkpoint::of_run(identity.clone(), run, joined, Vec::new());
            begun.check_saved().map_err(RecordError::Begun)?;
            let mut recorder = Recorder::begin(open()?, identity.clone(), scene, true)?;
            let written = run.record(Arc::clone(&order), (!is_fresh).then_some(&mut archive));
            written.map_err(|error| RecordError::Begun(CheckpointError::Refused(error)))?;
            begun.state = archive.into_bytes();
            recorder.note(if is_fresh { Entry::Timeline(run.timeline()) } else { Entry::Begin(begun.to_bytes()) });
            Ok((recorder, Some(Arc::clone(&order))))
        })
    }

    /// Ends the recording, as [`World::stop`] does; returns whether there was one. Of a world that was stopped it gives
    /// once the outcome of the recording that ended with it.
    ///
    /// # Errors
    /// [`RecordError::Write`] if not all of it could be written; [`RecordError::Stalled`], where it goes on.
    pub fn end_recording(&self) -> Result<bool, RecordError> {
        // calls after it are in neither
        let mut calls = self.state().map_err(|Waited { name, lasts }| RecordError::Stalled { name, lasts })?;
        let ended = if let State::Stopped(stopped) = &mut *calls { stopped.recorded.take() } else { None };
        ended.unwrap_or_else(|| self.close_recording())
    }

    /// Ends the recording between two parts of turns, for a caller that keeps others from calls.
    pub(crate) fn close_recording(&self) -> Result<bool, RecordError> {
        let order = self.shared.log.order();
        let _held = order.as_deref().map(TurnOrder::between);
        let recorder = self.shared.log.take_recorder();
        recorder.map_or(Ok(false), |recorder| recorder.end(self.hash()).map(|()| true))
    }

    /// Whether something of the recording could not be written, so that it ends there; [`World::end_recording`] says why.
    #[must_use]
    pub fn recording_failed(&self) -> bool {
        self.shared.log.recording_failed()
    }

    /// Starts `scene` on one thread and does again what `recording` says, as far as time is let pass, but no further than to `until`: the
    /// same bits. As in lockstep its clock is virtual, and reads what the recorded one did. It takes no commands. A call that let time pass is repeated whole: time may pass further than it was let, until the last.
    ///
    /// # Errors
    /// [`CheckpointError::OtherScene`] where the recording is of another scene; the errors of [`World::start`].
    pub fn replay(scene: &Scene, recording: Recording, until: Option<SimTime>) -> Result<Self, CheckpointError> {
        let answered = recording.governed();
        let govern =
            &mut |member: &Member| answered.contains(&member.id).then(|| Box::new(Silent) as Box<dyn Governor>);
        Self::replay_governed(scene, govern, recording, until)
    }

    /// As [`World::replay`], with the governors of the world that was recorded, where a checkpoint within the recording has their state too; the
    /// recording has their answers.
    ///
    /// # Errors
    /// The errors of [`World::replay`].
    pub fn replay_governed(
        scene: &Scene,
        govern: Govern<'_>,
        recording: Recording,
        until: Option<SimTime>,
    ) -> Result<Self, CheckpointError> {
        let identity = SceneIdentity::of(scene);
        identity.check(recording.identity())?;
        let surroundings = assemble::surroundings(scene)?;
        let log = Arc::new(Log::of_replay(&recording));
        let lockstep = ExecutorKind::Lockstep;
        let spawns = assemble::spawns(scene, &surroundings, lockstep, &mut logged(govern, &log))?;
        let run = if recording.is_real_time() {
            Followed::RealTime(Box::new(Follower::start(spawns).map_err(WorldError::Run)?))
        } else {
            Followed::Lockstep(Box::new(Lockstep::start(spawns, assemble::machine(scene)).map_err(WorldError::Run)?))
        };
        let joined = Arc::<JoinedTable>::default();
        let mut player = Player {
            run,
            recording,
            played: 0,
            turns: VecDeque::new(),
            present: None,
            restored: None,
            until,
            log: Arc::clone(&log),
            joining: Joining { gravity: scene.gravity, surroundings: Arc::clone(&surroundings), executor: lockstep },
            identity,
            joined: Arc::clone(&joined),
        };
        scene.stall_limit.into_iter().for_each(|limit| player.set_stall_limit(limit));
        let setting = Setting { surroundings, clock: Arc::new(SystemClock::new()), log, joined };
        Ok(Self::of_run(scene, lockstep, Box::new(player), setting))
    }

    /// The share of its recording that a replay has played, 0 … 1, or why it plays no more of it; `None` of other worlds.
    #[must_use]
    pub fn replayed(&self) -> Option<Result<f64, String>> {
        self.shared.log.played()
    }
}
