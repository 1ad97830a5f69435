//! What happened in a world since it was last asked.
//!
//! In: the world's events. Out: a list of them, oldest first. Never here: waiting.

use crate::numbers::row;
use crate::object::{Object, name, name_of_touched};
use glam::DVec3;
use metachron::world::{self, Happening, World};
use numpy::PyArray1;
use pyo3::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// Listens to a world. An object keeps its newest 128 events until they are drained.
#[pyclass(frozen, module = "metachron")]
pub struct Events {
    world: World,
    fixed: Arc<[String]>,
    events: Mutex<world::Events>,
}

/// Something that happened.
#[pyclass(frozen, get_all, module = "metachron")]
pub struct Event {
    kind: &'static str,
    /// The object that it happened to.
    object: Object,
    /// The end of the step in which it happened, s.
    time: f64,
    /// Of a contact what it touches; of one that joined a cluster its leader.
    other: Option<String>,
    /// Of a contact the place that bore most, m.
    point: Option<Py<PyArray1<f64>>>,
    /// Of a contact the normal there, towards the object.
    normal: Option<Py<PyArray1<f64>>>,
    /// Of a contact the greatest force on the object in the mean of a step so far, N, world axes.
    force: Option<Py<PyArray1<f64>>>,
}

impl Events {
    /// One of this world, whose static solids have these names.
    pub fn new(world: &World, fixed: &Arc<[String]>, filter: world::EventFilter) -> Self {
        Self { world: world.clone(), fixed: Arc::clone(fixed), events: Mutex::new(world.events(filter)) }
    }

    fn event(&self, py: Python<'_>, event: &world::Event) -> Event {
        let bare = Event {
            kind: kind(&event.what),
            object: Object::new(&self.world, event.object),
            time: event.at.as_secs_f64(),
            other: None,
            point: None,
            normal: None,
            force: None,
        };
        match event.what {
            Happening::Contact(contact) => {
                let vector = |v: DVec3| Some(row(py, v.to_array()).unbind());
                let other = Some(name_of_touched(&self.world, &self.fixed, contact.with));
                let (point, normal) = (vector(contact.point_m), vector(contact.normal));
                Event { other, point, normal, force: vector(contact.force_n), ..bare }
            }
            Happening::Joined(leader) => Event { other: Some(name(&self.world, leader).to_owned()), ..bare },
            _ => bare,
        }
    }
}

#[pymethods]
impl Events {
    /// What happened since the last call, oldest first.
    fn drain(&self, py: Python<'_>) -> Vec<Event> {
        let all: Vec<_> = self.events.lock().unwrap_or_else(PoisonError::into_inner).drain().collect();
        all.iter().map(|event| self.event(py, event)).collect()
    }

    /// How many were overwritten before they were drained.
    #[getter]
    fn lost(&self) -> u64 {
        self.events.lock().unwrap_or_else(PoisonError::into_inner).lost()
    }
}

#[pymethods]
impl Event {
    fn __repr__(&self) -> String {
        let other = self.other.as_ref().map(|other| format!(", {other:?}")).unwrap_or_default();
        format!("<Event {} of {:?}{other} at {} s>", self.kind, self.object.name(), self.time)
    }
}

fn kind(what: &Happening) -> &'static str {
    match what {
        Happening::Contact(contact) if contact.begins => "contact_began",
        Happening::Contact(_) => "contact_ended",
        Happening::Rests => "rests",
        Happening::Wakes => "wakes",
        Happening::Failed => "failed",
        Happening::Gone => "gone",
        Happening::Joined(_) => "joined",
        Happening::Left => "left",
        Happening::AttachmentGave => "attachment_gave",
        Happening::RateMissed => "rate_missed",
        Happening::Carved(_) => "carved",
        Happening::Rewound => "rewound",
        _ => "unknown",
    }
}
