//! Commands to an agent: the newest of each kind, taken at its next turn.
//!
//! In: [`Command`]s from any thread. Out: the newest of each kind, once. Storage is bounded: one place per kind, which a newer command
//! overwrites. Never here: the execution of commands ([`crate::agent_runner`] does).

use metachron_contact::AnchorSpring;
use metachron_core::{AgentId, Anchor, Archive, ArchiveError, Resolution, SimSpan};
use std::sync::atomic::{
    AtomicBool,
    Ordering::{Acquire, Release},
};
use std::sync::{Mutex, OnceLock, PoisonError};

/// A command to an agent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Simulate at this resolution; clamped to the agent's range.
    Retune(Resolution),
    /// Step by this span; clamped to the agent's range.
    SetDt(SimSpan),
    /// The user spring pulls at the agent until the next such command; `None` releases it.
    Hand(Option<AnchorSpring>),
    /// The pressure of what fills the agent, inside minus outside, Pa; an agent that nothing fills, or that refuses it, stays as it is.
    SetPressure(f64),
    /// Wake up from rest.
    Wake,
}

/// Reason why a command was not delivered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SendError {
    /// There is no such agent.
    #[error("there is no agent {} in this run", .0.0)]
    NoAgent(AgentId),
    /// The command holds a number that is not finite, or a negative stiffness or damping.
    #[error("command {0:?} was refused: every number must be finite, stiffness and damping not negative")]
    BadNumber(Command),
}

/// The newest command of each kind, waiting for one agent.
#[derive(Debug, Default)]
pub(super) struct Mailbox {
    /// Whether there is any command: an agent without commands reads only this.
    full: AtomicBool,
    /// Allocated by the first command: most agents never get one.
    pending: OnceLock<Box<Mutex<PendingCommands>>>,
}

/// Contents of a mailbox.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct PendingCommands {
    /// The newest requested resolution.
    pub set_resolution: Option<Resolution>,
    /// The newest requested step length.
    pub dt: Option<SimSpan>,
    /// The newest state of the user spring.
    pub hand: Option<Option<AnchorSpring>>,
    /// The newest requested pressure, Pa.
    pub pressure_pa: Option<f64>,
}

impl Mailbox {
    /// Stores `command` in the place of its kind.
    ///
    /// # Errors
    /// [`SendError::BadNumber`]; nothing is delivered then.
    pub fn send(&self, command: Command) -> Result<(), SendError> {
        if !is_sound(&command) {
            return Err(SendError::BadNumber(command));
        }
        if command == Command::Wake {
            return Ok(());
        }
        let pending = self.pending.get_or_init(Box::default);
        let mut pending = pending.lock().unwrap_or_else(PoisonError::into_inner);
        match command {
            Command::Retune(resolution) => pending.set_resolution = Some(resolution),
            Command::SetDt(dt) => pending.dt = Some(dt),
            Command::Hand(pull) => pending.hand = Some(pull),
            Command::SetPressure(pressure_pa) => pending.pressure_pa = Some(pressure_pa),
            Command::Wake => {}
        }
        self.full.store(true, Release);
        Ok(())
    }

    /// Writes or reads the commands that wait.
    pub fn archive(&self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        let mut is_full = self.has_pending();
        archive.value(&mut is_full)?;
        if is_full {
            let pending = self.pending.get_or_init(Box::default);
            archive.value(&mut *pending.lock().unwrap_or_else(PoisonError::into_inner))?;
        }
        self.full.store(is_full, Release);
        Ok(())
    }

    /// Whether any command has arrived.
    pub fn has_pending(&self) -> bool {
        self.full.load(Acquire)
    }

    /// All commands since the last call. Never blocks: while another thread is writing it returns nothing yet.
    pub fn take(&self) -> PendingCommands {
        if !self.has_pending() {
            return PendingCommands::default();
        }
        let Some(Ok(mut pending)) = self.pending.get().map(|pending| pending.try_lock()) else {
            return PendingCommands::default();
        };
        self.full.store(false, Release);
        std::mem::take(&mut *pending)
    }
}

fn is_sound(command: &Command) -> bool {
    match command {
        Command::Retune(wanted) => wanted.eps_m.is_finite(),
        Command::SetPressure(pressure_pa) => pressure_pa.is_finite(),
        Command::SetDt(_) | Command::Hand(None) | Command::Wake => true,
        Command::Hand(Some(pull)) => {
            let anchor = match pull.anchor {
                Anchor::Arc(arc_m) => arc_m.is_finite(),
                Anchor::Local(point) => point.is_finite(),
                Anchor::Vertex(_) => true,
            };
            let springs = [pull.stiffness_n_m, pull.damping_n_s_m];
            anchor
                && pull.target.is_finite()
                && pull.target_velocity.is_finite()
                && springs.iter().all(|k| k.is_finite() && *k >= 0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn pull(target: DVec3) -> AnchorSpring {
        let anchor = Anchor::Local(DVec3::ZERO);
        AnchorSpring { by: None, anchor, target, target_velocity: DVec3::ZERO, stiffness_n_m: 1.0, damping_n_s_m: 0.0 }
    }

    #[test]
    fn the_newest_command_of_a_kind_takes_the_place_of_the_older() {
        let mail = Mailbox::default();
        for eps_m in [0.1, 0.2, 0.3] {
            mail.send(Command::Retune(Resolution { eps_m, n: 1 })).unwrap();
        }
        mail.send(Command::SetDt(SimSpan::from_nanos(5))).unwrap();
        let taken = mail.take();
        assert_eq!((taken.set_resolution.unwrap().eps_m, taken.dt), (0.3, Some(SimSpan::from_nanos(5))));
        let taken = mail.take();
        assert_eq!((taken.set_resolution, taken.dt, taken.hand), (None, None, None), "once");
    }

    #[test]
    fn a_release_is_a_command_too() {
        let mail = Mailbox::default();
        mail.send(Command::Hand(Some(pull(DVec3::X)))).unwrap();
        mail.send(Command::Hand(None)).unwrap();
        assert_eq!(mail.take().hand, Some(None));
        assert_eq!(mail.take().hand, None);
    }

    #[test]
    fn a_reader_that_meets_a_writer_reads_the_command_the_next_time() {
        let mail = Mailbox::default();
        mail.send(Command::SetDt(SimSpan::from_nanos(5))).unwrap();
        let writing = mail.pending.get().unwrap().lock().unwrap();
        assert_eq!(mail.take().dt, None);
        drop(writing);
        assert_eq!(mail.take().dt, Some(SimSpan::from_nanos(5)));
    }

    #[test]
    fn a_spring_that_is_not_finite_is_refused_when_sent() {
        let mail = Mailbox::default();
        let bad = Command::Hand(Some(pull(DVec3::NAN)));
        assert!(matches!(mail.send(bad), Err(SendError::BadNumber(_))));
        let negative = AnchorSpring { stiffness_n_m: -1.0, ..pull(DVec3::X) };
        assert!(mail.send(Command::Hand(Some(negative))).is_err());
        assert!(mail.send(Command::Retune(Resolution { eps_m: f64::NAN, n: 0 })).is_err());
        assert_eq!(mail.take().hand, None);
    }
}
