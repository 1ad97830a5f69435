//! Many worlds of one scene at once, each in lockstep, each under forces of its own.
//!
//! In: a scene, an object, a force for each world and step. Out: positions and velocities after each step.
//! A world is the same whichever thread plays it. Never here: a reward, a policy.

use crate::command::Keywords;
use crate::numbers::{array, span};
use crate::object::Names;
use crate::raised;
use crate::scene::Scene;
use crate::state::Points;
use glam::DVec3;
use metachron::core::{Anchor, Body, SimSpan};
use metachron::world::kinds::ExecutorKind;
use metachron::world::{self, Command, Pace, World, WorldError};
use numpy::ndarray::{Array3, Array4, Axis, Ix3};
use numpy::{AllowTypeChange, PyArray1, PyArrayLikeDyn};
use pyo3::exceptions::{PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, SyncSender};
use std::time::Duration;

/// So long is waited before Python is asked whether the user has interrupted it.
const PATIENCE: Duration = Duration::from_millis(20);

/// The results of many worlds.
#[pyclass(frozen, get_all, module = "metachron")]
pub struct Rollout {
    /// By observed object (worlds, steps, n, 3), m, after each step.
    positions: Py<PyDict>,
    /// The same, m/s.
    velocities: Py<PyDict>,
    /// (worlds,): as `World.hash`, at the end.
    hashes: Py<PyArray1<u64>>,
}

#[pymethods]
impl Rollout {
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<Rollout of {} worlds>", self.hashes.bind(py).len()?))
    }
}

/// The scene and the actions of all worlds.
struct Plan {
    scene: world::Scene,
    /// The object that forces act on, and where.
    on: String,
    anchor: Anchor,
    observe: Vec<String>,
    step: SimSpan,
    /// Newtons, by world, step and axis.
    actions: Array3<f64>,
}

/// The result of one world.
struct Played {
    /// By observed object.
    motions: Vec<Motion>,
    hash: u64,
}

/// One world that has ended.
struct Outcome {
    number: usize,
    result: Result<Played, WorldError>,
}

/// Positions and velocities of an object, step after step.
#[derive(Clone, Default)]
struct Motion {
    positions: Vec<f64>,
    velocities: Vec<f64>,
}

/// Plays a world in lockstep at the free pace for each row of `actions`: forces on one object, N, (worlds, steps, 3).
///
/// `step` is required. A world is the same, bit for bit, on any number of threads.
#[pyfunction]
#[pyo3(
    signature = (scene, on, actions, **keywords),
    text_signature = "(scene, on, actions, *, step, observe=None, threads=2, arc=None, local=None, vertex=None)"
)]
pub fn rollout(
    py: Python<'_>,
    scene: PyRef<'_, Scene>,
    on: String,
    actions: PyArrayLikeDyn<'_, f64, AllowTypeChange>,
    keywords: Option<&Bound<'_, PyDict>>,
) -> PyResult<Rollout> {
    let keywords = Keywords::new("rollout", keywords, &["step", "observe", "threads", "arc", "local", "vertex"])?;
    let actions = actions.as_array();
    let shape = actions.shape();
    let actions = actions.to_owned().into_dimensionality::<Ix3>().ok().filter(|actions| actions.shape()[2] == 3);
    let actions = actions.ok_or_else(|| {
        let message = format!("actions have the shape {shape:?}; expected (worlds, steps, 3)");
        PyValueError::new_err(message)
    })?;
    let step: Option<f64> = keywords.get("step")?;
    let step = step.ok_or_else(|| PyTypeError::new_err("rollout() needs the keyword argument 'step', seconds"))?;
    if step <= 0.0 {
        return Err(PyValueError::new_err(format!("step is {step:?} s; expected above zero")));
    }
    let threads: usize = keywords.get("threads")?.unwrap_or(2);
    if threads == 0 {
        return Err(PyValueError::new_err("threads is 0; expected at least 1"));
    }
    let observe = keywords.get("observe")?.map_or_else(|| vec![on.clone()], |Names(names)| names);
    let (anchor, step) = (keywords.anchor()?, span("step", step)?);
    let plan = Plan { scene: scene.resolved()?, on, anchor, observe, step, actions };
    let played = py.detach(|| plan.play(threads))?;
    plan.arrays(py, &played)
}

