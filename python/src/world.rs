//! A world that runs: driven, commanded and read from any thread of Python.
//!
//! In: commands by objects' names or handles. Out: states, events, answers. While time passes Python's own lock is free.
//! Never here: the meaning of a command.

use crate::calls::{Given, WorldCalls, apart};
use crate::camera::{SIZE, Shot, Viewpoint};
use crate::checkpoint::Checkpoint;
use crate::command::Keywords;
use crate::export::{Export, Paths};
use crate::home::Home;
use crate::joints::{Joints, NamedJoint};
use crate::numbers::{Vector, span};
use crate::object::Named;
use crate::queries::{Contact, Hit};
use crate::raised;
use crate::scene::Scene;
use crate::start::{self, WantedPace};
use crate::view::Pictures;
use metachron::contact::joint::{Motor, MotorGoal};
use metachron::export::{Moments, Surface, write_glb};
use metachron::runtime::{AgentState, TimelineCommand};
use metachron::world::kinds::ExecutorKind;
use metachron::world::{self, Pace, SceneText};
use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// A world that runs; any thread may read and command it. In a `with` block it stops at the end.
#[pyclass(frozen, extends = WorldCalls, module = "metachron")]
pub struct World {
    inner: world::World,
    /// The scene that it was started with.
    scene: world::Scene,
    pictures: Pictures,
    /// The text of its scene; `None` of one that was built of parts.
    text: Option<SceneText>,
    home: Home,
}

impl Drop for World {
    fn drop(&mut self) {
        if !self.is_at_home() {
            // the last of its clones would wait for its threads
            std::mem::forget(self.inner.clone());
        }
    }
}

/// So long is let pass before Python is asked whether the user has interrupted it.
const PATIENCE: Duration = Duration::from_millis(20);

impl World {
    /// A world that was started of this scene.
    pub fn of(
        py: Python<'_>,
        inner: world::World,
        scene: &world::Scene,
        text: Option<SceneText>,
    ) -> PyResult<Py<Self>> {
        let (scene, pictures, calls) = (scene.clone(), Pictures::of(scene), WorldCalls::here(inner.clone()));
        let world = Self { inner, scene, pictures, text, home: Home::here() };
        Py::new(py, PyClassInitializer::from(calls).add_subclass(world))
    }

    /// Whether the threads that step it are in this process.
    fn is_at_home(&self) -> bool {
        self.inner.executor() == ExecutorKind::Lockstep || self.home.is_here()
    }

    /// An error where they are in another.
    fn at_home(&self) -> PyResult<&world::World> {
        if self.is_at_home() { Ok(&self.inner) } else { self.home.check("a world").map(|()| &self.inner) }
    }
}

#[pymethods]
impl World {
    /// `Scene.from_toml(text_or_path).start(executor, pace)`.
    #[staticmethod]
    #[pyo3(signature = (text_or_path, executor = "lockstep", pace = None))]
    fn from_toml(
        py: Python<'_>,
        text_or_path: &Bound<'_, PyAny>,
        executor: &str,
        pace: Option<&str>,
    ) -> PyResult<Py<Self>> {
        Scene::from_toml(text_or_path, false, None)?.start(py, executor, pace)
    }

    /// The joints of its scene, and their coordinates.
    #[getter]
    fn joints(&self) -> Joints {
        Joints::new(&self.inner)
    }

    /// The names of the sensors of its scene.
    #[getter]
    fn sensors(&self) -> Vec<&str> {
        self.inner.sensors().iter().map(|sensor| &*sensor.name).collect()
    }

    /// Why an object failed: it stands still from then on, and its newest state is its last. `None` of one that lives.
    fn fault(&self, object: Named<'_>) -> PyResult<Option<String>> {
        let object = object.of(&self.inner)?;
        self.inner.latest(object).map_err(raised::world)?;
        Ok(self.inner.agents().of(object.id()).and_then(|agent| match agent.state() {
            AgentState::Parked(reason) => Some(reason),
            _ => None,
        }))
    }

