//! Actuators that a joint can have for its motor: servos of position and of velocity, with the controls that the model starts with, zero without a
//! keyframe.
//!
//! In: `actuator` elements. Out: motors of joints. Never here: actuators of forces (they stay unread, and are listed).

use super::bodies::BodyReader;
use crate::ImportError;
use crate::model::{Joint, Kind, Motor};
use crate::xml::Element;

/// Reads the actuators.
///
/// # Errors
/// For one on a joint that there is none of.
pub(super) fn read(root: &Element, reader: &mut BodyReader<'_>) -> Result<(), ImportError> {
    let all: Vec<&Element> = root.children("actuator").flat_map(Element::all).collect();
    if let Some(key) = &reader.keyframe {
        key.check(all.len())?;
    }
    for (number, element) in all.into_iter().enumerate() {
        if !["position", "velocity"].contains(&element.tag.as_str()) || !element.has("joint") {
            continue;
        }
        let name = element.needed("joint")?;
        let drives = |joint: &Joint| joint.name == name && matches!(joint.kind, Kind::Revolute | Kind::Prismatic);
        let Some(at) = reader.model.joints.iter().position(drives) else {
            return Err(element.wrong(format!("drives `{name}`, and there is no hinge or slide of that name")));
        };
        let damping = match reader.model.joints[at].motor {
            None => 0.0,
            Some(Motor::Damper { velocity: 0.0, damping, max_effort: None }) => damping,
            // a motor is one spring or one brake
            Some(_) => continue,
        };
        reader.model.joints[at].motor = Some(servo(Servo { element: element.read(), number }, reader, at, damping)?);
    }
    Ok(())
}

/// A servo, by its number among actuators.
struct Servo<'a> {
    element: &'a Element,
    number: usize,
}

/// The motor of a servo, with the damping that its joint has.
fn servo(servo: Servo<'_>, reader: &mut BodyReader<'_>, joint: usize, damping: f64) -> Result<Motor, ImportError> {
    let Servo { element, number } = servo;
    let gear = element.list("gear")?.and_then(|all| all.first().copied()).unwrap_or(1.0);
    let limited = match element.text("forcelimited").unwrap_or("auto") {
        "auto" => reader.compiler.auto_limits,
        given => given == "true",
    };
    let force = element.numbers::<2>("forcerange")?.filter(|_| limited);
    let max_effort = force.map(|[least, greatest]| least.abs().max(greatest.abs()) * gear.abs());
    if force.is_some_and(|[least, greatest]| least != -greatest) {
        reader.notes.push(element.note("gives as much either way: `forcerange` is not the same both ways"));
    }
    if max_effort.is_some() && damping > 0.0 {
        reader.notes.push(element.note("bounds the joint's own damping, too: a motor has one greatest effort"));
    }
    let value = |name: &str, default: f64| {
        let value = element.number(name)?.unwrap_or(default);
        if value < 0.0 {
            Err(element.wrong(format!("`{name}` is {value}; expected 0 or more")))
        } else {
            Ok(value * gear * gear)
        }
    };
    // of an actuator, whose length is that of its joint times its gear
    let control = reader.keyframe.as_ref().map_or(0.0, |key| key.control(number));
    let goal = if gear == 0.0 { 0.0 } else { control / gear };
    if element.tag == "velocity" {
        let gain = value("kv", 1.0)?;
        let both = gain + damping;
        let velocity = if both > 0.0 { goal * gain / both } else { 0.0 };
        return Ok(Motor::Damper { velocity, damping: both, max_effort });
    }
    let position = reader.zeros[joint] + goal;
    Ok(Motor::Spring { position, stiffness: value("kp", 1.0)?, damping: value("kv", 0.0)? + damping, max_effort })
}
