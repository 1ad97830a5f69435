//! Spatial queries of a world: answers to rays, nearest points and contacts.
//!
//! In: the engine's answers. Out: names, numbers and vectors. Never here: the search.

use crate::numbers::row;
use crate::object::name;
use metachron::world::{self, World};
use numpy::PyArray1;
use pyo3::prelude::*;

/// A hit of a ray or a search.
#[pyclass(frozen, get_all, module = "metachron")]
pub struct Hit {
    name: String,
    /// Of its surface, m.
    point: Py<PyArray1<f64>>,
    /// Of its surface there, outwards.
    normal: Py<PyArray1<f64>>,
    /// m; negative within what overlaps.
    distance: f64,
}

/// A contact as it is now.
#[pyclass(frozen, get_all, module = "metachron")]
pub struct Contact {
    other: String,
    /// When it began, s.
    since: f64,
    /// The place that bears most, m.
    point: Py<PyArray1<f64>>,
    /// The normal there, towards the object.
    normal: Py<PyArray1<f64>>,
    /// On the object, in the mean of the last step, N, world axes.
    force: Py<PyArray1<f64>>,
    /// The deepest overlap, m.
    depth: f64,
}

impl Hit {
    /// A hit in a world.
    pub fn new(py: Python<'_>, world: &World, hit: &world::Hit) -> Self {
        let [point, normal] = [hit.point_m, hit.normal].map(|v| row(py, v.to_array()).unbind());
        Self { name: name(world, hit.what).to_string(), point, normal, distance: hit.distance_m }
    }
}

impl Contact {
    /// A contact in a world.
    pub fn new(py: Python<'_>, world: &World, contact: &world::ContactNow) -> Self {
        let vectors = [contact.point_m, contact.normal, contact.force_n];
        let [point, normal, force] = vectors.map(|v| row(py, v.to_array()).unbind());
        let (other, since) = (name(world, contact.with).to_string(), contact.since.as_secs_f64());
        Self { other, since, point, normal, force, depth: contact.depth_m }
    }
}

#[pymethods]
impl Hit {
    fn __repr__(&self) -> String {
        format!("<Hit {:?} at {} m>", self.name, self.distance)
    }
}

#[pymethods]
impl Contact {
    fn __repr__(&self) -> String {
        format!("<Contact with {:?} since {} s>", self.other, self.since)
    }
}
