//! A world's state at one moment, kept in memory or in a file.
//!
//! In: a world in lockstep. Out: the state from which it, or a world of the same scene in another process, goes on.
//! Never here: its contents.

use crate::raised;
use metachron::world;
use pyo3::prelude::*;
use std::path::PathBuf;

/// All that the next bit of a world needs (`World.checkpoint`).
#[pyclass(frozen, module = "metachron")]
pub struct Checkpoint {
    pub inner: world::Checkpoint,
}

#[pymethods]
impl Checkpoint {
    /// The one that a file holds. Raises `OSError`, and `ValueError` for a file that is no checkpoint of this version, or is damaged.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        let inner = world::Checkpoint::read(path).map_err(raised::checkpoint)?;
        Ok(Self { inner })
    }

    /// Writes it to a file, in place of one that is there. Raises `OSError`.
    fn write(&self, path: PathBuf) -> PyResult<()> {
        self.inner.write(path).map_err(raised::checkpoint)
    }

    fn __repr__(&self) -> String {
        format!("<Checkpoint at {} s>", self.time())
    }

    /// Simulated time of the state, s.
    #[getter]
    fn time(&self) -> f64 {
        self.inner.time().as_secs_f64()
    }
}
