//! The state that an object published: it never changes, and outlives its world.
//!
//! In: a snapshot. Out: arrays that nobody can write to, each a copy. Never here: a lock.

use crate::command::Keywords;
use crate::numbers::{row, rows};
use crate::pickled;
use glam::{DQuat, DVec3};
use metachron::core::{Body, CurveState, Snapshot, SoftState};
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyAttributeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::slice::from_ref;
use std::sync::Arc;

/// The state of an object at one moment. It never changes; its arrays are copies that nobody can write to.
#[pyclass(frozen, module = "metachron")]
pub struct State(pub Arc<Snapshot>);

/// An array with a row for each.
type Rows<'py> = Bound<'py, PyArray2<f64>>;

/// The points of a body: the nodes of a deformable, the centre of mass of a rigid body or the tip of a tool.
pub struct Points<'a> {
    pub positions: &'a [DVec3],
    pub velocities: &'a [DVec3],
}

impl<'a> Points<'a> {
    /// The points of this body.
    pub fn of(body: &'a Body) -> Self {
        let (positions, velocities) = match body {
            Body::Rigid(rigid) => (from_ref(&rigid.position), from_ref(&rigid.velocity)),
            Body::Tool(tool) => (from_ref(&tool.tip), from_ref(&tool.velocity)),
            Body::Curve(curve) => (&*curve.positions, &*curve.velocities),
            Body::Soft(soft) => (&*soft.positions, &*soft.velocities),
            Body::Nothing => (&[][..], &[][..]),
        };
        Self { positions, velocities }
    }
}

impl State {
    /// Rotation and spin of a rigid body or tool.
    fn turning(&self, what: &str) -> PyResult<(DQuat, DVec3)> {
        match &self.0.body {
            Body::Rigid(rigid) => Ok((rigid.rotation, rigid.spin)),
            Body::Tool(tool) => Ok((tool.rotation, tool.spin)),
            _ => Err(self.lacks(what, "rigid bodies and tools have one")),
        }
    }

    fn curve(&self, what: &str) -> PyResult<&CurveState> {
        match &self.0.body {
            Body::Curve(curve) => Ok(curve),
            _ => Err(self.lacks(what, "tubes have them")),
        }
    }

    fn soft_nodes(&self) -> PyResult<Points<'_>> {
        match &self.0.body {
            Body::Soft(SoftState { nodes: Some(nodes), .. }) => {
                Ok(Points { positions: &nodes.positions, velocities: &nodes.velocities })
            }
            body @ Body::Soft(_) => Ok(Points::of(body)),
            _ => Err(self.lacks("nodes", "soft bodies have them")),
        }
    }

    fn lacks(&self, what: &str, have: &str) -> PyErr {
        PyAttributeError::new_err(format!("the state of a {} body has no {what}: {have}", self.body()))
    }
}

