//! Mounts of a scene's sensors.
//!
//! In: the dataclasses of `package/metachron/parts.py`. Out: the engine's names of mounts. Never here: readings.

use crate::numbers::{Rotation, Vector};
use crate::scene::{class, field};
use metachron::prelude::{DQuat, SensorOn, Site};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

/// The mount of a sensor.
pub fn mount(on: &Bound<'_, PyAny>) -> PyResult<SensorOn> {
    let joint = || field::<String>(on, "joint");
    let object = || field::<String>(on, "object");
    Ok(match class(on)?.as_str() {
        "JointPosition" => SensorOn::JointPosition(joint()?),
        "JointVelocity" => SensorOn::JointVelocity(joint()?),
        "JointEffort" => SensorOn::JointEffort(joint()?),
        "ContactForce" => match field(on, "other")? {
            Some(other) => SensorOn::ContactBetween(object()?, other),
            None => SensorOn::ContactForce(object()?),
        },
        "Imu" => {
            let at_m = field::<Option<Vector>>(on, "at")?.map(|Vector(at)| at);
            let rotation = field::<Option<Rotation>>(on, "rotation")?.map_or(DQuat::IDENTITY, |Rotation(by)| by);
            SensorOn::ImuAt(object()?, Site { at_m, rotation })
        }
        "Pose" => SensorOn::Pose(object()?, field::<Vector>(on, "at")?.0.to_array()),
        other => {
            let message = format!(
                "a sensor is an Imu, Pose, ContactForce, JointPosition, JointVelocity or JointEffort, not a {other}"
            );
            return Err(PyTypeError::new_err(message));
        }
    })
}
