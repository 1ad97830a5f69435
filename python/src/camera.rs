//! From where a picture is taken, and how large it is.
//!
//! In: a tuple of pixels; the name of a camera, or a `Camera` of `package/metachron/parts.py`. Out: checked numbers. Never here: drawing.

use crate::numbers::Vector;
use crate::scene::{class, field};
use glam::DVec3;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// Pixels across and down of a picture where no others are asked for.
pub const SIZE: (i64, i64) = (1280, 720);

/// A picture that is asked for.
#[derive(Debug)]
pub struct Shot {
    pub width: u32,
    pub height: u32,
    pub from: Viewpoint,
}

/// Where it is taken from.
#[derive(Debug)]
pub enum Viewpoint {
    /// The scene's camera of this name; `None` for its first.
    Named(Option<String>),
    /// From the eye, m, towards a point, m, with a vertical angle of view, rad.
    Free { eye: DVec3, look_at: DVec3, fov: f64 },
}

impl<'py> FromPyObject<'_, 'py> for Viewpoint {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(name) = given.extract() {
            return Ok(Self::Named(Some(name)));
        }
        let other = class(&given)?;
        if other != "Camera" {
            let message = format!("a camera is the name of one of the scene's, or a Camera; got a {other}");
            return Err(PyTypeError::new_err(message));
        }
        let (Vector(eye), Vector(look_at)) = (field(&given, "eye")?, field(&given, "look_at")?);
        let fov: f64 = field(&given, "fov")?;
        let distance = eye.distance(look_at);
        if !(distance.is_finite() && distance > 0.0) {
            let message =
                format!("the camera is at {eye} and looks at {look_at}; expected two different finite points");
            return Err(PyValueError::new_err(message));
        }
        if !(0.01..=3.0).contains(&fov) {
            return Err(PyValueError::new_err(format!("the camera's fov is {fov:?} rad; expected 0.01 to 3")));
        }
        Ok(Self::Free { eye, look_at, fov })
    }
}

impl Shot {
    /// A picture of `(width, height)` pixels.
    pub fn new((width, height): (i64, i64), from: Option<Viewpoint>) -> PyResult<Self> {
        let side = |pixels: i64| u32::try_from(pixels).ok().filter(|pixels| *pixels > 0);
        let (Some(width), Some(height)) = (side(width), side(height)) else {
            let message = format!("the size is ({width}, {height}); expected a width and a height of 1 pixel or more");
            return Err(PyValueError::new_err(message));
        };
        Ok(Self { width, height, from: from.unwrap_or(Viewpoint::Named(None)) })
    }
}
