//! A scene: read from TOML, or built of parts.
//!
//! In: a text, a path, or the dataclasses of `package/metachron/parts.py`. Out: the engine's scene. Never here: defaults, which are the
//! engine's own.

use crate::numbers::{Rotation, Vector};
use crate::object::Names;
use crate::pickled;
use crate::raised;
use crate::sensor::mount;
use crate::soft::soft;
use crate::start::started;
use crate::world::World;
use metachron::contact::joint::JointKind;
use metachron::core::NoSuchChoice;
use metachron::geometry::Solid;
use metachron::scene::format::End;
use metachron::scene::{Limits, Source, load};
use metachron::world::{self, Part, Rigid, SceneBuilder, SceneText, SolveBudget, Tube};
use pyo3::conversion::FromPyObjectOwned;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// A scene, complete or in the making.
#[pyclass(module = "metachron")]
pub struct Scene {
    inner: Inner,
}

enum Inner {
    Built(SceneBuilder),
    /// As it was read, and its text.
    Read(Box<world::Scene>, Box<SceneText>),
}

/// The same in a pickle.
#[derive(Serialize, Deserialize)]
enum Saved {
    Built(SceneBuilder),
    Read(SceneText),
}

/// The fields by which a solid moves.
const MOVING: [&str; 6] = ["mass", "velocity", "rate", "kinematic", "gravity_scale", "damping"];

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (*, gravity = None, contact = "exact", contact_least_steps = 5))]
    fn new(gravity: Option<Vector>, contact: &str, contact_least_steps: u32) -> PyResult<Self> {
        let budget = match contact {
            "budget" => SolveBudget::Timed { least_steps: contact_least_steps },
            "exact" => SolveBudget::Exact,
            other => {
                return Err(PyValueError::new_err(format!("contact is {other:?}; expected \"budget\" or \"exact\"")));
            }
        };
        let builder = world::Scene::builder().contact_budget(budget);
        let builder = gravity.into_iter().fold(builder, |builder, Vector(g)| builder.gravity(g.to_array()));
        Ok(Self { inner: Inner::Built(builder) })
    }

    /// Reads a text that has a line break as the scene itself, any other as a path, or as the name of a built-in scene.
    ///
    /// Files outside of the scene's folder are read with `allow_outside` alone, and what may take more memory than `memory_limit` bytes is refused;
    /// `None` is half of the machine's.
    ///
    /// Raises `ValueError` with every problem, a line each, with its line and column.
    #[staticmethod]
    #[pyo3(signature = (text_or_path, *, allow_outside = false, memory_limit = None))]
    pub fn from_toml(
        text_or_path: &Bound<'_, PyAny>,
        allow_outside: bool,
        memory_limit: Option<u64>,
    ) -> PyResult<Self> {
        let text: Option<String> = text_or_path.extract().ok().filter(|text: &String| text.contains('\n'));
        let source = match text {
            Some(text) => Source::memory("given as text", text.as_bytes()),
            None => {
                let path: PathBuf = text_or_path.extract()?;
                Source::open(&path.to_string_lossy())
            }
        };
        let memory_bytes = memory_limit.unwrap_or(Limits::default().memory_bytes);
        let source = source.map_err(|error| raised::scene(&error))?.within(Limits { memory_bytes, allow_outside });
        let text = SceneText {
            name: source.name().to_owned(),
            text: source.text().to_owned(),
            folder: source.folder().map(|folder| folder.to_string_lossy().into_owned()),
            overrides: Vec::new(),
        };
        Self::read(&source, text)
    }

    fn __getstate__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let saved = match &self.inner {
            Inner::Built(builder) => Saved::Built(builder.clone()),
            Inner::Read(_, text) => Saved::Read((**text).clone()),
        };
        Ok(PyBytes::new(py, &pickled::bytes(saved)?))
    }

    fn __setstate__(&mut self, pickled: &[u8]) -> PyResult<()> {
        let mut saved = Saved::Read(SceneText::default());
        pickled::read(pickled, &mut saved)?;
        *self = match saved {
            Saved::Built(builder) => Self { inner: Inner::Built(builder) },
            Saved::Read(text) => Self::of_text(text)?,
        };
        Ok(())
    }

    fn __repr__(&self) -> String {
        let names: Vec<_> = match &self.inner {
            Inner::Built(builder) => builder.names().collect(),
            Inner::Read(scene, _) => scene.agents.iter().map(|member| &*member.name).collect(),
        };
        format!("<Scene of [{}]>", names.join(", "))
    }

    /// Adds a solid that never moves.
    fn fixed<'py>(
        mut slf: PyRefMut<'py, Self>,
        name: String,
        solid: &Bound<'py, PyAny>,
    ) -> PyResult<PyRefMut<'py, Self>> {
        let mut obstacle = world::static_solid(name, shape(solid)?);
        let given = MOVING.iter().filter_map(|name| solid.getattr_opt(*name).transpose());
        let given = given.collect::<PyResult<Vec<_>>>()?;
        if !given.iter().all(|value| value.is_none() || matches!(value.extract::<bool>(), Ok(false))) {
            let name = obstacle.name;
            let message =
                format!("\"{name}\" is fixed: it has no mass, no velocity, no rate, no gravity_scale and no damping");
            return Err(PyValueError::new_err(message));
        }
        obstacle.position = field::<Option<Vector>>(solid, "at")?.map_or(obstacle.position, |Vector(at)| at);
        obstacle.rotation = field::<Option<Rotation>>(solid, "rotation")?.map_or(obstacle.rotation, |Rotation(by)| by);
        obstacle.friction = field::<Option<f64>>(solid, "friction")?.unwrap_or(obstacle.friction);
        obstacle.restitution = field::<Option<f64>>(solid, "restitution")?.unwrap_or(obstacle.restitution);
        slf.build(|builder| builder.obstacle(obstacle))?;
        Ok(slf)
    }

    /// Adds a moving object: a rigid body, a tube, a sheet, a solid or a rope.
    fn add<'py>(mut slf: PyRefMut<'py, Self>, name: String, what: &Bound<'py, PyAny>) -> PyResult<PyRefMut<'py, Self>> {
        let part = part(what)?;
        slf.build(|builder| builder.add(name, part))?;
        Ok(slf)
    }

    /// Joins the rigid bodies `a` and `b`, or `a` and the world. Place and axis of `kind` are in the world's axes, as the bodies are at the start.
    ///
    /// `friction` is dry, beside a motor: N·m of a hinge or a ball, N of a slide. `armature` is the inertia of a rotor behind its gear: kg·m², of a slide kg.
    /// A hinge or slide follows the joint `mimic`, one too: its travel is `ratio` (1) times that one's, rad or m for each rad or m.
    #[expect(clippy::too_many_arguments, reason = "a call in Python has keywords")]
    #[pyo3(signature = (name, kind, a, b = None, *, friction = 0.0, armature = 0.0, mimic = None, ratio = None))]
    fn joint<'py>(
        mut slf: PyRefMut<'py, Self>,
        name: String,
        kind: &Bound<'py, PyAny>,
        a: &str,
        b: Option<&str>,
        friction: f64,
        armature: f64,
        mimic: Option<&str>,
        ratio: Option<f64>,
    ) -> PyResult<PyRefMut<'py, Self>> {
        let (kind, Vector(at)) = (joint_kind(kind)?, field(kind, "at")?);
        if let (None, Some(ratio)) = (mimic, ratio) {
            return Err(PyValueError::new_err(format!("`ratio` is {ratio}, and there is no `mimic`; expected both")));
        }
        slf.build(|builder| {
            let joined = builder.joint(a, b, kind, at.to_array()).joint_name(name);
            let joined = joined.joint_friction(friction).joint_armature(armature);
            match mimic {
                Some(other) => joined.mimic(other, ratio.unwrap_or(1.0)),
                None => joined,
            }
        })?;
        Ok(slf)
    }

    /// Adds a sensor, which `World.sensor` reads.
    fn sensor<'py>(
        mut slf: PyRefMut<'py, Self>,
        name: String,
        on: &Bound<'py, PyAny>,
    ) -> PyResult<PyRefMut<'py, Self>> {
        let on = mount(on)?;
        slf.build(|builder| builder.sensor(name, on))?;
        Ok(slf)
    }

    /// Starts a world of it, whose time stands at first. Raises `ValueError` for what cannot be built.
    ///
    /// At the pace `"free"`, the default in lockstep, time waits for objects: none gives up time or makes longer steps than it was asked for. At
    /// `"real-time"`, the default on other executors, it passes beside the clock, and an object that is too slow for it does; in lockstep that
    /// is by what the scene's declared machine costs.
    #[pyo3(signature = (executor = "lockstep", pace = None))]
    pub fn start(&self, py: Python<'_>, executor: &str, pace: Option<&str>) -> PyResult<Py<World>> {
        let text = match &self.inner {
            Inner::Built(_) => None,
            Inner::Read(_, text) => Some((**text).clone()),
        };
        let scene = self.resolved()?;
        World::of(py, started(py, &scene, executor, pace)?, &scene, text)
    }
}

