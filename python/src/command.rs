//! Keyword arguments of commands: where on an object, under which key, for how long; and the motor of a joint.
//!
//! In: keywords as Python gives them. Out: the engine's values. Never here: whether an object takes the command.

use crate::numbers::{Vector, span};
use crate::raised;
use glam::DVec3;
use metachron::contact::joint::{Motor, MotorGoal};
use metachron::core::Anchor;
use metachron::world::Command;
use pyo3::conversion::FromPyObjectOwned;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The keyword arguments of a call.
pub struct Keywords<'a, 'py>(Option<&'a Bound<'py, PyDict>>);

impl<'a, 'py> Keywords<'a, 'py> {
    /// The keyword arguments of the method `method`, which takes `known` ones.
    pub fn new(method: &str, given: Option<&'a Bound<'py, PyDict>>, known: &[&str]) -> PyResult<Self> {
        for (key, _) in given.into_iter().flat_map(|given| given.iter()) {
            let key: String = key.extract()?;
            if !known.contains(&&*key) {
                let takes = known.join(", ");
                let message = format!("{method}() takes no keyword argument '{key}'; it takes {takes}");
                return Err(PyTypeError::new_err(message));
            }
        }
        Ok(Self(given))
    }

    /// One of them; `None` where it is missing or `None`.
    pub fn get<T: FromPyObjectOwned<'py>>(&self, name: &str) -> PyResult<Option<T>> {
        let Some(value) = self.0.map(|given| given.get_item(name)).transpose()?.flatten() else { return Ok(None) };
        let wrong = |error: T::Error| raised::of_argument(value.py(), &format!("argument '{name}'"), &error.into());
        if value.is_none() { Ok(None) } else { value.extract().map(Some).map_err(wrong) }
    }

    /// The material point: the centre of mass where none is given.
    pub fn anchor(&self) -> PyResult<Anchor> {
        let arc = self.get("arc")?.map(Anchor::Arc);
        let local = self.get("local")?.map(|Vector(local)| Anchor::Local(local));
        let vertex = self.get("vertex")?.map(Anchor::Vertex);
        let mut given = [arc, local, vertex].into_iter().flatten();
        match (given.next(), given.next()) {
            (anchor, None) => Ok(anchor.unwrap_or(Anchor::Local(DVec3::ZERO))),
            _ => Err(PyTypeError::new_err("a point is given by one of arc, local and vertex")),
        }
    }

    /// The command under its key and for its time; the command under that key is taken back where nothing `is_given`.
    pub fn timed(&self, command: Command, is_given: bool) -> PyResult<Command> {
        let command = if is_given { command } else { command.taken_back() };
        let command = command.key(self.get("key")?.unwrap_or(0));
        let expires: Option<f64> = self.get("expires")?;
        Ok(match expires {
            Some(seconds) => command.expires_after(span("expires", seconds)?),
            None => command,
        })
    }

    /// The goal of a joint's motor; `None` where there is no goal, which takes the motor back.
    pub fn motor(&self) -> PyResult<Option<Motor>> {
        let velocity: Option<f64> = self.get("velocity")?;
        let stiffness: Option<f64> = self.get("stiffness")?;
        let damping: Option<f64> = self.get("damping")?;
        let max_effort = self.get("max_effort")?.unwrap_or(f64::INFINITY);
        let goal = match (self.get("position")?, stiffness, velocity) {
            (Some(position), Some(stiffness), velocity) => {
                let (velocity, damping) = (velocity.unwrap_or(0.0), damping.unwrap_or(0.0));
                MotorGoal::Spring { position, velocity, stiffness, damping }
            }
            (Some(_), None, _) => {
                return Err(PyValueError::new_err("a motor to a position needs a stiffness, N·m/rad or N/m"));
            }
            (None, None, Some(velocity)) if damping.is_none() => MotorGoal::Velocity(velocity),
            (None, None, None) if damping.is_none() => return Ok(None),
            _ => return Err(PyValueError::new_err("stiffness and damping are of a motor to a position")),
        };
        Ok(Some(Motor { goal, max_effort }))
    }
}
