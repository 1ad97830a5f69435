//! How worlds start: which executor runs them, and how their time passes.
//!
//! In: a scene, names. Out: a world whose time stands. Never here: calls to the world.

use crate::raised;
use crate::scene::chosen;
use metachron::world::kinds::ExecutorKind;
use metachron::world::{Pace, Scene, World, WorldError};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// The paces, as Python names them: beside a clock, and as fast as objects can step.
const PACES: [&str; 2] = ["real-time", "free"];

/// The name of a pace.
pub const fn pace(is_free: bool) -> &'static str {
    PACES[is_free as usize]
}

/// The pace of this name.
fn pace_of(name: &str) -> PyResult<Pace> {
    match PACES.iter().position(|known| *known == name) {
        Some(0) => Ok(Pace::RealTime),
        Some(_) => Ok(Pace::Free),
        None => {
            let known = PACES.join(", ");
            Err(PyValueError::new_err(format!("there is no pace {name:?}; expected one of {known}")))
        }
    }
}

/// A pace as an argument: by its name, or as a factor.
pub struct WantedPace(pub Pace);

impl<'py> FromPyObject<'_, 'py> for WantedPace {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(factor) = given.extract() {
            return Ok(Self(Pace::Factor(factor)));
        }
        let name: String =
            given.extract().map_err(|_| PyTypeError::new_err("expected \"real-time\", \"free\" or a number"))?;
        pace_of(&name).map(Self)
    }
}

/// Starts a scene; at the free pace in lockstep where none is given.
pub fn started(py: Python<'_>, scene: &Scene, executor: &str, pace: Option<&str>) -> PyResult<World> {
    let kind: ExecutorKind = chosen("executor", executor)?;
    let pace = match pace {
        None if kind == ExecutorKind::Lockstep => Pace::Free,
        None => Pace::RealTime,
        Some(name) => pace_of(name)?,
    };
    let start = || -> Result<World, WorldError> {
        let world = World::start(scene, kind)?;
        if pace == Pace::Free {
            world.set_pace(pace)?;
        }
        Ok(world)
    };
    py.detach(start).map_err(raised::world)
}
