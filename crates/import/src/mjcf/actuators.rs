//! Actuators that a joint can have for its motor: servos of position and of velocity, with controls at zero, where a model starts.
//!
//! In: `actuator` elements. Out: motors of joints. Never here: actuators that need a control (they stay unread, and are listed).

use super::bodies::BodyReader;
use crate::ImportError;
use crate::model::{Joint, Kind, Motor};
use crate::xml::Element;

/// Reads the actuators.
///
/// # Errors
/// For one on a joint that there is none of.
pub(super) fn read(root: &Element, reader: &mut BodyReader<'_>) -> Result<(), ImportError> {
    let all = root.children("actuator").flat_map(Element::all);
    for element in
        all.filter(|element| ["position", "velocity"].contains(&element.tag.as_str()) && element.has("joint"))
    {
        let name = element.needed("joint")?;
        let drives = |joint: &Joint| joint.name == name && matches!(joint.kind, Kind::Revolute | Kind::Prismatic);
        let Some(at) = reader.model.joints.iter().position(drives) else {
            return Err(element.wrong(format!("drives `{name}`, and there is no hinge or slide of that name")));
        };
        let damping = match reader.model.joints[at].motor {
            None => 0.0,
            Some(Motor::Damper { damping, max_effort: None }) => damping,
            // a motor is one spring or one brake
            Some(_) => continue,
        };
        reader.model.joints[at].motor = Some(servo(element.read(), reader, at, damping)?);
    }
    Ok(())
}

/// A servo, with the damping that its joint has.
fn servo(element: &Element, reader: &mut BodyReader<'_>, joint: usize, damping: f64) -> Result<Motor, ImportError> {
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
    if element.tag == "velocity" {
        return Ok(Motor::Damper { damping: value("kv", 1.0)? + damping, max_effort });
    }
    let position = reader.zeros[joint];
    Ok(Motor::Spring { position, stiffness: value("kp", 1.0)?, damping: value("kv", 0.0)? + damping, max_effort })
}