    /// The executor that runs it.
    #[getter]
    fn executor(&self) -> &'static str {
        self.inner.executor().name()
    }

    /// How time passes: `"free"` where it waits for objects, else `"real-time"`, whatever its speed.
    #[getter]
    fn pace(&self, py: Python<'_>) -> &'static str {
        start::pace(py.detach(|| self.inner.is_free()))
    }

    /// How time passes from now on: `"free"`, `"real-time"`, or so many simulated seconds a second, 0.001 ... 100.
    fn set_pace(&self, py: Python<'_>, pace: WantedPace) -> PyResult<()> {
        py.detach(|| self.inner.set_pace(pace.0)).map_err(raised::world)
    }

    /// The most simulated time that one of its objects has not lived, s: its dropped time and its lag now. 0 at the pace `"free"`.
    #[getter]
    fn dropped(&self, py: Python<'_>) -> f64 {
        py.detach(|| self.inner.given_up().as_secs_f64())
    }

    /// All that the next bit of it needs, objects that joined it included.
    fn checkpoint(&self, py: Python<'_>) -> PyResult<Checkpoint> {
        let world = self.at_home()?;
        let inner = py.detach(|| world.checkpoint()).map_err(raised::checkpoint)?;
        Ok(Checkpoint { inner })
    }

    /// Goes back to a checkpoint of this world, or of another of the same scene: from there it repeats its steps, in
    /// lockstep to the bit. Objects that joined since are taken out, objects that left since are there again.
    fn restore(&self, py: Python<'_>, checkpoint: &Checkpoint) -> PyResult<()> {
        let world = self.at_home()?;
        py.detach(|| world.restore(&checkpoint.inner)).map_err(raised::checkpoint)
    }

    /// Lets so much simulated time pass: at once in lockstep, on other executors in real time or, at the pace `"free"`, as fast as objects can
    /// step. Other threads of Python run meanwhile.
    fn advance(&self, py: Python<'_>, seconds: f64) -> PyResult<()> {
        let (world, span) = (self.at_home()?, span("the time to advance by", seconds)?);
        let (mut asked, mut interrupted) = (Instant::now(), Ok(()));
        let goes_on = || {
            if asked.elapsed() >= PATIENCE {
                asked = Instant::now();
                interrupted = Python::attach(|py| py.check_signals());
            }
            interrupted.is_ok()
        };
        py.detach(|| world.advance_while(span, goes_on));
        interrupted
    }

    /// Lets time pass from now on, so many simulated seconds a second, 0.001 ... 100; the pace is no longer `"free"`. Not in lockstep.
    #[pyo3(signature = (speed = 1.0))]
    fn run(&self, py: Python<'_>, speed: f64) -> PyResult<()> {
        if self.inner.executor() == ExecutorKind::Lockstep {
            return Err(PyValueError::new_err("a world in lockstep has no time of its own: it needs `advance`"));
        }
        let world = self.at_home()?;
        py.detach(|| {
            world.set_pace(Pace::Factor(speed))?;
            world.drive(TimelineCommand::Run);
            Ok(())
        })
        .map_err(raised::world)
    }

    /// Stops time.
    fn pause(&self, py: Python<'_>) {
        py.detach(|| self.inner.drive(TimelineCommand::Pause));
    }

    /// Ends the world. Its newest states can still be read.
    fn stop(&self, py: Python<'_>) {
        // a child has none of its threads to end
        if self.is_at_home() {
            py.detach(|| drop(self.inner.stop()));
        }
    }

    fn __enter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    #[pyo3(signature = (*_error))]
    fn __exit__(&self, py: Python<'_>, _error: &Bound<'_, pyo3::types::PyTuple>) {
        self.stop(py);
    }

    /// The reading of a sensor of the scene, of the newest states. Raises `KeyError`.
    fn sensor<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let reading = self.inner.sensor(name).map_err(raised::world)?;
        Ok(crate::numbers::array(py, reading.values.into()))
    }

    /// Drives a joint, by name or by its number in the scene; without a goal, no longer.
    #[pyo3(
        signature = (joint, **keywords),
        text_signature = "($self, joint, *, velocity=None, position=None, stiffness=None, damping=None, max_effort=None, expires=None)"
    )]
    fn motor(&self, joint: NamedJoint, keywords: Option<&Given<'_>>) -> PyResult<()> {
        let known = ["velocity", "position", "stiffness", "damping", "max_effort", "expires"];
        let keywords = Keywords::new("motor", keywords, &known)?;
        let joint = joint.of(&self.inner)?;
        let idle = Motor { goal: MotorGoal::Velocity(0.0), max_effort: f64::INFINITY };
        let motor = keywords.motor()?;
        let command = keywords.timed(joint.motor(motor.unwrap_or(idle)), motor.is_some())?;
        apart(|| self.inner.command(joint.body(), command)).map_err(raised::world)
    }

    /// A picture of the world now, (height, width, 4) of `uint8`: red, green, blue, opacity. `size` is (width, height), default (1280, 720).
    ///
    /// The camera is one of the scene's, by its name, or a `Camera`; default the scene's first, or one that sees everything. Raises `KeyError`
    /// for a name that there is not, and `RuntimeError` where no graphics adapter is found: a software driver is enough.
    #[pyo3(signature = (size = SIZE, camera = None))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        size: (i64, i64),
        camera: Option<Viewpoint>,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        self.pictures.colours(py, &self.inner, &Shot::new(size, camera)?)
    }

    /// The depths that a camera sees now, (height, width) of `float32`: m along the view from the eye, infinite where there is nothing. `size`,
    /// `camera` and errors are as of `render`.
    #[pyo3(signature = (size = SIZE, camera = None))]
    fn render_depth<'py>(
        &self,
        py: Python<'py>,
        size: (i64, i64),
        camera: Option<Viewpoint>,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.pictures.depths(py, &self.inner, &Shot::new(size, camera)?)
    }

    /// Begins files for other programs: moments as MCAP for Foxglove, Lichtblick and Rerun, in a folder as VTK series for ParaView, or as one
    /// animated binary glTF (.glb) for Blender and three.js; for ui.perfetto.dev when each object stepped.
    #[pyo3(signature = (*, mcap = None, vtk = None, glb = None, perfetto = None))]
    fn export(
        &self,
        mcap: Option<PathBuf>,
        vtk: Option<PathBuf>,
        glb: Option<PathBuf>,
        perfetto: Option<PathBuf>,
    ) -> PyResult<Export> {
        Export::create(&self.inner, &self.scene, Paths { mcap, vtk, glb, perfetto })
    }

    /// Writes the surfaces of all objects, as they are now, as binary glTF (.glb). Raises `OSError`.
    fn write_glb(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let write = || write_glb(&path, &Moments::of(&self.inner).take(), &Surface::fixed(&self.scene));
        py.detach(write).map_err(raised::export)
    }

    /// Writes down all calls that change it from now on, so that `replay` repeats them to the bit. Raises `OSError`; `RuntimeError` on
    /// a world that has stopped, is recorded already or repeats a recording.
    fn record(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let world = self.at_home()?;
        py.detach(|| match &self.text {
            Some(text) => world.record_scene(&path, text.clone()),
            None => world.record(&path),
        })
        .map_err(raised::record)
    }

    /// Ends the recording, as `stop` does; whether there was one. Raises `OSError` if not all of it could be written.
    fn end_recording(&self, py: Python<'_>) -> PyResult<bool> {
        py.detach(|| self.inner.end_recording()).map_err(raised::record)
    }

    /// The share of its recording that it has played, 0 ... 1; `None` of a world that is no replay. Raises `RuntimeError` where the replay
    /// came to something that the recorded world did not.
    #[getter]
    fn replayed(&self, py: Python<'_>) -> PyResult<Option<f64>> {
        py.detach(|| self.inner.replayed()).transpose().map_err(PyRuntimeError::new_err)
    }

    /// The contacts of an object now.
    fn contacts(&self, py: Python<'_>, object: Named<'_>) -> PyResult<Vec<Contact>> {
        let all = self.inner.contacts(object.of(&self.inner)?).map_err(raised::world)?;
        Ok(all.iter().map(|contact| Contact::new(py, &self.inner, contact)).collect())
    }

    /// The first surface that a ray meets within `reach` metres.
    fn cast_ray(&self, py: Python<'_>, origin: Vector, direction: Vector, reach: f64) -> PyResult<Option<Hit>> {
        let hit = py.detach(|| self.inner.cast_ray(origin.0, direction.0, reach)).map_err(raised::world)?;
        Ok(hit.map(|hit| Hit::new(py, &self.inner, &hit)))
    }

    /// The nearest point of any surface within `reach` metres.
    fn nearest(&self, py: Python<'_>, point: Vector, reach: f64) -> PyResult<Option<Hit>> {
        let hit = py.detach(|| self.inner.nearest(point.0, reach)).map_err(raised::world)?;
        Ok(hit.map(|hit| Hit::new(py, &self.inner, &hit)))
    }

    fn __repr__(&self) -> String {
        format!("<World on {} at {} s>", self.executor(), self.inner.time().as_secs_f64())
    }
}
