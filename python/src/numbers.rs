//! Numbers between Python and the engine: vectors, rotations, spans, arrays that nobody can write to.
//!
//! In: any sequence of numbers, numpy arrays among them. Out: numpy arrays of `float64`. Never here: their meaning.

use glam::{DQuat, DVec3};
use metachron::core::{SimSpan, unit_rotation};
use numpy::ndarray::{Array, Dimension};
use numpy::{Element, PyArray, PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// Three numbers: x, y, z.
#[derive(Debug, Clone, Copy)]
pub struct Vector(pub DVec3);

/// A rotation: a quaternion x, y, z, w of any length, as scipy takes them.
#[derive(Debug, Clone, Copy)]
pub struct Rotation(pub DQuat);

impl<'py> FromPyObject<'_, 'py> for Vector {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let three: PyResult<[f64; 3]> = given.extract();
        three.map(|three| Self(three.into())).map_err(|_| PyTypeError::new_err("expected three numbers: [x, y, z]"))
    }
}

impl<'py> FromPyObject<'_, 'py> for Rotation {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        let four: PyResult<[f64; 4]> = given.extract();
        let four = four.map_err(|_| PyTypeError::new_err("expected a quaternion: [x, y, z, w]"))?;
        let none = || {
            PyValueError::new_err(format!(
                "the quaternion {four:?} is no rotation; expected one that is finite and not zero"
            ))
        };
        unit_rotation(DQuat::from_array(four)).map(Self).ok_or_else(none)
    }
}

/// A span of simulated time.
pub fn span(what: &str, seconds: f64) -> PyResult<SimSpan> {
    let wanted = || PyValueError::new_err(format!("{what} is {seconds:?} s; expected 0 s to 584 years"));
    SimSpan::from_secs_f64(seconds).ok_or_else(wanted)
}

/// An array that nobody can write to.
pub fn array<T: Element, D: Dimension>(py: Python<'_>, values: Array<T, D>) -> Bound<'_, PyArray<T, D>> {
    Bound::clone(&PyArray::from_owned_array(py, values).readwrite().make_nonwriteable())
}

/// An array of a row for each.
pub fn rows<const N: usize>(py: Python<'_>, rows: impl Iterator<Item = [f64; N]>) -> Bound<'_, PyArray2<f64>> {
    array(py, rows.collect::<Vec<_>>().into())
}

/// A row.
pub fn row<const N: usize>(py: Python<'_>, numbers: [f64; N]) -> Bound<'_, PyArray1<f64>> {
    array(py, numbers.to_vec().into())
}
