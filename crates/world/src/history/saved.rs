//! A world that is saved, goes back to where it was, and goes on in another process.
//!
//! In: a world, a checkpoint of one of the same scene. Out: a checkpoint; the world as it was then. Never here: the file
//! ([`super::checkpoint`]), the state of an object.

use super::checkpoint::{Checkpoint, CheckpointError};
use crate::Scene;
use crate::description::kinds::ExecutorKind;
use crate::start::assemble::Govern;
use crate::start::joined::Joining;
use crate::world::{Shared, State, World};
use metachron_core::Archive;
use metachron_runtime::{AgentHandle, AgentState, Run};
use std::sync::atomic::Ordering::Release;

impl World {
    /// Starts `scene` and puts it into the state of `checkpoint`: it goes on as the world did that was saved, to the
    /// bit. The scene is known by the names, models and rates of its objects and the numbers of its fixed solids,
    /// joints and couplings; with other masses, stiffnesses or sizes than the saved world's, its state goes on under
    /// the new ones.
    ///
    /// # Errors
    /// The errors of [`World::start`] and [`World::restore`].
    pub fn open(scene: &Scene, executor: ExecutorKind, checkpoint: &Checkpoint) -> Result<Self, CheckpointError> {
        Self::open_governed(scene, executor, &mut |_| None, checkpoint)
    }

    /// As [`World::open`], with the governors of the world that was saved.
    ///
    /// # Errors
    /// The errors of [`World::start_governed`] and [`World::restore`].
    pub fn open_governed(
        scene: &Scene,
        executor: ExecutorKind,
        govern: Govern<'_>,
        checkpoint: &Checkpoint,
    ) -> Result<Self, CheckpointError> {
        let world = Self::start_governed(scene, executor, govern)?;
        world.restore(checkpoint)?;
        Ok(world)
    }

    /// The state of the world now: all that the next bit of it needs, but samples of watched points and CPU times. On threads and in a pool
    /// turns in progress end first, and each object is saved at the end of its own step ([`Checkpoint::times`]): what
    /// it has given others is either in their states or still in its own. Any executor goes on from it.
    ///
    /// # Errors
    /// [`CheckpointError::Refused`] where a model or a governor does not save its state, and where an object's step has not ended within the time
    /// that it may last ([`Scene::stall_limit`]), [`CheckpointError::Stopped`]. The world goes on as it
    /// was.
    pub fn checkpoint(&self) -> Result<Checkpoint, CheckpointError> {
        let mut state = self.state().map_err(|waited| CheckpointError::Refused(waited.into()))?;
        let State::Running(run) = &mut *state else { return Err(CheckpointError::Stopped) };
        self.cut(run.as_mut())
    }

    /// The state of its run now.
    pub(super) fn cut(&self, run: &mut dyn Run) -> Result<Checkpoint, CheckpointError> {
        let joined = self.shared.joined.present(self.agents());
        let mut archive = Archive::writer();
        run.save(&mut archive).map_err(CheckpointError::Refused)?;
        Ok(Checkpoint::of_run(self.shared.identity.clone(), run, joined, archive.into_bytes()))
    }

    /// Puts the world back into the state of `checkpoint`, of this world or of another of the same scene; from there it
    /// repeats its steps, in lockstep to the bit. Objects that joined since are taken out, with the event
    /// [`Gone`](crate::Happening::Gone); objects that left since are there again. An [`Object`](crate::Object) is valid
    /// where its object is there: of one that came back again. Readers of events are told
    /// [`Rewound`](crate::Happening::Rewound) of each object that is there.
    ///
    /// # Errors
    /// [`CheckpointError::OtherScene`], also where an object of this world has the number of another that joined the checkpoint's,
    /// [`CheckpointError::Own`], [`CheckpointError::Replay`], [`CheckpointError::Stopped`] and [`CheckpointError::Unreadable`]. The world goes on as it
    /// was after each of them.
    pub fn restore(&self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        let Shared { identity, joined, log, .. } = &*self.shared;
        identity.check(&checkpoint.of)?;
        let mut state = self.state().map_err(|waited| CheckpointError::Unreadable(waited.into()))?;
        let State::Running(run) = &mut *state else { return Err(CheckpointError::Stopped) };
        if log.is_replayed() {
            return Err(CheckpointError::Replay);
        }
        if log.is_recorded() {
            checkpoint.check_saved()?;
        }
        self.check_joined(checkpoint)?;
        joined.expect(&checkpoint.joined);
        let outcome = log.restore(checkpoint, || read_state(run.as_mut(), checkpoint, &self.joining()));
        joined.sweep(self.agents());
        outcome?;
        self.see(run.as_ref());
        self.shared.put_back.fetch_add(1, Release);
        Ok(())
    }

    /// Checks that objects that joined the world of a checkpoint are in this one, or can be made, under the numbers
    /// that they had.
    fn check_joined(&self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        for (id, there) in &checkpoint.joined {
            let here = self.agents().of(*id);
            let other = here.filter(|agent| !agent.name().is_empty() && agent.name() != there.name);
            let kept = self.shared.joined.get(*id).filter(|kept| there.part.is_some() && kept != there);
            if let Some(name) = other.map(AgentHandle::name).or(kept.as_ref().map(|kept| &*kept.name)) {
                let (found, expected) = (format!("\"{}\"", there.name), format!("\"{name}\" as it joined this world"));
                return Err(CheckpointError::OtherScene { what: format!("agent {}", id.0), found, expected });
            }
            if there.part.is_none() && here.is_none_or(|agent| agent.state() == AgentState::Gone) {
                return Err(CheckpointError::Own { name: there.name.clone() });
            }
        }
        Ok(())
    }
}

/// Reads the state of a run.
///
/// # Errors
/// [`CheckpointError::Unreadable`]; the run goes on as it was.
pub(super) fn read_state(run: &mut dyn Run, from: &Checkpoint, joining: &Joining) -> Result<(), CheckpointError> {
    let absent = &mut |id| joining.absent(id, &from.joined);
    run.archive(&mut Archive::reader(&from.state), absent).map_err(CheckpointError::Unreadable)
}