impl Scene {
    fn read(source: &Source, text: SceneText) -> PyResult<Self> {
        let scene = load(source, &text.overrides).map_err(|error| raised::scene(&error))?;
        Ok(Self { inner: Inner::Read(Box::new(scene), Box::new(text)) })
    }

    /// The scene of a text that was read before, whatever its limits were then; files next to it are read again.
    pub fn of_text(text: SceneText) -> PyResult<Self> {
        let source = Source::recorded(&text.name, &text.text, text.folder.as_deref().map(Path::new));
        let unlimited = Limits { memory_bytes: u64::MAX, allow_outside: true };
        Self::read(&source.map_err(|error| raised::scene(&error))?.within(unlimited), text)
    }

    /// The engine's scene.
    pub fn resolved(&self) -> PyResult<world::Scene> {
        match &self.inner {
            Inner::Built(builder) => builder.clone().build().map_err(|error| raised::build(&error)),
            Inner::Read(scene, _) => Ok((**scene).clone()),
        }
    }

    fn build(&mut self, more: impl FnOnce(SceneBuilder) -> SceneBuilder) -> PyResult<()> {
        let Inner::Built(builder) = &mut self.inner else {
            let message = "a scene from TOML is complete: add objects to its text, or to the world that it starts";
            return Err(PyValueError::new_err(message));
        };
        *builder = more(std::mem::replace(builder, world::Scene::builder()));
        Ok(())
    }
}

