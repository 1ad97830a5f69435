//! How worlds start: which executor runs them, and how their time passes.
//!
//! In: a scene, names. Out: a world whose time stands. Never here: what is done to it.

use crate::raised;
use metachron::world::kinds::ExecutorKind;
use metachron::world::{Pace, Scene, World, WorldError};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The executors, as Python names them.
const EXECUTORS: [ExecutorKind; 4] =
    [ExecutorKind::Lockstep, ExecutorKind::Threads, ExecutorKind::Pool, ExecutorKind::Auto];

/// The paces, as Python names them: beside a clock, and as fast as objects can step.
const PACES: [&str; 2] = ["real-time", "free"];

/// The name of a pace.
pub const fn pace(is_free: bool) -> &'static str {
    PACES[is_free as usize]
}

/// Starts a scene; at the free pace in lockstep where none is given.
pub fn started(py: Python<'_>, scene: &Scene, executor: &str, pace: Option<&str>) -> PyResult<World> {
    let Some(kind) = EXECUTORS.into_iter().find(|kind| kind.name() == executor) else {
        let known = EXECUTORS.map(ExecutorKind::name).join(", ");
        return Err(PyValueError::new_err(format!("there is no executor {executor:?}; expected one of {known}")));
    };
    let is_free = match pace.map(|pace| PACES.iter().position(|known| *known == pace)) {
        None => kind == ExecutorKind::Lockstep,
        Some(Some(place)) => place == 1,
        Some(None) => {
            let (given, known) = (pace.unwrap_or_default(), PACES.join(", "));
            return Err(PyValueError::new_err(format!("there is no pace {given:?}; expected one of {known}")));
        }
    };
    let start = || -> Result<World, WorldError> {
        let world = World::start(scene, kind)?;
        if is_free {
            world.set_pace(Pace::Free)?;
        }
        Ok(world)
    };
    py.detach(start).map_err(raised::world)
}
