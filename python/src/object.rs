//! Objects of a world, by name or by handle.
//!
//! In: a name, or an [`Object`] that a world gave. Out: the engine's object. Never here: its state.

use metachron::world::{self, Touched, WorldCalls};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use std::sync::Arc;

/// An object of one world: quicker to find than its name, and never another one of the same name.
#[pyclass(frozen, eq, hash, module = "metachron")]
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Object {
    pub(crate) inner: world::Object,
    name: Arc<str>,
}

/// An argument that names an object.
pub enum Named<'py> {
    /// By a handle.
    Handle(PyRef<'py, Object>),
    /// By name.
    Name(String),
}

/// An argument that lists names.
pub struct Names(pub Vec<String>);

impl<'py> FromPyObject<'_, 'py> for Names {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        given.extract().map(Self).map_err(|_| PyTypeError::new_err("expected a list of names"))
    }
}

impl<'py> FromPyObject<'_, 'py> for Named<'py> {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let handle = given.extract().map(Self::Handle);
        let wanted = |_| PyTypeError::new_err("expected the name of an object, or an Object of this world");
        handle.or_else(|_| given.extract().map(Self::Name)).map_err(wanted)
    }
}

impl Named<'_> {
    /// The object in this world.
    pub fn of(&self, world: &dyn WorldCalls) -> PyResult<world::Object> {
        match self {
            Self::Handle(object) => Ok(object.inner),
            Self::Name(name) => world.object(name).map_err(crate::raised::world),
        }
    }
}

impl Object {
    /// The handle of an object of this world.
    pub fn new(world: &dyn WorldCalls, inner: world::Object) -> Self {
        Self { inner, name: name(world, inner.into()) }
    }
}

#[pymethods]
impl Object {
    #[getter]
    pub fn name(&self) -> &str {
        &self.name
    }

    fn __repr__(&self) -> String {
        format!("<Object {:?}>", &*self.name)
    }
}

/// The name of an object, also of one that was removed, or of a static solid.
pub fn name(world: &dyn WorldCalls, what: Touched) -> Arc<str> {
    world.name(what).unwrap_or_default()
}
