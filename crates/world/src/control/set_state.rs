//! Objects that are put into another state, as resets in learning and searches do: one that they had, or another of as many nodes.
//!
//! In: a [`Body`] as [`World::latest`] gives it. Out: the same to the agent, or why it does not fit. Never here: its
//! use in the model.

use super::commands::REPLAYED;
use crate::error::WorldError;
use crate::history::log::Mode;
use crate::history::recording::Entry;
use crate::reading::object::Object;
use crate::world::World;
use metachron_contact::Input;
use metachron_core::Body;
use metachron_runtime::SendError;

/// How many entries a list of a state has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ListLength {
    what: &'static str,
    count: usize,
}

impl World {
    /// Puts an object into another state before its next step: one that [`World::latest`] gave before, or of as many nodes. A rigid body takes its
    /// place and motion, a tube its nodes and frames, a soft body its vertices or, where a cage or a lattice carries these, the nodes of that
    /// (`SoftState::nodes`); its vertices are then where the nodes carry them, whatever the state says. The held places
    /// of a soft body stay where they are, and the spin of a tube's parts is zero.
    ///
    /// Nothing that the object did before matters for a soft body or a rigid one after: put into one state twice, alone, it does the same twice to
    /// the bit, and the same as when it had that state first to rounding. Further parts of a checkpoint, such as the
    /// forces with which contacts begin their next solve, a state does not have.
    ///
    /// # Errors
    /// [`WorldError::NotTaken`] for an object that takes no state; [`WorldError::Refused`] for a state of another kind
    /// or length, with the expected one, and for numbers that are not finite or beyond their bounds
    /// ([`metachron_runtime::OutOfBounds`]); [`WorldError::Foreign`], [`WorldError::Gone`] and [`WorldError::Stopped`].
    /// The object stays as it is then, and where it has divided itself otherwise before it takes the state up.
    pub fn set_state(&self, object: Object, state: &Body) -> Result<(), WorldError> {
        let agent = self.agent(object)?;
        let refused = |reason: String| WorldError::Refused { name: agent.name().to_owned(), reason };
        if agent.inputs().has(Input::State) {
            check_fits(state, &agent.latest().body).map_err(refused)?;
        }
        if self.shared.log.is_replayed() {
            return Err(refused(REPLAYED.to_owned()));
        }
        let note = |log: &mut Mode, set: &Result<(), SendError>| {
            if set.is_ok() {
                log.note(|| Entry::SetState(object.id(), Box::new(state.clone())));
            }
        };
        let set = self.shared.log.in_order(|| self.between_calls(), || agent.set_state(state.clone()), note);
        set?.map_err(|error| self.unsent(agent, error))
    }
}

/// Checks that an object whose state is `now` can take the state `new`.
///
/// # Errors
/// The mismatch, and the expected value.
fn check_fits(new: &Body, now: &Body) -> Result<(), String> {
    if std::mem::discriminant(new) != std::mem::discriminant(now) {
        return Err(format!("the state is that of {}; expected that of {}", kind(new), kind(now)));
    }
    let is_carried = matches!(now, Body::Soft(soft) if soft.nodes.is_some());
    let (found, wanted) = (list_lengths(new, is_carried), list_lengths(now, is_carried));
    if found != wanted {
        return Err(format!("the state has {}; expected {}", enumerate(&found), enumerate(&wanted)));
    }
    if new.is_finite() { Ok(()) } else { Err("every number of a state must be finite".to_owned()) }
}

/// The lists of a state that an object takes, of which a cage or a lattice carries the vertices if `is_carried`.
fn list_lengths(body: &Body, is_carried: bool) -> Vec<ListLength> {
    let of = |what, count| ListLength { what, count };
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

/// The kind of object that a state is of.
const fn kind(body: &Body) -> &'static str {
    match body {
        Body::Nothing => "nothing that has matter",
        Body::Curve(_) => "a tube",
        Body::Rigid(_) => "a rigid body",
        Body::Soft(_) => "a soft body",
        Body::Tool(_) => "a tool",
    }
}

fn enumerate(lists: &[ListLength]) -> String {
    lists.iter().map(|list| format!("{} {}", list.count, list.what)).collect::<Vec<_>>().join(", ")
}