impl Plan {
    /// Plays all worlds; each thread takes the next that no other has begun.
    fn play(&self, threads: usize) -> PyResult<Vec<Played>> {
        let worlds = self.actions.shape()[0];
        let threads = threads.min(worlds);
        let (next, is_over) = (AtomicUsize::new(0), AtomicBool::new(false));
        let (done, results) = mpsc::sync_channel::<Outcome>(threads);
        let work = |done: SyncSender<Outcome>| {
            loop {
                let number = next.fetch_add(1, Relaxed);
                if number >= worlds {
                    break;
                }
                let result = self.play_one(number, &is_over);
                // nobody listens any more where a world has failed, or the user has interrupted
                if done.send(Outcome { number, result }).is_err() {
                    break;
                }
            }
        };
        std::thread::scope(|scope| {
            let work = &work;
            let started = (0..threads).map(|_| {
                let done = done.clone();
                std::thread::Builder::new().name("rollout".to_owned()).spawn_scoped(scope, move || work(done))
            });
            let started: Vec<_> = started.collect();
            // the last thread that ends closes the channel
            drop(done);
            let played = gather(results, worlds);
            is_over.store(true, Relaxed);
            for thread in started {
                let thread = thread.map_err(|error| PyRuntimeError::new_err(format!("no thread started: {error}")))?;
                thread.join().map_err(|_| PyRuntimeError::new_err("a world of the rollout panicked"))?;
            }
            played
        })
    }

    /// Plays one world to its end, or until all is over.
    fn play_one(&self, number: usize, is_over: &AtomicBool) -> Result<Played, WorldError> {
        let world = World::start(&self.scene, ExecutorKind::Lockstep)?;
        world.set_pace(Pace::Free)?;
        let on = world.object(&self.on)?;
        let observed: Result<Vec<_>, _> = self.observe.iter().map(|name| world.object(name)).collect();
        let observed = observed?;
        let mut motions = vec![Motion::default(); observed.len()];
        for force in self.actions.index_axis(Axis(0), number).rows() {
            if is_over.load(Relaxed) {
                break;
            }
            let force = DVec3::new(force[0], force[1], force[2]);
            world.command(on, Command::force(self.anchor, force))?;
            world.advance(self.step);
            for (motion, object) in motions.iter_mut().zip(&observed) {
                motion.record(&world.latest(*object)?.body);
            }
        }
        Ok(Played { motions, hash: world.hash() })
    }

    fn arrays(&self, py: Python<'_>, played: &[Played]) -> PyResult<Rollout> {
        let [positions, velocities] = [PyDict::new(py), PyDict::new(py)];
        for (at, name) in self.observe.iter().enumerate() {
            let motions = || played.iter().map(|one| &one.motions[at]);
            positions.set_item(name, array(py, self.stacked(motions().map(|motion| &motion.positions))?))?;
            velocities.set_item(name, array(py, self.stacked(motions().map(|motion| &motion.velocities))?))?;
        }
        let hashes: Vec<_> = played.iter().map(|one| one.hash).collect();
        let hashes = array(py, hashes.into()).unbind();
        Ok(Rollout { positions: positions.unbind(), velocities: velocities.unbind(), hashes })
    }

    /// The numbers of all worlds as one array.
    fn stacked<'a>(&self, all: impl Iterator<Item = &'a Vec<f64>>) -> PyResult<Array4<f64>> {
        let flat: Vec<f64> = all.flatten().copied().collect();
        let (worlds, steps, _) = self.actions.dim();
        let points = flat.len() / (worlds * steps * 3).max(1);
        // each world has the same objects, whose resolutions nobody changes
        Array4::from_shape_vec((worlds, steps, points, 3), flat)
            .map_err(|error| PyRuntimeError::new_err(error.to_string()))
    }
}

/// The worlds by their numbers, taken as they end, until none is left, one has failed, or the user interrupts.
fn gather(results: Receiver<Outcome>, worlds: usize) -> PyResult<Vec<Played>> {
    let mut played: Vec<_> = (0..worlds).map(|_| None).collect();
    loop {
        match results.recv_timeout(PATIENCE) {
            Ok(Outcome { number, result }) => {
                let one = result.map_err(|error| raised::in_world(number, &error))?;
                played[number] = Some(one);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(played.into_iter().flatten().collect()),
        }
        Python::attach(|py| py.check_signals())?;
    }
}

impl Motion {
    /// Adds the present points of a body.
    fn record(&mut self, body: &Body) {
        let motion = Points::of(body);
        self.positions.extend(motion.positions.iter().flat_map(|v| v.to_array()));
        self.velocities.extend(motion.velocities.iter().flat_map(|v| v.to_array()));
    }
}
