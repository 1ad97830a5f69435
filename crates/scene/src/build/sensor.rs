//! Reads the sensors of a scene file, and the names of its joints.
//!
//! In: [`SensorFile`]s, the objects and joints of the scene. Out: [`Sensor`]s; problems to the [`Checker`]. Never here:
//! readings.

use super::common::{point, rotation};
use super::objects::{NamedObject, Objects};
use crate::check::{Checker, Place};
use crate::format::{JointFile, SensorFile, SensorFileKind as Kind};
use glam::DVec3;
use metachron_core::{AgentId, ContactPartner};
use metachron_world::{Sensor, SensorKind, Site, Spec};

/// Everything that sensors may be on.
struct Mounts<'a> {
    objects: &'a Objects,
    /// By their numbers; empty where they have none.
    joints: &'a [String],
}

/// The names of joints, by their numbers; empty where they have none.
pub(crate) fn joint_names(c: &mut Checker<'_, '_>, files: &[JointFile]) -> Vec<String> {
    let names: Vec<String> = files.iter().map(|file| file.name.clone().unwrap_or_default()).collect();
    for (i, name) in names.iter().enumerate().filter(|(i, _)| files[*i].name.is_some()) {
        let place = c.place(&format!("joint.{i}"));
        check_name(c, &place, name, &names[..i]);
    }
    names
}

fn check_name(c: &mut Checker<'_, '_>, place: &Place, name: &String, before: &[String]) {
    if name.trim().is_empty() || name.chars().count() > 64 {
        c.wrong(place, "name", "is not a valid name", "expected 1 to 64 characters");
    } else if before.contains(name) {
        c.wrong(place, "name", format_args!("is `{name}`, as another one is"), "expected a unique name");
    }
}

/// The sensors of the scene.
pub(crate) fn sensors(
    c: &mut Checker<'_, '_>,
    files: &[SensorFile],
    objects: &Objects,
    joints: &[String],
) -> Vec<Sensor> {
    let names: Vec<String> = files.iter().map(|file| file.name.clone()).collect();
    let mounts = Mounts { objects, joints };
    let mut sensors = Vec::with_capacity(files.len());
    for (i, file) in files.iter().enumerate() {
        let place = c.place(&format!("sensor.{i}"));
        check_name(c, &place, &file.name, &names[..i]);
        let kind = mounts.kind(c, &place, file);
        sensors.extend(kind.map(|kind| Sensor { name: file.name.clone(), kind }));
    }
    sensors
}

impl Mounts<'_> {
    fn kind(&self, c: &mut Checker<'_, '_>, place: &Place, file: &SensorFile) -> Option<SensorKind> {
        check_keys(c, place, file);
        Some(match file.kind {
            Kind::JointPosition => SensorKind::JointPosition(self.joint(c, place, file)?),
            Kind::JointVelocity => SensorKind::JointVelocity(self.joint(c, place, file)?),
            Kind::JointEffort => SensorKind::JointEffort(self.joint(c, place, file)?),
            Kind::ContactForce => {
                let object = self.object(c, place, file)?;
                let with = match &file.with {
                    Some(with) => Some(self.partner(c, place, with)?),
                    None => None,
                };
                if with == Some(ContactPartner::Agent(object)) {
                    c.wrong(place, "with", "is the object itself", "expected another object");
                    return None;
                }
                SensorKind::ContactForce { object, with }
            }
            Kind::Imu => {
                let object = self.rigid(c, place, file)?;
                let Spec::Rigid(spec) = &self.objects.agents.iter().find(|member| member.id == object)?.spec else {
                    return None;
                };
                if spec.led.is_some() {
                    let expected = "expected a rigid object that is not kinematic";
                    c.wrong(place, "object", "is kinematic, and has no acceleration of its own", expected);
                    return None;
                }
                SensorKind::Imu { object, gravity_m_s2: spec.gravity, site: site(file) }
            }
            Kind::Pose => SensorKind::Pose { object: self.rigid(c, place, file)?, at_m: point(file.at_m) },
        })
    }

    fn joint(&self, c: &mut Checker<'_, '_>, place: &Place, file: &SensorFile) -> Option<u32> {
        let name = required(c, place, "joint", file.joint.as_ref())?;
        let at = self.joints.iter().position(|joint| joint == name && !name.is_empty());
        if at.is_none() {
            let known = self.joints.iter().map(String::as_str).filter(|joint| !joint.is_empty());
            c.reference(place, "joint", name, known);
        }
        at.map(|at| at as u32)
    }

    fn object(&self, c: &mut Checker<'_, '_>, place: &Place, file: &SensorFile) -> Option<AgentId> {
        let name = required(c, place, "object", file.object.as_ref())?;
        match self.objects.names.get(name) {
            Some(named) if named.agent().is_some() => named.agent(),
            Some(_) => {
                c.wrong(
                    place,
                    "object",
                    format_args!("names `{name}`, which is fixed"),
                    "expected an object that moves",
                );
                None
            }
            None => {
                c.reference(place, "object", name, self.objects.names.agents());
                None
            }
        }
    }

    fn rigid(&self, c: &mut Checker<'_, '_>, place: &Place, file: &SensorFile) -> Option<AgentId> {
        let id = self.object(c, place, file)?;
        let is_rigid =
            file.object.as_ref().and_then(|name| self.objects.names.get(name)) == Some(NamedObject::Rigid(id));
        if !is_rigid {
            c.wrong(place, "object", "is no rigid object", "expected one");
        }
        is_rigid.then_some(id)
    }

    fn partner(&self, c: &mut Checker<'_, '_>, place: &Place, name: &str) -> Option<ContactPartner> {
        if let Some(at) = self.objects.obstacles.iter().position(|solid| solid.name == name) {
            return Some(ContactPartner::Static(at as u32));
        }
        let agent = self.objects.names.get(name).and_then(NamedObject::agent);
        if agent.is_none() {
            c.reference(place, "with", name, self.objects.names.only(|_| true));
        }
        agent.map(ContactPartner::Agent)
    }
}

/// Where on its object a sensor is.
fn site(file: &SensorFile) -> Site {
    Site { at_m: file.at_m.map(DVec3::from), rotation: rotation(file.rotation_deg) }
}

fn required<'a>(c: &mut Checker<'_, '_>, place: &Place, key: &str, given: Option<&'a String>) -> Option<&'a String> {
    if given.is_none() {
        c.wrong(place, key, "is missing", format!("expected the name of {key}s in this table"));
    }
    given
}

/// Reports keys that belong to another kind.
fn check_keys(c: &mut Checker<'_, '_>, place: &Place, file: &SensorFile) {
    let foreign: &[&str] = match file.kind {
        Kind::JointPosition | Kind::JointVelocity | Kind::JointEffort => &["object", "with", "at_m", "rotation_deg"],
        Kind::ContactForce => &["joint", "at_m", "rotation_deg"],
        Kind::Pose => &["joint", "with", "rotation_deg"],
        Kind::Imu => &["joint", "with"],
    };
    c.refuse(place, foreign, "does not belong to a sensor of this kind", "expected no such key");
}
