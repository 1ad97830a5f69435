//! Objects that are put into another state, as resets in learning and searches do: one that they had, or another of as many nodes.
//!
//! In: a [`Body`] as [`World::latest`] gives it. Out: the same to the agent, or why it does not fit. Never here: what a model makes of it.

use super::commands::REPLAYED;
use super::error::WorldError;
use super::object::Object;
use super::recording::Entry;
use super::world::World;
use metachron_core::Body;

/// A list of a state that has as many entries as the object has parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Listed {
    what: &'static str,
    count: usize,
}

impl World {
    /// Puts an object into another state before its next step: one that [`World::latest`] gave before, or of as many nodes. A rigid body takes its
    /// place and motion, a tube its nodes and frames, a soft body its vertices or, where a cage or a lattice carries these, the nodes of that
    /// (`SoftState::nodes`); its vertices are then where the nodes carry them, whatever the state says. What is held of a soft body stays where it
    /// is, and what a tube's parts turn with is zero.
    ///
    /// Nothing that the object did before matters for a soft body or a rigid one after: put into one state twice, alone, it does the same twice to
    /// the bit, and the same as when it had that state first to rounding. What else a checkpoint has, such as forces that contacts begin their
    /// next solve with, a state has not.
    ///
    /// # Errors
    /// [`WorldError::Foreign`]; [`WorldError::Refused`] for a state of another kind or length, with the numbers expected, and for numbers that are
    /// not finite. Nothing was done then; nor where the object divides itself otherwise before it hears of it.
    pub fn set_state(&self, object: Object, state: &Body) -> Result<(), WorldError> {
        let agent = self.agent(object)?;
        let refused = |reason: String| Err(WorldError::Refused { name: agent.name().to_owned(), reason });
        let now = agent.latest();
        let is_alike = std::mem::discriminant(state) == std::mem::discriminant(&now.body);
        if !is_alike || matches!(state, Body::Nothing | Body::Tool(_)) || agent.takes_poses() {
            return refused(
                "it takes states of rigid bodies, tubes and soft bodies that are of its own kind".to_owned(),
            );
        }
        let is_carried = matches!(&now.body, Body::Soft(soft) if soft.nodes.is_some());
        let (found, wanted) = (lists(state, is_carried), lists(&now.body, is_carried));
        if found != wanted {
            return refused(format!("the state has {}; expected {}", said(&found), said(&wanted)));
        }
        if !state.is_finite() {
            return refused("every number of a state must be finite".to_owned());
        }
        if self.shared.log.is_replayed() {
            return refused(REPLAYED.to_owned());
        }
        self.shared.log.in_order(
            || self.between_calls(),
            || agent.set_state(state.clone()),
            |log, ()| log.note(|| Entry::SetState(object.id(), Box::new(state.clone()))),
        );
        Ok(())
    }
}

/// The lists of a state that an object takes, of which a cage or a lattice carries the vertices if `is_carried`.
fn lists(body: &Body, is_carried: bool) -> Vec<Listed> {
    let of = |what, count| Listed { what, count };
    match body {
        Body::Curve(curve) => vec![
            of("positions", curve.positions.len()),
            of("velocities", curve.velocities.len()),
            of("frames", curve.frames.len()),
        ],
        Body::Soft(soft) if is_carried => {
            let counts = soft.nodes.as_ref().map_or([0; 2], |nodes| [nodes.positions.len(), nodes.velocities.len()]);
            vec![of("positions of nodes", counts[0]), of("velocities of nodes", counts[1])]
        }
        Body::Soft(soft) => vec![of("positions", soft.positions.len()), of("velocities", soft.velocities.len())],
        Body::Nothing | Body::Rigid(_) | Body::Tool(_) => Vec::new(),
    }
}

fn said(lists: &[Listed]) -> String {
    lists.iter().map(|list| format!("{} {}", list.count, list.what)).collect::<Vec<_>>().join(", ")
}
