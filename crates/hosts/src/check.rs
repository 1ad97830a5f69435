//! Whether the numbers of states that came can be: they are checked as a scene's are, before anything reads them.
//!
//! In: states from elsewhere. Out: the first fault. Never here: bytes ([`crate::wire`]), the numbers of commands, which the
//! world that takes them checks.

use crate::wire::{Moment, ObjectState};
use glam::DQuat;
use metachron_core::{AgentId, Body, CurveState, Snapshot, SoftState};
use metachron_runtime::{Reach, check_state};

/// The most objects, and the longest name in bytes, of a world that is mirrored.
pub(crate) const OBJECTS_MAX: u32 = 1 << 20;
const NAME_MAX: usize = 1024;
/// By how much the length of a rotation's quaternion may differ from 1: what rounding leaves, and far less than is seen.
const UNIT_TOLERANCE: f64 = 1e-6;

/// Checks all that a message says.
///
/// # Errors
/// The first fault.
pub(crate) fn moment(moment: &Moment) -> Result<(), String> {
    moment.states.iter().try_for_each(object)?;
    moment.gone.iter().try_for_each(|id| number(*id))?;
    if moment.events.iter().all(|event| event.is_finite()) { Ok(()) } else { Err("an event is not finite".to_owned()) }
}

/// Checks where objects may be found.
///
/// # Errors
/// The first fault.
pub(crate) fn reaches(all: &[Reach]) -> Result<(), String> {
    let is_sound = |reach: &Reach| reach.low_m.is_finite() && reach.high_m.is_finite() && reach.speed_m_s.is_finite();
    all.iter().try_for_each(|reach| {
        number(reach.id)?;
        if is_sound(reach) { Ok(()) } else { Err(format!("the reach of object {} is not finite", reach.id.0)) }
    })
}

fn object(ObjectState { id, name, state }: &ObjectState) -> Result<(), String> {
    number(*id)?;
    if name.is_empty() || name.len() > NAME_MAX {
        return Err(format!("the name of object {} has {} bytes; expected 1 to {NAME_MAX}", id.0, name.len()));
    }
    snapshot(state).map_err(|fault| format!("the state of \"{name}\": {fault}"))
}

fn number(id: AgentId) -> Result<(), String> {
    if id.0 < OBJECTS_MAX {
        Ok(())
    } else {
        Err(format!("an object has number {}; expected below {OBJECTS_MAX}", id.0))
    }
}

fn snapshot(state: &Snapshot) -> Result<(), String> {
    if !state.is_finite() {
        return Err("it is not finite".to_owned());
    }
    if state.time.as_nanos().checked_add(state.clock_offset.as_nanos()).is_none() {
        return Err("its time is beyond all times".to_owned());
    }
    others(state).try_for_each(number)?;
    body(&state.body)
}

/// The objects that a state names besides its own.
fn others(state: &Snapshot) -> impl Iterator<Item = AgentId> {
    let tool = state.body.tool();
    let held = tool.and_then(|tool| tool.grasp.as_ref()).map(|grasp| grasp.target);
    let held = held.into_iter().chain(tool.and_then(|tool| tool.admits));
    let pairs = state.pairs.iter().map(|pair| pair.with).chain(state.grips.iter().filter_map(|grip| grip.by));
    let listed = state.touches.iter().chain(&state.bonds).copied();
    let events = state.events.iter().filter_map(|event| event.with);
    held.chain(pairs).chain(listed).chain(events).chain(state.cluster.map(|cluster| cluster.leader))
}

/// Checks where its matter is.
fn body(body: &Body) -> Result<(), String> {
    check_state(body).map_err(|error| error.to_string())?;
    match body {
        Body::Nothing => Ok(()),
        Body::Rigid(body) => rotations(&[body.rotation]),
        Body::Tool(tool) if (0.0..=1.0).contains(&tool.jaw) => rotations(&[tool.rotation]),
        Body::Tool(tool) => Err(format!("its jaws are open by {}; expected 0 to 1", tool.jaw)),
        Body::Curve(curve) => self::curve(curve),
        Body::Soft(soft) => self::soft(soft),
    }
}

fn curve(curve: &CurveState) -> Result<(), String> {
    let nodes = curve.positions.len();
    let lengths = [curve.arc_m.len(), curve.velocities.len(), curve.radii_m.len()];
    let has_flat = curve.flattening_m.is_empty() || curve.flattening_m.len() == nodes;
    if nodes == 1 || lengths != [nodes; 3] || curve.frames.len() != nodes.saturating_sub(1) || !has_flat {
        return Err("its lists of nodes have different lengths".to_owned());
    }
    if !curve.arc_m.is_sorted() || curve.arc_m.iter().any(|arc_m| !arc_m.is_finite()) {
        return Err("its arc lengths do not rise".to_owned());
    }
    if curve.radii_m.iter().any(|radius_m| *radius_m <= 0.0) {
        return Err("a radius is not above zero".to_owned());
    }
    rotations(&curve.frames)
}

fn soft(soft: &SoftState) -> Result<(), String> {
    let nodes = soft.nodes.as_ref().map_or([0; 2], |nodes| [nodes.positions.len(), nodes.velocities.len()]);
    if soft.positions.len() == soft.velocities.len() && nodes[0] == nodes[1] {
        return Ok(());
    }
    Err("its lists of vertices have different lengths".to_owned())
}

fn rotations(all: &[DQuat]) -> Result<(), String> {
    match all.iter().find(|rotation| (rotation.length() - 1.0).abs() > UNIT_TOLERANCE) {
        Some(rotation) => Err(format!("a rotation has length {}; expected 1", rotation.length())),
        None => Ok(()),
    }
}
