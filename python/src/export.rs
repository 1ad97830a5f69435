//! Moments of a world, and when its objects stepped, as files that other programs open.
//!
//! In: a world, paths. Out: an MCAP file, VTK series, animated binary glTF, a Perfetto trace. Never here: their contents.

use crate::raised;
use metachron::export::{GlbAnimation, McapFile, MomentWriter, Moments, PerfettoFile, Surface, VtkSeries};
use metachron::world::{Scene, World};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

/// Writes moments of a world; in a `with` block the files are complete at the end.
#[pyclass(frozen, module = "metachron")]
pub struct Export(Mutex<Option<Files>>);

struct Files {
    moments: Moments,
    writers: Vec<Box<dyn MomentWriter + Send>>,
    trace: Option<PerfettoFile>,
}

/// Where they are written.
pub struct Paths {
    pub mcap: Option<PathBuf>,
    pub vtk: Option<PathBuf>,
    pub glb: Option<PathBuf>,
    pub perfetto: Option<PathBuf>,
}

impl Export {
    /// Begins the files of a world of this scene.
    pub fn create(world: &World, scene: &Scene, paths: Paths) -> PyResult<Self> {
        let fixed = &Surface::fixed(scene);
        let Paths { mcap, vtk, glb, perfetto } = paths;
        let given: Vec<_> = [&mcap, &vtk, &glb, &perfetto].into_iter().flatten().collect();
        if let Some((_, path)) = given.iter().enumerate().find(|(at, path)| given[..*at].contains(path)) {
            return Err(PyValueError::new_err(format!("{} would be written twice: name another path", path.display())));
        }
        let mut writers: Vec<Box<dyn MomentWriter + Send>> = Vec::new();
        if let Some(path) = mcap {
            writers.push(Box::new(McapFile::create(&path, fixed).map_err(raised::export)?));
        }
        if let Some(path) = vtk {
            writers.push(Box::new(VtkSeries::create(&path, scene).map_err(raised::export)?));
        }
        if let Some(path) = glb {
            writers.push(Box::new(GlbAnimation::create(&path, fixed).map_err(raised::export)?));
        }
        let trace = perfetto.map(|path| PerfettoFile::create(&path, world)).transpose().map_err(raised::export)?;
        if writers.is_empty() && trace.is_none() {
            return Err(PyValueError::new_err(
                "nothing would be written: name a file for mcap, glb or perfetto, or a folder for vtk",
            ));
        }
        let files = Files { moments: Moments::of(world), writers, trace };
        Ok(Self(Mutex::new(Some(files))))
    }
}

#[pymethods]
impl Export {
    /// Writes the world as it is now. `OSError` where a file cannot be written, `RuntimeError` after `close`.
    fn write(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| {
            let mut files = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let Some(Files { moments, writers, trace }) = &mut *files else {
                return Err(PyRuntimeError::new_err("the files are complete; nothing more can be written"));
            };
            if !writers.is_empty() {
                let moment = moments.take();
                writers.iter_mut().try_for_each(|writer| writer.write(&moment)).map_err(raised::export)?;
            }
            trace.as_mut().map_or(Ok(()), |trace| trace.write(None)).map_err(raised::export)
        })
    }

    /// Completes the files.
    fn close(&self) -> PyResult<()> {
        let files = self.0.lock().unwrap_or_else(PoisonError::into_inner).take();
        let Some(Files { mut writers, trace, .. }) = files else { return Ok(()) };
        let moments = writers.iter_mut().try_for_each(|writer| writer.finish());
        let trace = trace.map_or(Ok(()), |mut trace| trace.finish());
        moments.and(trace).map_err(raised::export)
    }

    fn __enter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    #[pyo3(signature = (*_raised))]
    fn __exit__(&self, _raised: &Bound<'_, pyo3::types::PyTuple>) -> PyResult<()> {
        self.close()
    }
}