/// A field of a part.
pub fn field<'py, T: FromPyObjectOwned<'py>>(part: &Bound<'py, PyAny>, name: &str) -> PyResult<T> {
    let wrong = |error: T::Error| raised::of_argument(part.py(), &format!("field '{name}'"), &error.into());
    part.getattr(name)?.extract().map_err(wrong)
}

/// A part with a field set, unless that is `None`.
pub fn set<'py, P, T: FromPyObjectOwned<'py>>(
    built: P,
    part: &Bound<'py, PyAny>,
    name: &str,
    set: impl FnOnce(P, T) -> P,
) -> PyResult<P> {
    if part.getattr(name)?.is_none() { Ok(built) } else { Ok(set(built, field(part, name)?)) }
}

/// Points, m.
pub fn points(part: &Bound<'_, PyAny>) -> PyResult<Vec<[f64; 3]>> {
    Ok(field::<Vec<Vector>>(part, "points")?.iter().map(|Vector(point)| point.to_array()).collect())
}

/// A choice by its name.
pub fn chosen<T: FromStr<Err = NoSuchChoice>>(what: &str, name: &str) -> PyResult<T> {
    name.parse::<T>().map_err(|error| PyValueError::new_err(format!("there is no {what} {error}")))
}

/// The class of a part.
pub fn class(part: &Bound<'_, PyAny>) -> PyResult<String> {
    Ok(part.get_type().name()?.to_string())
}

