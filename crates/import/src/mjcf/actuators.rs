//! Actuators that a joint can have for its motor: servos of position and of velocity, with the controls that the model starts with, zero without a
//! keyframe.
//!
//! In: `actuator` elements. Out: motors of joints. Never here: actuators of forces (they are listed).

use super::bodies::BodyReader;
use crate::imported::ImportError;
use crate::model::Motor;
use crate::xml::{DAMPING_MAX, Element, STRENGTH_MAX};

/// Reads the actuators. Actuators of forces give none without a command, and programs command joints themselves.
///
/// # Errors
/// For one on a joint that there is none of.
pub(super) fn read(root: &Element, reader: &mut BodyReader<'_>) -> Result<(), ImportError> {
    let all: Vec<&Element> = root.children("actuator").flat_map(Element::all).collect();
    if let Some(key) = &reader.keyframe {
        key.check(all.len())?;
    }
    for (number, element) in all.into_iter().enumerate() {
        let Some(law) = Law::of(element)?.filter(|_| element.has("joint")) else {
            let is_force = ["motor", "general", "adhesion"].contains(&element.tag.as_str());
            let acts = command(element, number, reader)? != 0.0 || !is_force || element.has("biastype");
            element.read_all_within();
            reader.notes.push(match acts {
                true => {
                    element.note("is left out: it acts without a program, too, and scenes have servos of joints alone")
                }
                false => element.note("is left out: it gives what a program commands").harmless(),
            });
            continue;
        };
        let name = element.needed("joint")?;
        let Some(at) = reader.travelling.get(name).copied() else {
            return Err(element.wrong(format!("drives `{name}`, and there is no hinge or slide of that name")));
        };
        let own = match reader.model.joints[at].motor {
            None => Own::default(),
            Some(Motor::Damper { velocity: 0.0, damping, max_effort: None }) => Own { damping, ..Own::default() },
            Some(Motor::Spring { position, stiffness, damping, max_effort: None }) => {
                Own { position, stiffness, damping }
            }
            Some(_) => {
                element.read_all_within();
                let what = "is left out: a joint of a scene has one motor, and this one has that of another actuator";
                reader.notes.push(element.note(what));
                continue;
            }
        };
        reader.model.joints[at].motor = Some(servo(Servo { element: element.read(), number, law }, reader, at, own)?);
    }
    Ok(())
}

/// The force of a servo: gain · command + bias − stiffness · length − damping · its rate.
#[derive(Clone, Copy)]
struct Law {
    gain: f64,
    bias: f64,
    stiffness: f64,
    damping: f64,
}

impl Law {
    /// That of an actuator; `None` for one that is no servo.
    fn of(element: &Element) -> Result<Option<Self>, ImportError> {
        let gain = |most: f64, name: &str| if element.has(name) { element.up_to(most, name) } else { Ok(1.0) };
        let law = match element.tag.as_str() {
            "position" => {
                let (gain, damping) = (gain(STRENGTH_MAX, "kp")?, element.up_to(DAMPING_MAX, "kv")?);
                Self { gain, bias: 0.0, stiffness: gain, damping }
            }
            "velocity" => {
                let gain = gain(DAMPING_MAX, "kv")?;
                Self { gain, bias: 0.0, stiffness: 0.0, damping: gain }
            }
            "general" if element.text("biastype") == Some("affine") => {
                let first = |name: &str, at: usize| {
                    Ok::<_, ImportError>(element.list(name)?.and_then(|all| all.get(at).copied()).unwrap_or(0.0))
                };
                let gain = element.list("gainprm")?.and_then(|all| all.first().copied()).unwrap_or(1.0);
                let (bias, stiffness, damping) = (first("biasprm", 0)?, -first("biasprm", 1)?, -first("biasprm", 2)?);
                Self { gain, bias, stiffness, damping }
            }
            _ => return Ok(None),
        };
        Ok(Some(law).filter(|law| law.stiffness >= 0.0 && law.damping >= 0.0 && law.stiffness + law.damping > 0.0))
    }
}

/// The spring and the damper that a joint has without actuators.
#[derive(Clone, Copy, Default)]
struct Own {
    position: f64,
    stiffness: f64,
    damping: f64,
}

/// A servo, by its number among actuators.
struct Servo<'a> {
    element: &'a Element,
    number: usize,
    law: Law,
}

/// A range of an actuator that bounds something.
fn range(element: &Element, flag: &str, name: &str, reader: &BodyReader<'_>) -> Result<Option<[f64; 2]>, ImportError> {
    let limited = match element.text(flag).unwrap_or("auto") {
        "auto" => reader.compiler.auto_limits,
        given => given == "true",
    };
    Ok(element.numbers::<2>(name)?.filter(|_| limited))
}

/// The command of an actuator at the start: as in `MuJoCo`, its control within its range, which may not have zero in
/// it.
fn command(element: &Element, number: usize, reader: &mut BodyReader<'_>) -> Result<f64, ImportError> {
    let given = reader.keyframe.as_ref().map_or(0.0, |key| key.control(number));
    let bounds = range(element, "ctrllimited", "ctrlrange", reader)?;
    let command = bounds.map_or(given, |[least, greatest]| given.max(least).min(greatest));
    if command != given {
        let what = format!(
            "is commanded {command} and not {given}, the end of its `ctrlrange`: programs command joints without one"
        );
        reader.notes.push(element.note(what));
    }
    Ok(command)
}

/// The motor of a servo, with the spring and damper that its joint has: of two springs a stiffer one that rests between them.
fn servo(servo: Servo<'_>, reader: &mut BodyReader<'_>, joint: usize, own: Own) -> Result<Motor, ImportError> {
    let Servo { element, number, law } = servo;
    let gear = element.list("gear")?.and_then(|all| all.first().copied()).unwrap_or(1.0);
    let force = range(element, "forcelimited", "forcerange", reader)?;
    let max_effort = force.map(|[least, greatest]| least.abs().max(greatest.abs()) * gear.abs());
    if force.is_some_and(|[least, greatest]| least != -greatest) {
        reader.notes.push(element.note("gives as much either way: `forcerange` is not the same both ways"));
    }
    if max_effort.is_some() && own.damping + own.stiffness > 0.0 {
        reader
            .notes
            .push(element.note("bounds the joint's own spring and damper, too: a motor has one greatest effort"));
    }
    // of an actuator, whose length is that of its joint times its gear
    let command = law.gain * command(element, number, reader)? + law.bias;
    let of_servo = law.stiffness * gear * gear;
    let (stiffness, damping) = (of_servo + own.stiffness, law.damping * gear * gear + own.damping);
    if stiffness > 0.0 {
        let pull = of_servo * reader.zeros[joint] + own.stiffness * own.position + command * gear;
        return Ok(Motor::Spring { position: pull / stiffness, stiffness, damping, max_effort });
    }
    let velocity = if damping > 0.0 { command * gear / damping } else { 0.0 };
    Ok(Motor::Damper { velocity, damping, max_effort })
}
