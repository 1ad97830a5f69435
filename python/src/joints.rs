//! The joints of a world: their names and kinds, and coordinates of hinges and slides as arrays.
//!
//! In: arrays, or numbers by joints. Out: the same of the newest states. Never here: kinematics.

use crate::numbers::array;
use crate::raised;
use metachron::contact::joint::JointKind;
use metachron::world::{JointRef, JointState, ListedJoint, World};
use numpy::PyArray1;
use pyo3::exceptions::{PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyIterator, PyList};
use std::collections::BTreeMap;

/// The joints of a world, in the order of its scene; the arrays have a number for each hinge and slide of them.
#[pyclass(frozen, module = "metachron")]
pub struct Joints {
    world: World,
}

/// A joint of a world.
#[pyclass(frozen, get_all, module = "metachron")]
pub struct Joint {
    /// Its place in the scene, from 0.
    number: u32,
    name: Option<String>,
    kind: &'static str,
    /// Its first body.
    a: String,
    /// Its second body, which its coordinate moves against the first; `None` for the world.
    b: Option<String>,
    /// Of a hinge or a slide, rad or m; `None` where it has none.
    range: Option<(f64, f64)>,
}

/// An argument that names a joint.
#[derive(FromPyObject)]
pub enum NamedJoint {
    #[pyo3(transparent)]
    Name(String),
    #[pyo3(transparent)]
    Number(u32),
}

/// Coordinates as they are given.
#[derive(FromPyObject)]
pub enum Coordinates<'py> {
    #[pyo3(transparent)]
    Named(Bound<'py, PyDict>),
    #[pyo3(transparent)]
    All(Vec<f64>),
}

impl NamedJoint {
    /// The joint in this world.
    pub fn of(&self, world: &World) -> PyResult<JointRef> {
        match self {
            Self::Name(name) => world.joint(name).map_err(raised::world),
            Self::Number(number) => {
                let found = world.joints().nth(*number as usize).map(|listed| listed.at);
                let count = world.joints().count();
                found.ok_or_else(|| PyKeyError::new_err(format!("the world has no joint {number}; it has {count}")))
            }
        }
    }
}

/// Whether it has a coordinate.
fn moves(listed: &ListedJoint<'_>) -> bool {
    listed.joint.takes_motor()
}

impl Joints {
    pub fn new(world: &World) -> Self {
        Self { world: world.clone() }
    }

    fn joint(&self, listed: &ListedJoint<'_>) -> PyResult<Joint> {
        let name = |id| {
            let object = self.world.object_of(id).map_err(raised::world)?;
            self.world.name(object).map(str::to_owned).map_err(raised::world)
        };
        let (kind, range) = match listed.joint.kind {
            JointKind::Fixed => ("fixed", None),
            JointKind::Spherical => ("spherical", None),
            JointKind::Revolute { range_rad, .. } => ("revolute", range_rad),
            JointKind::Prismatic { range_m, .. } => ("prismatic", range_m),
            JointKind::Spring { .. } => ("spring", None),
            JointKind::Rope { .. } => ("rope", None),
        };
        Ok(Joint {
            number: listed.at.number(),
            name: listed.name.map(str::to_owned),
            kind,
            a: name(listed.joint.a)?,
            b: listed.joint.b.map(name).transpose()?,
            range: range.map(|[low, high]| (low, high)),
        })
    }

    fn coordinates<'py>(&self, py: Python<'py>, of: fn(&JointState) -> f64) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let states = self.world.joint_states().map_err(raised::world)?;
        Ok(array(py, states.iter().map(of).collect::<Vec<_>>().into()))
    }

    /// Numbers with the joints that they are for.
    fn given(&self, what: &str, coordinates: Option<Coordinates<'_>>) -> PyResult<Vec<(JointRef, f64)>> {
        match coordinates {
            None => Ok(Vec::new()),
            Some(Coordinates::Named(named)) => {
                let one = |(joint, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
                    let wanted = |_| PyTypeError::new_err(format!("{what}: expected numbers by names of joints"));
                    let joint: NamedJoint = joint.extract().map_err(wanted)?;
                    Ok((joint.of(&self.world)?, value.extract().map_err(wanted)?))
                };
                named.iter().map(one).collect()
            }
            Some(Coordinates::All(all)) => {
                let joints: Vec<_> = self.world.joints().filter(moves).map(|listed| listed.at).collect();
                if all.len() != joints.len() {
                    let (found, count) = (all.len(), joints.len());
                    let message = format!("{what} has {found} numbers; the world has {count} hinges and slides");
                    return Err(PyValueError::new_err(message));
                }
                Ok(joints.into_iter().zip(all).collect())
            }
        }
    }
}

#[pymethods]
impl Joints {
    fn __len__(&self) -> usize {
        self.world.joints().count()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyIterator>> {
        let all: Vec<_> = self.world.joints().map(|listed| self.joint(&listed)).collect::<PyResult<_>>()?;
        PyList::new(py, all)?.try_iter()
    }

    fn __getitem__(&self, joint: NamedJoint) -> PyResult<Joint> {
        let number = joint.of(&self.world)?.number();
        let listed = self.world.joints().nth(number as usize);
        listed.map_or_else(|| Err(PyKeyError::new_err(number)), |listed| self.joint(&listed))
    }

    /// (n,), rad and m: how far each hinge and slide has moved from its zero, of the newest states, or as it was set since.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.coordinates(py, |state| state.position)
    }

    /// (n,), rad/s and m/s: how fast they do.
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.coordinates(py, |state| state.velocity)
    }

    /// Puts hinges and slides to coordinates before the next step, and all bodies that they carry: a number for each of them, or a dictionary of
    /// some by name. The others, and joints given `None`, keep theirs. The root of a tree of joints stays: the world,
    /// a kinematic body, or else its first.
    ///
    /// Raises `ValueError`, and moves nothing, outside a joint's range, where a loop of joints would be open, and while time passes.
    #[pyo3(signature = (positions = None, velocities = None))]
    fn set(
        &self,
        py: Python<'_>,
        positions: Option<Coordinates<'_>>,
        velocities: Option<Coordinates<'_>>,
    ) -> PyResult<()> {
        let (positions, velocities) = (self.given("positions", positions)?, self.given("velocities", velocities)?);
        let mut states = BTreeMap::new();
        for (joint, _) in positions.iter().chain(&velocities) {
            states.insert(joint.number(), self.world.joint_state(*joint).map_err(raised::world)?);
        }
        for (joint, position) in positions {
            states.entry(joint.number()).and_modify(|state| state.position = position);
        }
        for (joint, velocity) in velocities {
            states.entry(joint.number()).and_modify(|state| state.velocity = velocity);
        }
        let states: Vec<_> = states.into_values().collect();
        py.detach(|| self.world.set_joint_states(&states)).map_err(raised::world)
    }

    /// Puts all joints back to where the scene has them at the start, at rest; the root of a tree of joints stays where it is.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| self.world.reset_joints()).map_err(raised::world)
    }

    fn __repr__(&self) -> String {
        let names: Vec<_> =
            self.world.joints().map(|joint| joint.name.map_or(joint.at.number().to_string(), str::to_owned)).collect();
        format!("<Joints [{}]>", names.join(", "))
    }
}

#[pymethods]
impl Joint {
    fn __repr__(&self) -> String {
        let name = self.name.as_ref().map_or_else(|| self.number.to_string(), |name| format!("{name:?}"));
        let b = self.b.as_ref().map_or_else(|| "the world".to_owned(), |b| format!("{b:?}"));
        format!("<Joint {name}, {} of {:?} and {b}>", self.kind, self.a)
    }
}
