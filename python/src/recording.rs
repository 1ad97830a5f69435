//! A world's recording, played again.
//!
//! In: a file that `World.record` or `metachron run --record` has written. Out: a world that repeats it, to the bit.
//! Never here: the format of the file.

use crate::numbers::span;
use crate::raised;
use crate::scene::Scene;
use crate::world::World;
use metachron::core::SimTime;
use metachron::world::{self, Recording};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::PathBuf;

/// A world on one thread that does again what a recording says, as far as time is let pass, and no further than `until`, s; it takes no commands.
///
/// `scene` is the recorded scene, unless that was read from TOML: then the recording has it. Raises `OSError`, and `ValueError` for a file
/// that is no recording of this version, or is of another scene.
#[pyfunction]
#[pyo3(signature = (path, scene = None, *, until = None))]
pub fn replay(
    py: Python<'_>,
    path: PathBuf,
    scene: Option<PyRef<'_, Scene>>,
    until: Option<f64>,
) -> PyResult<Py<World>> {
    let recording = Recording::read(&path).map_err(raised::record)?;
    let until = until.map(|seconds| span("until", seconds)).transpose()?.map(|span| SimTime::ZERO + span);
    let scene = match (scene, recording.scene()) {
        (Some(scene), _) => scene.resolved()?,
        (None, Some(text)) => Scene::of_text(text.clone())?.resolved()?,
        (None, None) => {
            let why = "it has no scene, because that was built of parts; give the same one to replay";
            return Err(PyValueError::new_err(format!("{}: {why}", path.display())));
        }
    };
    let inner = py.detach(|| world::World::replay(&scene, recording, until)).map_err(raised::checkpoint)?;
    World::of(py, inner, &scene, None)
}
