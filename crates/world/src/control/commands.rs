//! Changes of an object of a world: commands, and states that are set.
//!
//! In: a command, or a state. Out: the same in the object's mailbox, and in a recording; or why the object does not
//! take it. Never here: the effect in the object.

use crate::error::WorldError;
use crate::history::log::Mode;
use crate::history::recording::Entry;
use crate::reading::object::Object;
use crate::world::World;
use metachron_core::{Anchor, Body, Snapshot};
use metachron_runtime::{AgentHandle, Command, Keyed, SendError};

/// Why a replay refuses commands.
pub(super) const REPLAYED: &str = "a replay does what its recording says, and nothing else";

impl World {
    /// Sends a command to an object, which obeys at its next step.
    ///
    /// # Errors
    /// [`WorldError::NotTaken`] and [`WorldError::NoMotor`] for a command that the object does not take, with the
    /// inputs that it takes; [`WorldError::NoPoint`] for a material point that it does not have;
    /// [`WorldError::Refused`] for numbers outside their range; [`WorldError::Foreign`], [`WorldError::Gone`] and
    /// [`WorldError::Stopped`]; [`WorldError::Stalled`] of a world in lockstep that is recorded. Nothing was done then.
    pub fn command(&self, object: Object, command: Command) -> Result<(), WorldError> {
        let agent = self.agent(object)?;
        let point = match command {
            Command::Force(Keyed { what: Some(force), .. }) | Command::Impulse(force) => Some(force.anchor),
            Command::Spring(Keyed { what: Some(spring), .. }) => Some(spring.anchor),
            _ => None,
        };
        if let Some(point) = point.filter(|_| agent.inputs().lacks(command.needs()).is_none()) {
            self.check_point(object, &agent.latest(), point)?;
        }
        if self.shared.log.is_replayed() {
            return Err(WorldError::Refused { name: agent.name().to_owned(), reason: REPLAYED.to_owned() });
        }
        let note = |log: &mut Mode, sent: &Result<(), SendError>| {
            if sent.is_ok() {
                log.note(|| Entry::Command(object.id(), command));
            }
        };
        let sent = self.shared.log.in_order(|| self.between_calls(), || agent.send(command), note);
        sent?.map_err(|error| self.unsent(agent, error))
    }

    /// Why an agent was not sent something.
    pub(super) fn unsent(&self, agent: &AgentHandle, error: SendError) -> WorldError {
        let name = || agent.name().to_owned();
        match error {
            SendError::NotTaken { .. } => WorldError::NotTaken(error),
            SendError::Ended(_) => WorldError::Stopped,
            SendError::NoAgent(_) => WorldError::Gone { name: name() },
            SendError::NoMotor { joint, drives, .. } => {
                let drives: Vec<_> = drives.into_iter().map(|joint| self.joint_name(joint)).collect();
                let drives = if drives.is_empty() { "none".to_owned() } else { drives.join(", ") };
                WorldError::NoMotor { name: name(), joint: self.joint_name(joint), drives }
            }
            other => WorldError::Refused { name: name(), reason: other.to_string() },
        }
    }

    fn check_point(&self, object: Object, state: &Snapshot, anchor: Anchor) -> Result<(), WorldError> {
        state.body.point(anchor).map(drop).ok_or_else(|| self.no_point(object, anchor))
    }

    /// Why an object has no such point.
    pub(crate) fn no_point(&self, object: Object, anchor: Anchor) -> WorldError {
        let Ok(agent) = self.agent(object) else { return WorldError::Foreign };
        let wanted = match &agent.latest().body {
            Body::Nothing => "it has no matter".to_owned(),
            Body::Curve(curve) => {
                let length_m = curve.arc_m.last().copied().unwrap_or_default();
                format!("it has Arc of 0 to {length_m} m")
            }
            Body::Rigid(_) | Body::Tool(_) => "it has Local, metres from its centre of mass in its own axes".to_owned(),
            Body::Soft(soft) => format!("it has Vertex of 0 to {}", soft.positions.len().saturating_sub(1)),
        };
        WorldError::NoPoint { name: agent.name().to_owned(), anchor, wanted }
    }
}
