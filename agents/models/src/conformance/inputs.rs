//! The promise that a model takes the inputs that it names ([`Agent::inputs`](metachron_contact::Agent::inputs)), and
//! no others.
//!
//! In: a [`Suite`]. Out: an input that is named and refused, or taken and not named. Never here: springs, forces and
//! poses, which show in steps alone.

use super::{Run, Suite};
use glam::DVec3;
use metachron_contact::{Carving, Input, SetMotion};

/// Sends the agent a new place, velocity, state, pressure and region to carve, each to one built anew.
pub(super) fn inputs(suite: &Suite<'_>) -> Result<(), String> {
    let place = SetMotion { position_m: Some(DVec3::new(0.1, 0.2, 0.3)), ..SetMotion::default() };
    let velocity = SetMotion { velocity_m_s: Some(DVec3::new(0.1, 0.2, 0.3)), ..SetMotion::default() };
    // of the whole agent none would be left
    let all = Carving { from_m: DVec3::ZERO, to_m: DVec3::ZERO, radius_m: 1e6 };
    let taken = |input: Input, take: &dyn Fn(&mut Run<'_>) -> bool| {
        let mut run = suite.start();
        let names = run.agent.inputs().has(input);
        match (names, take(&mut run)) {
            (true, false) => Err(format!("it names {} among what it takes, and refuses one", input.name())),
            (false, true) => Err(format!("it takes {}, and does not name them", input.name())),
            _ => Ok(()),
        }
    };
    taken(Input::Place, &|run| run.agent.set_motion(&place))?;
    taken(Input::Velocity, &|run| run.agent.set_motion(&velocity))?;
    taken(Input::Pressure, &|run| run.agent.set_pressure_pa(0.0))?;
    taken(Input::State, &|run| {
        let body = run.snapshot().body;
        run.agent.set_state(&body).is_ok()
    })?;
    match suite.start().agent.carve(&all) {
        Some(removed) => Err(format!("all of it was carved away: {removed:?}; something must be left")),
        None => Ok(()),
    }
}