#[pymethods]
impl State {
    #[new]
    fn new(pickled: &[u8]) -> PyResult<Self> {
        let mut state = Snapshot::default();
        pickled::read(pickled, &mut state)?;
        Ok(Self(Arc::new(state)))
    }

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyBytes>,)> {
        Ok((PyBytes::new(py, &pickled::bytes(Snapshot::clone(&self.0))?),))
    }

    #[getter]
    fn body(&self) -> &'static str {
        match &self.0.body {
            Body::Rigid(_) => "rigid",
            Body::Curve(_) => "curve",
            Body::Soft(_) => "soft",
            Body::Tool(_) => "tool",
            Body::Nothing => "nothing",
        }
    }

    /// The moment, s.
    #[getter]
    fn time(&self) -> f64 {
        self.0.moment().as_secs_f64()
    }

    /// Steps so far.
    #[getter]
    fn steps(&self) -> u64 {
        self.0.steps
    }

    #[getter]
    fn at_rest(&self) -> bool {
        self.0.at_rest
    }

    /// Of the leader of a cluster, how its last step was solved: level, factors, by how much the answers miss the laws, m/s,
    /// and the deepest overlap, m.
    #[getter]
    fn contact_solve(&self) -> Option<(&'static str, u32, f64, f64)> {
        let solves = self.0.cluster?.solves?;
        Some((solves.level.name(), solves.last_factors, solves.miss_m_s, solves.depth_m))
    }

    /// Kinetic, elastic and that of gravity, J.
    #[getter]
    fn energy(&self) -> f64 {
        self.0.energy_j
    }

    /// (n, 3), m: the nodes of a deformable, the centre of mass of a rigid body or the tip of a tool.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> Rows<'py> {
        rows(py, Points::of(&self.0.body).positions.iter().map(|v| v.to_array()))
    }

    /// (n, 3), m/s, of the same points.
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> Rows<'py> {
        rows(py, Points::of(&self.0.body).velocities.iter().map(|v| v.to_array()))
    }

    /// (n, 3), m: of a soft body the nodes of the cage or lattice that carries its vertices, or these where nothing does.
    #[getter]
    fn nodes<'py>(&self, py: Python<'py>) -> PyResult<Rows<'py>> {
        Ok(rows(py, self.soft_nodes()?.positions.iter().map(|v| v.to_array())))
    }

    /// (n, 3), m/s, of the same nodes.
    #[getter]
    fn node_velocities<'py>(&self, py: Python<'py>) -> PyResult<Rows<'py>> {
        Ok(rows(py, self.soft_nodes()?.velocities.iter().map(|v| v.to_array())))
    }

    /// (4,): of a rigid body or tool, from its axes to the world's. Others raise `AttributeError`.
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(row(py, self.turning("rotation")?.0.to_array()))
    }

    /// (3,), rad/s, world axes: of a rigid body or tool.
    #[getter]
    fn spin<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(row(py, self.turning("spin")?.1.to_array()))
    }

    /// (6,), N and N m, world axes: the wrench of contacts on a rigid body or tool, about its centre of mass, in the mean of its last step.
    #[getter]
    fn contact_wrench<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let wrench = self.0.contact_wrench;
        let ([fx, fy, fz], [tx, ty, tz]) = (wrench.force_n.to_array(), wrench.torque_n_m.to_array());
        row(py, [fx, fy, fz, tx, ty, tz])
    }

    /// (n - 1, 4): of a tube, the rotations of its segments, whose z is along it.
    #[getter]
    fn frames<'py>(&self, py: Python<'py>) -> PyResult<Rows<'py>> {
        Ok(rows(py, self.curve("frames")?.frames.iter().map(|frame| frame.to_array())))
    }

    /// (n,), m: of a tube, the rest lengths from its start to its nodes.
    #[getter]
    fn arc<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(crate::numbers::array(py, self.curve("arc lengths")?.arc_m.clone().into()))
    }

    /// (n,), m: of a tube, the outer radius at each node.
    #[getter]
    fn radii<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(crate::numbers::array(py, self.curve("radii")?.radii_m.clone().into()))
    }

    /// Position, m, and velocity, m/s, of a material point, (3,) each.
    #[pyo3(signature = (**keywords), text_signature = "($self, *, arc=None, local=None, vertex=None)")]
    fn point<'py>(
        &self,
        py: Python<'py>,
        keywords: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<[Bound<'py, PyArray1<f64>>; 2]> {
        let anchor = Keywords::new("point", keywords, &["arc", "local", "vertex"])?.anchor()?;
        let no_point = || PyValueError::new_err(format!("a {} body has no point {anchor:?}", self.body()));
        let (position, velocity) = self.0.body.point(anchor).ok_or_else(no_point)?;
        Ok([position, velocity].map(|vector| row(py, vector.to_array())))
    }

    fn __repr__(&self) -> String {
        format!("<State of a {} body at {} s>", self.body(), self.time())
    }
}
