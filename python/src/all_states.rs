//! The newest states of all objects as arrays.
//!
//! In: a world. Out: read-only arrays. Never here: a lock, properties that only some objects have ([`crate::state`]).

use crate::numbers::{array, rows};
use crate::state::Points;
use glam::DVec3;
use metachron::core::Body;
use metachron::world::{Object, WorldCalls};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

/// The newest states of all objects, in one call. It never changes; its arrays are read-only.
#[pyclass(frozen, get_all, module = "metachron")]
pub struct States {
    /// Of the n objects.
    names: Vec<String>,
    /// (n,), s: the moment of each.
    times: Py<PyArray1<f64>>,
    /// (n + 1,): `positions[starts[i]:starts[i + 1]]` are object i's, one point of a rigid body or tool.
    starts: Py<PyArray1<i64>>,
    /// (m, 3), m: the nodes of deformables, the centres of mass of rigid bodies and the tips of tools.
    positions: Py<PyArray2<f64>>,
    /// (m, 3), m/s, of the same points.
    velocities: Py<PyArray2<f64>>,
    /// (n, 4): from the axes of each rigid body or tool to the world's; not numbers for a deformable.
    rotations: Py<PyArray2<f64>>,
    /// (n, 3), rad/s, world axes, likewise.
    spins: Py<PyArray2<f64>>,
}

impl States {
    pub fn of(py: Python<'_>, world: &dyn WorldCalls) -> Self {
        let state = |object: Object| Some((world.name(object.into()).ok()?, world.latest(object).ok()?));
        let all: Vec<_> = world.all_objects().into_iter().filter_map(state).collect();
        let points = || all.iter().map(|(_, state)| Points::of(&state.body));
        let mut starts = vec![0];
        for points in points() {
            starts.push(starts[starts.len() - 1] + points.positions.len() as i64);
        }
        let vectors = |of: fn(Points<'_>) -> &[DVec3]| rows(py, points().flat_map(of).map(|v| v.to_array())).unbind();
        let turning = all.iter().map(|(_, state)| match &state.body {
            Body::Rigid(rigid) => (rigid.rotation.to_array(), rigid.spin.to_array()),
            Body::Tool(tool) => (tool.rotation.to_array(), tool.spin.to_array()),
            _ => ([f64::NAN; 4], [f64::NAN; 3]),
        });
        let (rotations, spins): (Vec<_>, Vec<_>) = turning.unzip();
        let times: Vec<_> = all.iter().map(|(_, state)| state.moment().as_secs_f64()).collect();
        Self {
            names: all.iter().map(|(name, _)| name.to_string()).collect(),
            times: array(py, times.into()).unbind(),
            starts: array(py, starts.into()).unbind(),
            positions: vectors(|points| points.positions),
            velocities: vectors(|points| points.velocities),
            rotations: rows(py, rotations.into_iter()).unbind(),
            spins: rows(py, spins.into_iter()).unbind(),
        }
    }
}

#[pymethods]
impl States {
    fn __repr__(&self) -> String {
        format!("<States of {} objects>", self.names.len())
    }
}
