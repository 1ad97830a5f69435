//! The calls of a world that are the same wherever it runs: in this process, or at a host elsewhere.
//!
//! In: objects by their names or handles, commands, parts. Out: states, objects, answers. Never here: the meaning of a command, a connection.

use crate::all_states::States;
use crate::checkpoint::Checkpoint;
use crate::command::Keywords;
use crate::events::{Events, filter};
use crate::home::Home;
use crate::numbers::{Rotation, Vector, span};
use crate::object::{Named, Object};
use crate::raised;
use crate::scene::part;
use crate::state::State;
use glam::{DQuat, DVec3};
use metachron::core::{Body, SimSpan, SoftNodes};
use metachron::runtime::{SPEED_RANGE, TimelineCommand};
use metachron::world::{self, Command};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// The calls that a world answers wherever it runs: any thread may read and command it.
#[pyclass(frozen, subclass, module = "metachron")]
pub struct WorldCalls {
    pub calls: Arc<dyn world::WorldCalls>,
    /// The process whose threads answer calls; `None` where any does.
    home: Option<Home>,
}

/// Where on an object, under which key, for how long.
const ANCHORED: [&str; 5] = ["arc", "local", "vertex", "key", "expires"];

/// Time passes in calls of this length, between which Python is asked whether the user has interrupted it.
const PIECE: SimSpan = SimSpan::from_millis(20);

/// Keyword arguments.
pub type Given<'py> = Bound<'py, PyDict>;

/// Makes a call that may wait for the world, while other threads of Python run.
pub fn apart<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    Python::attach(|py| py.detach(work))
}

impl WorldCalls {
    /// Of a world in this process.
    pub fn here(world: world::World) -> Self {
        Self { calls: Arc::new(world), home: None }
    }

    /// Of one that is reached by a connection of this process.
    pub fn elsewhere(calls: Arc<dyn world::WorldCalls>) -> Self {
        Self { calls, home: Some(Home::here()) }
    }

    /// The calls; an error in a process where nothing would answer them.
    pub fn at_home(&self) -> PyResult<&dyn world::WorldCalls> {
        self.home.map_or(Ok(()), |home| home.check("a connection"))?;
        Ok(&*self.calls)
    }

    fn send(&self, object: &Named<'_>, command: Command) -> PyResult<()> {
        let (calls, object) = (self.at_home()?, object.of(&*self.calls)?);
        apart(|| calls.command(object, command)).map_err(raised::world)
    }
}

#[pymethods]
impl WorldCalls {
    /// The object of this name. Raises `KeyError`.
    fn object(&self, name: &str) -> PyResult<Object> {
        let object = self.calls.object(name).map_err(raised::world)?;
        Ok(Object::new(&*self.calls, object))
    }

    /// All objects that are there, the scene's first.
    #[getter]
    fn objects(&self) -> Vec<Object> {
        self.calls.all_objects().into_iter().map(|object| Object::new(&*self.calls, object)).collect()
    }

    /// The newest states of all objects, as arrays.
    fn states(&self, py: Python<'_>) -> States {
        States::of(py, &*self.calls)
    }

    /// The newest state of an object; it waits for nothing.
    fn state(&self, object: Named<'_>) -> PyResult<State> {
        self.calls.latest(object.of(&*self.calls)?).map(State).map_err(raised::world)
    }

    /// Simulated time, s.
    #[getter]
    fn time(&self, py: Python<'_>) -> f64 {
        py.detach(|| self.calls.time().as_secs_f64())
    }

    /// Equal numbers mean the same states of all objects, bit for bit.
    fn hash(&self) -> PyResult<u64> {
        let calls = self.at_home()?;
        apart(|| calls.hash()).map_err(raised::world)
    }

