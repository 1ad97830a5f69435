//! Moments of a world as files that other programs open.
//!
//! In: a world, paths. Out: an MCAP file, a VTK series. Never here: what is in them.

use crate::raised;
use metachron::export::{McapFile, MomentWriter, Moments, Surface, VtkSeries};
use metachron::world::World;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

/// Writes moments of a world; in a `with` block the files are complete at the end.
#[pyclass(frozen, module = "metachron")]
pub struct Export {
    world: World,
    files: Mutex<Option<Files>>,
}

struct Files {
    moments: Moments,
    writers: Vec<Box<dyn MomentWriter + Send>>,
}

impl Export {
    /// Begins the files; `fixed` is the surface of what never moves.
    pub fn create(world: &World, fixed: &Surface, mcap: Option<PathBuf>, vtk: Option<PathBuf>) -> PyResult<Self> {
        let mut writers: Vec<Box<dyn MomentWriter + Send>> = Vec::new();
        if let Some(path) = mcap {
            writers.push(Box::new(McapFile::create(&path, fixed).map_err(raised::export)?));
        }
        if let Some(path) = vtk {
            writers.push(Box::new(VtkSeries::create(&path, fixed).map_err(raised::export)?));
        }
        if writers.is_empty() {
            return Err(PyValueError::new_err(
                "nothing would be written: name a file for mcap, a folder for vtk, or both",
            ));
        }
        Ok(Self { world: world.clone(), files: Mutex::new(Some(Files { moments: Moments::default(), writers })) })
    }
}

#[pymethods]
impl Export {
    /// Writes the world as it is now. `OSError` where a file cannot be written, `RuntimeError` after `close`.
    fn write(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| {
            let mut files = self.files.lock().unwrap_or_else(PoisonError::into_inner);
            let Some(Files { moments, writers }) = &mut *files else {
                return Err(PyRuntimeError::new_err("the files are complete; nothing more can be written"));
            };
            let moment = moments.take(&self.world);
            writers.iter_mut().try_for_each(|writer| writer.write(&moment)).map_err(raised::export)
        })
    }

    /// Completes the files.
    fn close(&self) -> PyResult<()> {
        let files = self.files.lock().unwrap_or_else(PoisonError::into_inner).take();
        let mut writers = files.map(|files| files.writers).unwrap_or_default();
        writers.iter_mut().try_for_each(|writer| writer.finish()).map_err(raised::export)
    }

    fn __enter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    #[pyo3(signature = (*_raised))]
    fn __exit__(&self, _raised: &Bound<'_, pyo3::types::PyTuple>) -> PyResult<()> {
        self.close()
    }
}