/// A moving object: a rigid body, a tube or a soft body.
pub fn part(part: &Bound<'_, PyAny>) -> PyResult<Part> {
    if class(part)? == "Tube" {
        return Ok(tube(part)?.into());
    }
    if let Some(soft) = soft(part)? {
        return Ok(soft.into());
    }
    let solid = shape(part)?;
    if matches!(solid, Solid::Plane) {
        return Err(PyValueError::new_err("a Plane does not move: it is fixed in a scene"));
    }
    let rigid = set(Rigid::new(solid), part, "at", |rigid, Vector(at)| rigid.at(at.to_array()))?;
    let rigid = set(rigid, part, "rotation", |rigid, Rotation(by)| rigid.turned(by))?;
    let rigid = set(rigid, part, "velocity", |rigid, Vector(velocity)| rigid.velocity_m_s(velocity.to_array()))?;
    let rigid = set(rigid, part, "friction", Rigid::friction)?;
    let rigid = set(rigid, part, "restitution", Rigid::restitution)?;
    let rigid = set(rigid, part, "mass", Rigid::mass_kg)?;
    let rigid = set(rigid, part, "gravity_scale", Rigid::gravity_scale)?;
    let rigid = set(rigid, part, "damping", |rigid, (linear, angular)| rigid.damping_per_s(linear, angular))?;
    let rigid = set(rigid, part, "rate", Rigid::rate_hz)?;
    Ok(if field(part, "kinematic")? { rigid.kinematic() } else { rigid }.into())
}

fn shape(part: &Bound<'_, PyAny>) -> PyResult<Solid> {
    let number = |name| field::<f64>(part, name);
    Ok(match class(part)?.as_str() {
        "Plane" => Solid::Plane,
        "Ball" => Solid::Ball { radius_m: number("radius")? },
        "Box" => Solid::Box { half_extents_m: field::<Vector>(part, "half_extents")?.0 },
        "Capsule" => Solid::Capsule { radius_m: number("radius")?, half_height_m: number("half_height")? },
        "Cylinder" => Solid::Cylinder { radius_m: number("radius")?, half_height_m: number("half_height")? },
        other => {
            let message = format!(
                "a solid is a Plane, Ball, Box, Capsule or Cylinder, and what moves may be a Tube, Sheet, SoftBox, SoftBall, SoftMesh or Rope; \
                 got a {other}"
            );
            return Err(PyTypeError::new_err(message));
        }
    })
}

fn tube(part: &Bound<'_, PyAny>) -> PyResult<Tube> {
    let Names(clamp) = field(part, "clamp")?;
    let clamp = clamp.iter().map(|end| chosen::<End>("end of a tube", end)).collect::<PyResult<Vec<_>>>()?;
    let tube = Tube::along(&points(part)?).clamp(End::ALL.map(|end| clamp.contains(&end)));
    let tube = set(tube, part, "radius", Tube::radius_m)?;
    let tube = set(tube, part, "wall", Tube::wall_m)?;
    let tube = set(tube, part, "young", Tube::young_pa)?;
    let tube = set(tube, part, "density", Tube::density_kg_m3)?;
    let tube = set(tube, part, "damping", Tube::damping_per_s)?;
    let tube = set(tube, part, "rate", Tube::rate_hz)?;
    set(tube, part, "segments", Tube::segments)
}

fn joint_kind(kind: &Bound<'_, PyAny>) -> PyResult<JointKind> {
    let axis = || field(kind, "axis").map(|Vector(axis)| axis);
    let range = || field(kind, "range");
    Ok(match class(kind)?.as_str() {
        "Fixed" => JointKind::Fixed,
        "Spherical" => JointKind::Spherical,
        "Revolute" => JointKind::Revolute { axis: axis()?, range_rad: range()?, motor: None },
        "Prismatic" => JointKind::Prismatic { axis: axis()?, range_m: range()?, motor: None },
        other => {
            let message = format!("a joint is a Revolute, Prismatic, Spherical or Fixed, not a {other}");
            return Err(PyTypeError::new_err(message));
        }
    })
}
