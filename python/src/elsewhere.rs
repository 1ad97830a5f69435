//! A world that runs elsewhere: another process serves it, and its calls are answered there.
//!
//! In: an endpoint. Out: a world that is read and called as one that runs here. Never here: a connection ([`crate::link`]).

use crate::calls::WorldCalls;
use crate::link;
use crate::scene::Scene;
use metachron::world::{self, SceneMark};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

/// The world to connect with.
#[cfg_attr(not(feature = "hosts"), expect(dead_code, reason = "what is wanted is read by what connects"))]
pub struct Wanted {
    pub endpoint: String,
    pub scene: Option<SceneMark>,
    /// A file.
    pub identity: Option<PathBuf>,
    pub insecure_lan: bool,
}

/// A world that another process serves (`connect`): reading shows the newest states that came, what changes it waits for its host's answer.
///
/// Where its host is silent, states stay as they were last seen, and calls raise `ConnectionError`; where it lives again, they go on.
#[pyclass(frozen, extends = WorldCalls, module = "metachron")]
pub struct RemoteWorld {
    calls: Arc<dyn world::WorldCalls>,
}

#[pymethods]
impl RemoteWorld {
    /// Whether its host is silent: it has ended, or sent nothing for a second.
    #[getter]
    fn is_silent(&self) -> bool {
        self.calls.answers().is_err()
    }

    fn __repr__(&self) -> String {
        format!("<RemoteWorld of {:?} at {} s>", self.calls.scene().name, self.calls.time().as_secs_f64())
    }
}

/// The world that is served at `endpoint`, such as `"tcp/127.0.0.1:7447"`: by `metachron host`, or by a program. Of the scene `scene`, if that
/// is given. Beyond this machine, at `"tls/..."`, as the `identity` in a file of `metachron identity new`; or at `"tcp/..."` with `insecure_lan`,
/// where anybody on the network may listen and speak.
///
/// Raises `ValueError` for an endpoint or a file that cannot be, another version of the program and another scene, and `ConnectionError` where
/// no world is served.
#[pyfunction]
#[pyo3(signature = (endpoint, *, scene = None, identity = None, insecure_lan = false))]
pub fn connect(
    py: Python<'_>,
    endpoint: String,
    scene: Option<PyRef<'_, Scene>>,
    identity: Option<PathBuf>,
    insecure_lan: bool,
) -> PyResult<Py<RemoteWorld>> {
    let scene = scene.map(|scene| scene.resolved()).transpose()?.map(|scene| scene.mark());
    let wanted = Wanted { endpoint, scene, identity, insecure_lan };
    let calls = py.detach(|| link::connect(wanted))?;
    let world = PyClassInitializer::from(WorldCalls::elsewhere(Arc::clone(&calls)));
    Py::new(py, world.add_subclass(RemoteWorld { calls }))
}
