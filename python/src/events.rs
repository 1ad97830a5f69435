//! Events of a world since it was last asked.
//!
//! In: the world's events. Out: a list of them, oldest first. Never here: waiting.

use crate::numbers::row;
use crate::object::Object;
use glam::DVec3;
use metachron::world::{self, EventFilter, EventReader, Happening, WorldCalls};
use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// Listens to a world. An object keeps its newest 128 events until they are drained; of a world elsewhere all objects together 4096.
#[pyclass(frozen, module = "metachron")]
pub struct Events {
    world: Arc<dyn WorldCalls>,
    events: Mutex<Box<dyn EventReader>>,
}

/// Something that happened.
#[pyclass(frozen, module = "metachron")]
pub struct Event {
    #[pyo3(get)]
    kind: &'static str,
    /// The object that it happened to.
    #[pyo3(get)]
    object: Object,
    /// As a sentence.
    text: String,
    /// The end of the step in which it happened, s.
    #[pyo3(get)]
    time: f64,
    /// Of a contact the object or solid that it touches; of one that joined a cluster its leader.
    #[pyo3(get)]
    other: Option<String>,
    /// Of a contact the place that bore most, m.
    #[pyo3(get)]
    point: Option<Py<PyArray1<f64>>>,
    /// Of a contact the normal there, towards the object.
    #[pyo3(get)]
    normal: Option<Py<PyArray1<f64>>>,
    /// Of a contact the greatest force on the object in the mean of a step so far, N, world axes.
    #[pyo3(get)]
    force: Option<Py<PyArray1<f64>>>,
}

/// The events that are listened for: of contacts of at least `above` newtons, of changes of state, of one object where it is given.
pub fn filter(contacts: bool, states: bool, above: f64, of: Option<world::Object>) -> PyResult<EventFilter> {
    let filter = match (contacts, states) {
        (true, true) => EventFilter::all(),
        (true, false) => EventFilter::contacts(),
        (false, true) => EventFilter::states(),
        (false, false) => return Err(PyValueError::new_err("events are of contacts, of states, or of both")),
    };
    if above.is_nan() || above < 0.0 {
        return Err(PyValueError::new_err(format!("above is {above:?} N; expected 0 or more")));
    }
    Ok(of.into_iter().fold(filter.above_n(above), EventFilter::of))
}

impl Events {
    pub fn new(world: Arc<dyn WorldCalls>, filter: EventFilter) -> Self {
        let events = Mutex::new(world.listen(filter));
        Self { world, events }
    }

    fn event(&self, py: Python<'_>, event: &world::Event) -> Event {
        let bare = Event {
            kind: event.what.name(),
            object: Object::new(&*self.world, event.object),
            text: event.to_string(),
            time: event.at.as_secs_f64(),
            other: event.other.as_deref().map(str::to_owned),
            point: None,
            normal: None,
            force: None,
        };
        match event.what {
            Happening::Contact(contact) => {
                let vector = |v: DVec3| Some(row(py, v.to_array()).unbind());
                let (point, normal) = (vector(contact.point_m), vector(contact.normal));
                Event { point, normal, force: vector(contact.force_n), ..bare }
            }
            _ => bare,
        }
    }
}

#[pymethods]
impl Events {
    /// The events since the last call, oldest first.
    fn drain(&self, py: Python<'_>) -> Vec<Event> {
        let all = self.events.lock().unwrap_or_else(PoisonError::into_inner).take();
        all.iter().map(|event| self.event(py, event)).collect()
    }

    fn __repr__(&self) -> String {
        format!("<Events, {} lost>", self.lost())
    }

    /// How many were overwritten before they were drained.
    #[getter]
    fn lost(&self) -> u64 {
        self.events.lock().unwrap_or_else(PoisonError::into_inner).lost()
    }
}

#[pymethods]
impl Event {
    fn __str__(&self) -> &str {
        &self.text
    }

    fn __repr__(&self) -> String {
        let other = self.other.as_ref().map(|other| format!(", {other:?}")).unwrap_or_default();
        format!("<Event {} of {:?}{other} at {} s>", self.kind, self.object.name(), self.time)
    }
}
