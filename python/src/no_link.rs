//! The module without its feature `hosts`: no world elsewhere can be reached, which says how to build one that reaches it.
//!
//! In: calls that ask for a connection. Out: an error. Never here: a network.

use crate::elsewhere::Wanted;
use metachron::world::WorldCalls;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::Arc;

pub fn connect(_wanted: Wanted) -> PyResult<Arc<dyn WorldCalls>> {
    Err(PyRuntimeError::new_err(
        "this module was built without its feature `hosts`, which reaches worlds elsewhere: build it again with `pip install ./python --config-settings=build-args=--features=hosts`",
    ))
}
