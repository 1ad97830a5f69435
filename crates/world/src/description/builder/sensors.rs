//! Sensors of a scene built in code.
//!
//! In: names. Out: [`Sensor`]s of the scene. Never here: readings.

use super::SceneBuildError;
use crate::description::scene::{Member, Spec};
use crate::description::sensor::{Sensor, SensorKind, Site};
use metachron_core::{ContactPartner, unit_rotation};
use metachron_geometry::Obstacle;

/// A sensor, with its mount by name.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct Mounted {
    pub name: String,
    pub on: SensorOn,
}

/// The mount of a sensor, by name.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum SensorOn {
    /// How far a hinge or a slide has moved: [`SensorKind::JointPosition`].
    JointPosition(String),
    /// How fast: [`SensorKind::JointVelocity`].
    JointVelocity(String),
    /// By how much it is driven: [`SensorKind::JointEffort`].
    JointEffort(String),
    /// All contacts of an object: [`SensorKind::ContactForce`].
    ContactForce(String),
    /// The force that one object or fixed solid, the second, gives the first.
    ContactBetween(String, String),
    /// An accelerometer and a gyroscope in a rigid body that is not kinematic: [`SensorKind::Imu`].
    Imu(String),
    /// The same where a site says, whose rotation needs no length of 1.
    ImuAt(String, Site),
    /// A point of a rigid body, metres in the axes of its shape: [`SensorKind::Pose`].
    Pose(String, [f64; 3]),
}

/// Everything that sensors may be on.
pub(super) struct Mounts<'a> {
    pub agents: &'a [Member],
    pub fixed: &'a [Obstacle],
    pub joints: &'a [String],
}

impl Mounts<'_> {
    pub fn sensor(&self, mounted: Mounted) -> Result<Sensor, SceneBuildError> {
        let Mounted { name, on } = mounted;
        let nothing =
            |on: &String, what: &'static str| SceneBuildError::NoMount { sensor: name.clone(), on: on.clone(), what };
        let joint = |on: &String| {
            let at = self.joints.iter().position(|joint| joint == on && !joint.is_empty());
            at.map(|at| at as u32).ok_or_else(|| nothing(on, "joint"))
        };
        let object = |on: &String| self.agents.iter().find(|member| member.name == *on);
        let moving = |on: &String| object(on).map(|member| member.id).ok_or_else(|| nothing(on, "object that moves"));
        let rigid = |on: &String| match object(on).map(|member| (member.id, &member.spec)) {
            Some((id, Spec::Rigid(spec))) => Ok((id, spec)),
            _ => Err(nothing(on, "rigid body")),
        };
        let imu = |on: &String, site| match rigid(on)? {
            (_, spec) if spec.led.is_some() => Err(nothing(on, "rigid body that forces move")),
            (object, spec) => Ok(SensorKind::Imu { object, gravity_m_s2: spec.gravity, site }),
        };
        let partner = |on: &String| match self.fixed.iter().position(|solid| solid.name == *on) {
            Some(at) => Ok(ContactPartner::Static(at as u32)),
            None => moving(on).map(ContactPartner::Agent),
        };
        let kind = match &on {
            SensorOn::JointPosition(on) => SensorKind::JointPosition(joint(on)?),
            SensorOn::JointVelocity(on) => SensorKind::JointVelocity(joint(on)?),
            SensorOn::JointEffort(on) => SensorKind::JointEffort(joint(on)?),
            SensorOn::ContactForce(on) => SensorKind::ContactForce { object: moving(on)?, with: None },
            SensorOn::ContactBetween(on, with) => {
                SensorKind::ContactForce { object: moving(on)?, with: Some(partner(with)?) }
            }
            SensorOn::Imu(on) => imu(on, Site::default())?,
            SensorOn::ImuAt(on, site) => imu(on, checked(&name, site)?)?,
            SensorOn::Pose(on, at_m) => SensorKind::Pose { object: rigid(on)?.0, at_m: (*at_m).into() },
        };
        Ok(Sensor { name, kind })
    }
}

/// The same site by a rotation of length 1.
fn checked(sensor: &str, site: &Site) -> Result<Site, SceneBuildError> {
    let rotation = unit_rotation(site.rotation).filter(|_| site.at_m.is_none_or(|at_m| at_m.is_finite()));
    let bad = || SceneBuildError::BadSite { sensor: sensor.to_owned(), found: format!("{site:?}") };
    Ok(Site { rotation: rotation.ok_or_else(bad)?, ..*site })
}
