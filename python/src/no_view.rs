//! The module without its feature `view`: no picture can be drawn, which says how to build one that draws.
//!
//! In: calls that ask for a picture. Out: an error. Never here: drawing.

use crate::camera::Shot;
use metachron::world::{Scene, World};
use numpy::{PyArray2, PyArray3};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Stands for the pictures of one world.
pub struct Pictures;

impl Pictures {
    pub fn of(_scene: &Scene) -> Self {
        Self
    }

    pub fn colours<'py>(&self, _py: Python<'py>, _world: &World, _shot: &Shot) -> PyResult<Bound<'py, PyArray3<u8>>> {
        Err(refused())
    }

    pub fn depths<'py>(&self, _py: Python<'py>, _world: &World, _shot: &Shot) -> PyResult<Bound<'py, PyArray2<f32>>> {
        Err(refused())
    }
}

fn refused() -> PyErr {
    PyRuntimeError::new_err(
        "this module was built without its feature `view`, which draws: build it again with `pip install ./python --config-settings=build-args=--features=view`",
    )
}