    /// A force in world axes; `None` takes back that of the key.
    #[pyo3(
        signature = (object, newtons, **keywords),
        text_signature = "($self, object, newtons, *, arc=None, local=None, vertex=None, key=0, expires=None)"
    )]
    fn force(&self, object: Named<'_>, newtons: Option<Vector>, keywords: Option<&Given<'_>>) -> PyResult<()> {
        let keywords = Keywords::new("force", keywords, &ANCHORED)?;
        let (anchor, force) = (keywords.anchor()?, newtons.map(|Vector(force)| force));
        let command = Command::force(anchor, force.unwrap_or_default());
        self.send(&object, keywords.timed(command, force.is_some())?)
    }

    /// A torque in world axes; `None` takes back that of the key.
    #[pyo3(
        signature = (object, newton_metres, **keywords),
        text_signature = "($self, object, newton_metres, *, arc=None, local=None, vertex=None, key=0, expires=None)"
    )]
    fn torque(&self, object: Named<'_>, newton_metres: Option<Vector>, keywords: Option<&Given<'_>>) -> PyResult<()> {
        let keywords = Keywords::new("torque", keywords, &ANCHORED)?;
        let (anchor, torque) = (keywords.anchor()?, newton_metres.map(|Vector(torque)| torque));
        let command = Command::torque(anchor, torque.unwrap_or_default());
        self.send(&object, keywords.timed(command, torque.is_some())?)
    }

    /// An impulse in world axes, once.
    #[pyo3(
        signature = (object, newton_seconds, **keywords),
        text_signature = "($self, object, newton_seconds, *, arc=None, local=None, vertex=None)"
    )]
    fn impulse(&self, object: Named<'_>, newton_seconds: Vector, keywords: Option<&Given<'_>>) -> PyResult<()> {
        let anchor = Keywords::new("impulse", keywords, &["arc", "local", "vertex"])?.anchor()?;
        self.send(&object, Command::impulse(anchor, newton_seconds.0))
    }

    /// A spring to a place in space, m; `None` takes back that of the key.
    #[pyo3(
        signature = (object, target, **keywords),
        text_signature = "($self, object, target, *, stiffness=None, damping=0.0, arc=None, local=None, vertex=None, key=0, expires=None)"
    )]
    fn spring(&self, object: Named<'_>, target: Option<Vector>, keywords: Option<&Given<'_>>) -> PyResult<()> {
        let known = [&["stiffness", "damping"][..], &ANCHORED].concat();
        let keywords = Keywords::new("spring", keywords, &known)?;
        let (anchor, target) = (keywords.anchor()?, target.map(|Vector(target)| target));
        let stiffness: Option<f64> = keywords.get("stiffness")?;
        let damping: f64 = keywords.get("damping")?.unwrap_or(0.0);
        let Some(stiffness) = stiffness.or(target.is_none().then_some(0.0)) else {
            return Err(PyValueError::new_err("a spring needs a stiffness, N/m"));
        };
        let command = Command::spring(anchor, target.unwrap_or_default(), stiffness, damping);
        self.send(&object, keywords.timed(command, target.is_some())?)
    }

    /// Leads a kinematic body to a pose within its next step, and along by a velocity, m/s, and a spin, rad/s; `None` lets it go.
    #[pyo3(
        signature = (object, position, rotation = Rotation(DQuat::IDENTITY), **keywords),
        text_signature = "($self, object, position, rotation=(0.0, 0.0, 0.0, 1.0), *, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0), expires=None)"
    )]
    fn pose(
        &self,
        object: Named<'_>,
        position: Option<Vector>,
        rotation: Rotation,
        keywords: Option<&Given<'_>>,
    ) -> PyResult<()> {
        let keywords = Keywords::new("pose", keywords, &["velocity", "spin", "expires"])?;
        let [velocity, spin] = ["velocity", "spin"].map(|name| keywords.get::<Vector>(name));
        let (velocity, spin) = (velocity?.map_or(DVec3::ZERO, |v| v.0), spin?.map_or(DVec3::ZERO, |v| v.0));
        let command = Command::pose(position.map_or(DVec3::ZERO, |v| v.0), rotation.0).moving(velocity, spin);
        self.send(&object, keywords.timed(command, position.is_some())?)
    }

    /// Puts an object into a state that it had, or another one of as many nodes.
    fn set_state(&self, object: Named<'_>, state: &State) -> PyResult<()> {
        let (calls, object, body) = (self.at_home()?, object.of(&*self.calls)?, &state.0.body);
        apart(|| calls.set_state(object, body)).map_err(raised::world)
    }

    /// Puts the nodes of a soft body to these places, m, (n, 3), with these velocities, m/s; at rest where there are none. How many nodes it has,
    /// `State.nodes` says.
    #[pyo3(signature = (object, positions, velocities = None))]
    fn set_nodes(&self, object: Named<'_>, positions: Vec<Vector>, velocities: Option<Vec<Vector>>) -> PyResult<()> {
        let object = object.of(&*self.calls)?;
        let plain = |vectors: Vec<Vector>| vectors.into_iter().map(|Vector(vector)| vector).collect::<Vec<_>>();
        let velocities = velocities.map_or_else(|| vec![DVec3::ZERO; positions.len()], plain);
        let positions = plain(positions);
        let mut body = self.calls.latest(object).map_err(raised::world)?.body.clone();
        match &mut body {
            Body::Soft(soft) if soft.nodes.is_some() => soft.nodes = Some(SoftNodes { positions, velocities }),
            Body::Soft(soft) => (soft.positions, soft.velocities) = (positions, velocities),
            _ => return Err(PyValueError::new_err("only soft bodies are put elsewhere node by node")),
        }
        let calls = self.at_home()?;
        apart(|| calls.set_state(object, &body)).map_err(raised::world)
    }

    /// To another place: a rigid body to this rotation, a deformable turned by it.
    #[pyo3(signature = (object, position, rotation = Rotation(DQuat::IDENTITY)))]
    fn teleport(&self, object: Named<'_>, position: Vector, rotation: Rotation) -> PyResult<()> {
        self.send(&object, Command::teleport(position.0, rotation.0))
    }

    /// Another velocity, m/s, and spin, rad/s, of all its matter.
    #[pyo3(signature = (object, velocity, spin = Vector(DVec3::ZERO)))]
    fn velocity(&self, object: Named<'_>, velocity: Vector, spin: Vector) -> PyResult<()> {
        self.send(&object, Command::velocity(velocity.0, spin.0))
    }

    /// Removes the cells of a solid or a sheet within a radius of a line, m; of a point where it has no other end.
    #[pyo3(signature = (object, start, radius, end = None))]
    fn carve(&self, object: Named<'_>, start: Vector, radius: f64, end: Option<Vector>) -> PyResult<()> {
        let to = end.map_or(start.0, |Vector(end)| end);
        self.send(&object, Command::carve(start.0, to, radius))
    }

    /// Takes up another object, which lives from its first step on.
    fn add(&self, name: &str, what: &Bound<'_, PyAny>) -> PyResult<Object> {
        let part = part(what)?;
        let calls = self.at_home()?;
        let object = what.py().detach(|| calls.add(name, part)).map_err(raised::world)?;
        Ok(Object::new(&*self.calls, object))
    }

    /// Takes an object out; its handle is an error from its next step on.
    fn remove(&self, object: Named<'_>) -> PyResult<()> {
        let (calls, object) = (self.at_home()?, object.of(&*self.calls)?);
        apart(|| calls.remove(object)).map_err(raised::world)
    }

    /// Listens from now on: to contacts of at least `above` newtons, to changes of state, of all objects or one.
    #[pyo3(signature = (*, contacts = true, states = true, above = 0.0, of = None))]
    fn events(&self, contacts: bool, states: bool, above: f64, of: Option<Named<'_>>) -> PyResult<Events> {
        let of = of.map(|object| object.of(&*self.calls)).transpose()?;
        let filter = filter(contacts, states, above, of)?;
        Ok(apart(|| Events::new(Arc::clone(&self.calls), filter)))
    }

    /// All that the next bit of it needs, objects that joined it included.
    fn checkpoint(&self, py: Python<'_>) -> PyResult<Checkpoint> {
        let calls = self.at_home()?;
        let inner = py.detach(|| calls.checkpoint()).map_err(raised::checkpoint)?;
        Ok(Checkpoint { inner })
    }

    /// Goes back to a checkpoint of this world, or of another of the same scene.
    fn restore(&self, py: Python<'_>, checkpoint: &Checkpoint) -> PyResult<()> {
        let calls = self.at_home()?;
        py.detach(|| calls.restore(&checkpoint.inner)).map_err(raised::checkpoint)
    }

    /// Lets so much simulated time pass. Other threads of Python run meanwhile.
    fn advance(&self, py: Python<'_>, seconds: f64) -> PyResult<()> {
        let (calls, mut left) = (self.at_home()?, span("the time to advance by", seconds)?);
        while left > SimSpan::ZERO {
            let piece = left.min(PIECE);
            py.detach(|| calls.advance(piece)).map_err(raised::world)?;
            left = SimSpan::from_nanos(left.as_nanos() - piece.as_nanos());
            py.check_signals()?;
        }
        Ok(())
    }

    /// Lets time pass from now on, so many simulated seconds a second, 0.001 ... 100.
    #[pyo3(signature = (speed = 1.0))]
    fn run(&self, py: Python<'_>, speed: f64) -> PyResult<()> {
        let (least, most) = SPEED_RANGE;
        if !(least..=most).contains(&speed) {
            return Err(PyValueError::new_err(format!("speed is {speed:?}; expected {least} to {most}")));
        }
        let calls = self.at_home()?;
        py.detach(|| {
            calls.drive(TimelineCommand::Speed(speed))?;
            calls.drive(TimelineCommand::Run)
        })
        .map_err(raised::world)
    }

    /// Stops time.
    fn pause(&self, py: Python<'_>) -> PyResult<()> {
        let calls = self.at_home()?;
        py.detach(|| calls.drive(TimelineCommand::Pause)).map_err(raised::world)
    }
}
