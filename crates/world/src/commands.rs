//! What is done to an object of a world: commands, and states that are set.
//!
//! In: a command, or a state. Out: the same in the object's mailbox, and in a recording; or why the object does not take it. Never here: what
//! an object makes of it.

use super::error::WorldError;
use super::log::Mode;
use super::object::Object;
use super::recording::Entry;
use super::world::World;
use glam::DVec3;
use metachron_core::{Anchor, Body, Snapshot};
use metachron_runtime::{Command, Keyed};

/// Why a replay refuses what is asked of it.
pub(super) const REPLAYED: &str = "a replay does what its recording says, and nothing else";

impl World {
    /// Sends a command to an object, which obeys at its next step.
    ///
    /// # Errors
    /// [`WorldError::Foreign`]; [`WorldError::NoPoint`] for a material point that it does not have; [`WorldError::Refused`] for numbers outside
    /// their range and for a joint that it cannot drive. Nothing was done then.
    pub fn command(&self, object: Object, command: Command) -> Result<(), WorldError> {
        let agent = self.agent(object)?;
        let refused = |reason: String| WorldError::Refused { name: agent.name().to_owned(), reason };
        let state = agent.latest();
        if agent.takes_poses() && matches!(command, Command::Force(_) | Command::Impulse(_) | Command::Spring(_)) {
            return Err(refused("it is kinematic: no force moves it; lead it by poses".to_owned()));
        }
        match command {
            Command::Force(Keyed { what: Some(force), .. }) | Command::Impulse(force) => {
                self.check_point(object, &state, force.anchor)?;
                if force.torque_n_m != DVec3::ZERO && matches!(state.body, Body::Soft(_)) {
                    return Err(refused("its vertices do not turn, so a torque has nothing to act on".to_owned()));
                }
            }
            Command::Spring(Keyed { what: Some(spring), .. }) => self.check_point(object, &state, spring.anchor)?,
            Command::Carve(_) if !agent.form().is_some_and(|form| form.has_cells()) => {
                return Err(refused("only solids and sheets have cells that can be removed".to_owned()));
            }
            _ => {}
        }
        if self.shared.log.is_replayed() {
            return Err(refused(REPLAYED.to_owned()));
        }
        let note = |log: &mut Mode, sent: &Result<(), String>| {
            if sent.is_ok() {
                log.note(|| Entry::Command(object.id(), command));
            }
        };
        let send = || agent.send(command).map_err(|error| error.to_string());
        self.shared.log.in_order(|| self.between_calls(), send, note).map_err(refused)
    }

    fn check_point(&self, object: Object, state: &Snapshot, anchor: Anchor) -> Result<(), WorldError> {
        state.body.point(anchor).map(drop).ok_or_else(|| self.no_point(object, anchor))
    }

    /// Why an object has no such point.
    pub(super) fn no_point(&self, object: Object, anchor: Anchor) -> WorldError {
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
