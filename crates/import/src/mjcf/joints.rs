//! Joints: where they are, how far they go, what holds them without a motor.
//!
//! In: `joint` and `freejoint` elements. Out: [`Joint`]s. Never here: actuators.

use super::bodies::{BodyReader, Placed};
use crate::ImportError;
use crate::model::{Joint, Kind, Motor, Place};
use crate::pose::Pose;
use crate::xml::Element;
use glam::DVec3;

/// A joint, and where its body starts on it.
pub(super) struct StartedJoint {
    /// `None` where the body is free.
    pub(super) between: Option<Joint>,
    /// The motion of the body from its place in the file to its start.
    pub(super) motion: Pose,
    /// Where the file's zero is from the start, radians or metres.
    pub(super) zero: f64,
}

impl BodyReader<'_> {
    pub(super) fn joint(
        &mut self,
        placed: Placed<'_>,
        parent: Option<usize>,
        child: usize,
    ) -> Result<StartedJoint, ImportError> {
        let Placed { element, frame } = placed;
        let free = StartedJoint { between: None, motion: Pose::IDENTITY, zero: 0.0 };
        let kind = match element.text("type").unwrap_or("hinge") {
            _ if element.tag == "freejoint" => return Ok(free),
            "free" => return Ok(free),
            "hinge" => Kind::Revolute,
            "slide" => Kind::Prismatic,
            "ball" => Kind::Spherical,
            other => {
                return Err(element.wrong(format!("is of the type `{other}`; expected hinge, slide, ball or free")));
            }
        };
        let anchor_m = frame.point(element.numbers("pos")?.map_or(DVec3::ZERO, DVec3::from_array));
        let place = Place { line: element.line, label: element.label.clone() };
        let name = element.text("name").unwrap_or_default().to_owned();
        let joint = Joint { name, place, parent, child, kind, anchor_m, axis: DVec3::Z, range: None, motor: None };
        if kind == Kind::Spherical {
            return Ok(StartedJoint { between: Some(joint), ..free });
        }
        let given = element.numbers("axis")?.map_or(DVec3::Z, DVec3::from_array);
        if given.length() < 1e-9 {
            return Err(element.wrong("`axis` has no direction; expected a vector longer than 0"));
        }
        let unit = if kind == Kind::Revolute { self.compiler.angle_rad } else { 1.0 };
        let at_rest = element.number("ref")?.unwrap_or(0.0) * unit;
        let range = self.range(element)?.map(|range| range.map(|end| end * unit - at_rest));
        let start = range.map_or(0.0, |[least, greatest]| 0.0_f64.clamp(least, greatest));
        if start != 0.0 {
            self.notes.push(element.note("starts at the end of its range that is nearest to its place in the file"));
        }
        let zero = -at_rest - start;
        let axis = frame.rotation * given;
        let motor = passive(element, zero, unit)?;
        let range = range.map(|range| range.map(|end| end - start));
        let motion = kind.motion(anchor_m, axis, start);
        Ok(StartedJoint { between: Some(Joint { axis, range, motor, ..joint }), motion, zero })
    }

    /// The range of a joint in the unit of the file, where it is one.
    fn range(&self, element: &Element) -> Result<Option<[f64; 2]>, ImportError> {
        let Some([least, greatest]) = element.numbers("range")? else { return Ok(None) };
        let limited = match element.text("limited").unwrap_or("auto") {
            "auto" => self.compiler.auto_limits,
            given => given == "true",
        };
        if limited && least > greatest {
            return Err(element.wrong(format!("has the `range` {least} {greatest}; expected the lesser first")));
        }
        Ok(limited.then_some([least, greatest]))
    }
}

/// What holds or brakes a joint by itself: a spring with a damper, a damper, or dry friction where it has neither.
fn passive(element: &Element, zero: f64, unit: f64) -> Result<Option<Motor>, ImportError> {
    let at_least_0 = |name: &str| {
        let value = element.number(name)?.unwrap_or(0.0);
        if value < 0.0 { Err(element.wrong(format!("`{name}` is {value}; expected 0 or more"))) } else { Ok(value) }
    };
    let (stiffness, damping) = (at_least_0("stiffness")?, at_least_0("damping")?);
    if stiffness > 0.0 {
        let position = element.number("springref")?.unwrap_or(0.0) * unit + zero;
        return Ok(Some(Motor::Spring { position, stiffness, damping, max_effort: None }));
    }
    if damping > 0.0 {
        return Ok(Some(Motor::Damper { damping, max_effort: None }));
    }
    let friction = at_least_0("frictionloss")?;
    Ok((friction > 0.0).then_some(Motor::Brake { max_effort: friction }))
}
