//! Sensors: readings of a world by name, and joints by name.
//!
//! In: the newest states. Out: numbers, with the time that they are of. Never here: noise, delays, stored readings.

use super::object::Object;
use crate::description::scene::{Scene, Spec};
use crate::description::sensor::{Sensor, SensorKind, Site};
use crate::error::WorldError;
use crate::world::World;
use glam::{DQuat, DVec3};
use metachron_contact::joint::{Joint, JointKind, Motor};
use metachron_contact::member::Pose;
use metachron_core::{AgentId, Anchor, Body, RigidState, SimTime, Snapshot};
use metachron_geometry::ShapeKind;
use metachron_runtime::{AgentHandle, Command};
use std::sync::Arc;

/// A reading of a sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// When: the time of the state that it is of.
    pub time: SimTime,
    /// The numbers, as [`SensorKind`] lists them.
    pub values: Vec<f64>,
}

/// A joint of a world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JointRef {
    body: Object,
    number: u32,
}

impl JointRef {
    /// The object that takes commands for it: its first body.
    #[must_use]
    pub const fn body(self) -> Object {
        self.body
    }

    /// Its number in the scene.
    #[must_use]
    pub const fn number(self) -> u32 {
        self.number
    }

    /// The command that lets a motor drive it; for [`JointRef::body`].
    #[must_use]
    pub const fn motor(self, motor: Motor) -> Command {
        Command::motor(self.number, motor)
    }
}

/// A joint as a world lists it.
#[derive(Debug, Clone, Copy)]
pub struct ListedJoint<'a> {
    /// The reference by which commands and coordinates name it.
    pub at: JointRef,
    /// Its name; `None` where it has none.
    pub name: Option<&'a str>,
    /// Its bodies, kind, range and anchors, as the scene has them.
    pub joint: &'a Joint,
}

/// Joints, sensors and fixed solids of a world, by name.
#[derive(Debug, Default)]
pub(crate) struct Instruments {
    pub joint_names: Vec<String>,
    pub joints: Arc<[Joint]>,
    pub sensors: Vec<Sensor>,
    pub fixed_names: Vec<Arc<str>>,
    /// How far the joints have moved from their zeros at the start, rad or m.
    pub starts: Vec<f64>,
}

impl Instruments {
    pub fn of(scene: &Scene) -> Self {
        let pose = |id: AgentId| match &scene.agents.get(id.0 as usize)?.spec {
            Spec::Rigid(body) => {
                Some(Pose { origin_m: body.position, rotation: body.rotation.normalize(), ..Pose::WORLD })
            }
            _ => None,
        };
        let start = |joint: &Joint| {
            let (a, b) = (pose(joint.a)?, joint.b.map_or(Some(Pose::WORLD), pose)?);
            Some(joint.travel(&a, &b))
        };
        Self {
            joint_names: scene.joint_names.clone(),
            joints: Arc::clone(&scene.joints),
            sensors: scene.sensors.clone(),
            fixed_names: scene.obstacles.iter().map(|solid| solid.name.as_str().into()).collect(),
            starts: scene.joints.iter().map(|joint| start(joint).unwrap_or_default()).collect(),
        }
    }
}

/// A rigid body as joints see it.
struct Placed {
    pose: Pose,
    velocity: DVec3,
    spin: DVec3,
    state: Arc<Snapshot>,
}

impl World {
    /// All joints of the scene, in its order.
    pub fn joints(&self) -> impl Iterator<Item = ListedJoint<'_>> {
        let Instruments { joint_names, joints, .. } = self.instruments();
        (0..).zip(joints.iter()).zip(joint_names).map(|((number, joint), name)| {
            let at = JointRef { body: self.tag().object(joint.a), number };
            ListedJoint { at, name: Some(&**name).filter(|name| !name.is_empty()), joint }
        })
    }

    /// The joint of that name.
    ///
    /// # Errors
    /// [`WorldError::NoJoint`].
    pub fn joint(&self, name: impl AsRef<str>) -> Result<JointRef, WorldError> {
        let name = name.as_ref();
        let Instruments { joint_names, joints, .. } = self.instruments();
        let at = joint_names.iter().position(|joint| joint == name && !name.is_empty());
        let found = at.and_then(|at| Some((at as u32, joints.get(at)?.a)));
        let Some((number, a)) = found else {
            let known = joint_names.iter().filter(|name| !name.is_empty()).take(20).cloned().collect::<Vec<_>>();
            return Err(WorldError::NoJoint { name: name.to_owned(), known: known.join(", ") });
        };
        Ok(JointRef { body: self.object_of(a)?, number })
    }

    /// A joint as messages name it: by its name, or by its number where it has none.
    pub(crate) fn joint_name(&self, joint: u32) -> String {
        let name = self.instruments().joint_names.get(joint as usize).filter(|name| !name.is_empty());
        name.map_or_else(|| joint.to_string(), |name| format!("\"{name}\""))
    }

    /// The sensors of the scene.
    #[must_use]
    pub fn sensors(&self) -> &[Sensor] {
        &self.instruments().sensors
    }

    /// A sensor's reading now, of the newest states.
    ///
    /// # Errors
    /// [`WorldError::NoSensor`], and [`WorldError::Gone`] where its object has been removed.
    pub fn sensor(&self, name: impl AsRef<str>) -> Result<Reading, WorldError> {
        let name = name.as_ref();
        let sensors = self.sensors();
        let Some(sensor) = sensors.iter().find(|sensor| sensor.name == name) else {
            let known = sensors.iter().take(20).map(|sensor| sensor.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(WorldError::NoSensor { name: name.to_owned(), known });
        };
        self.read(&sensor.kind)
    }

    /// The reading now of a sensor of this kind.
    ///
    /// # Errors
    /// [`WorldError::NoAgent`] and [`WorldError::Gone`].
    pub fn read(&self, kind: &SensorKind) -> Result<Reading, WorldError> {
        match *kind {
            SensorKind::JointPosition(number) => {
                self.read_joint(number, |joint, [a, b]| joint.travel(&a.pose, &b.pose))
            }
            SensorKind::JointVelocity(number) => self.read_joint(number, rate),
            SensorKind::JointEffort(number) => {
                let state = self.latest(self.object_of(self.joint_at(number)?.a)?)?;
                let effort = state.efforts.iter().find(|effort| effort.joint == number);
                Ok(Reading { time: state.time, values: vec![effort.map_or(0.0, |effort| effort.effort)] })
            }
            SensorKind::ContactForce { object, with } => {
                let object = self.object_of(object)?;
                let counts = with.map(|with| super::events::touched(self.tag(), with));
                let contacts = self.contacts(object)?;
                let forces = contacts.iter().filter(|contact| counts.is_none_or(|with| with == contact.with));
                let force_n: DVec3 = forces.map(|contact| contact.force_n).sum();
                Ok(Reading { time: self.latest(object)?.time, values: force_n.to_array().to_vec() })
            }
            SensorKind::Imu { object, gravity_m_s2, site } => self.read_imu(object, gravity_m_s2, site),
            SensorKind::Pose { object, at_m } => {
                let Placed { pose, state, .. } = self.placed(object)?;
                let values = [&pose.place(at_m).to_array()[..], &pose.rotation.to_array()].concat();
                Ok(Reading { time: state.time, values })
            }
        }
    }

    /// The acceleration of a point of a rigid body, a + α × r + ω × (ω × r), less that of gravity, and its spin.
    fn read_imu(&self, id: AgentId, gravity_m_s2: DVec3, site: Site) -> Result<Reading, WorldError> {
        let Placed { pose, spin, state, .. } = self.placed(id)?;
        let arm_m = site.at_m.map_or(DVec3::ZERO, |at_m| pose.place(at_m) - pose.centre_m);
        let about_centre_m_s2 = state.angular_acceleration.cross(arm_m) + spin.cross(spin.cross(arm_m));
        let to_site = (pose.rotation * site.rotation).conjugate();
        // a body at rest is held: gravity alone is missing
        let specific_force_m_s2 = state.acceleration + about_centre_m_s2 - gravity_m_s2;
        let values = [specific_force_m_s2, spin].map(|v| (to_site * v).to_array()).concat();
        Ok(Reading { time: state.time, values })
    }

    pub(super) fn joint_at(&self, number: u32) -> Result<&Joint, WorldError> {
        let joints = &self.instruments().joints;
        joints
            .get(number as usize)
            .ok_or_else(|| WorldError::NoJoint { name: number.to_string(), known: String::new() })
    }

    fn read_joint(&self, number: u32, read: impl Fn(&Joint, [&Placed; 2]) -> f64) -> Result<Reading, WorldError> {
        let joint = self.joint_at(number)?;
        let a = self.placed(joint.a)?;
        let b = joint.b.map_or_else(|| Ok(Placed::world()), |b| self.placed(b))?;
        Ok(Reading { time: a.state.time, values: vec![read(joint, [&a, &b])] })
    }

    fn placed(&self, id: AgentId) -> Result<Placed, WorldError> {
        let object = self.object_of(id)?;
        let (agent, state) = (self.agent(object)?, self.latest(object)?);
        let com = centre_of_mass(agent);
        let RigidState { position, rotation, velocity, spin } = rigid(&state.body);
        let origin_m = position - rotation * com;
        let pose = Pose { centre_m: position, origin_m, rotation, ..Pose::WORLD };
        Ok(Placed { pose, velocity, spin, state })
    }
}

impl Placed {
    /// The fixed world.
    fn world() -> Self {
        Self { pose: Pose::WORLD, velocity: DVec3::ZERO, spin: DVec3::ZERO, state: Arc::default() }
    }

    /// The velocity of its matter at a point of space, m/s.
    fn at(&self, point_m: DVec3) -> DVec3 {
        self.velocity + self.spin.cross(point_m - self.pose.centre_m)
    }
}

/// The centre of mass of a rigid body in the axes of its shape, metres; zero of all else.
pub(super) fn centre_of_mass(agent: &AgentHandle) -> DVec3 {
    match agent.form().as_ref().map(|shape| &shape.kind) {
        Some(ShapeKind::Solid(solid)) => solid.com_local,
        _ => DVec3::ZERO,
    }
}

/// How fast b moves from a in the way that a joint leaves free.
fn rate(joint: &Joint, [a, b]: [&Placed; 2]) -> f64 {
    let (on_a, on_b) = (a.pose.place(joint.anchor_a_m), b.pose.place(joint.anchor_b_m));
    match joint.kind {
        JointKind::Revolute { axis, .. } => (b.spin - a.spin).dot((a.pose.rotation * axis).normalize_or_zero()),
        // the axis is a's, so its matter beside b's anchor counts
        JointKind::Prismatic { axis, .. } => {
            (b.at(on_b) - a.at(on_b)).dot((a.pose.rotation * axis).normalize_or_zero())
        }
        _ => (b.at(on_b) - a.at(on_a)).dot((on_b - on_a).normalize_or_zero()),
    }
}

/// The state of a rigid body, or of a tool's tip; at rest in the origin for all else.
fn rigid(body: &Body) -> RigidState {
    match body {
        Body::Rigid(state) => *state,
        body => {
            let (position, velocity) = body.point(Anchor::Local(DVec3::ZERO)).unwrap_or_default();
            RigidState { position, velocity, rotation: DQuat::IDENTITY, spin: DVec3::ZERO }
        }
    }
}
