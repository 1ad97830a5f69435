//! Joints: where they are, how far they go, the springs, dampers and friction that hold them without a motor.
//!
//! In: `joint` and `freejoint` elements. Out: [`Joint`]s. Never here: actuators.

use super::bodies::{BodyReader, Host, Placed};
use super::keyframe::Keyframe;
use crate::imported::ImportError;
use crate::model::{Joint, Kind, Motor};
use crate::pose::Pose;
use crate::xml::{DAMPING_MAX, Element, STRENGTH_MAX};
use glam::DVec3;

/// A joint, and where its body starts on it.
pub(super) struct StartedJoint {
    /// `None` where the body is free.
    pub(super) between: Option<Joint>,
    /// The motion of the body from its place in the file to its start.
    pub(super) motion: Pose,
    /// That to where the joint is at its `springref`.
    pub(super) to_spring: Pose,
    /// Where the file's zero is from the start, radians or metres.
    pub(super) zero: f64,
    /// Where the start is from the pose of the file, likewise.
    pub(super) start: f64,
}

impl StartedJoint {
    /// A joint whose body starts where the file has it.
    pub(super) const fn still(between: Option<Joint>) -> Self {
        Self { between, motion: Pose::IDENTITY, to_spring: Pose::IDENTITY, zero: 0.0, start: 0.0 }
    }
}

impl BodyReader<'_> {
    pub(super) fn joint(&mut self, placed: Placed<'_>, host: Host, child: usize) -> Result<StartedJoint, ImportError> {
        let Placed { element, frame } = placed;
        let parent = host.link;
        element.read_zeros(&["armature", "frictionloss", "margin", "damping", "stiffness"]);
        let kind = match element.text("type").unwrap_or("hinge") {
            free if element.tag == "freejoint" || free == "free" => {
                element.read_all(&[
                    "axis",
                    "pos",
                    "ref",
                    "springref",
                    "range",
                    "limited",
                    "solreflimit",
                    "solimplimit",
                ]);
                return self.free(host);
            }
            "hinge" => Kind::Revolute,
            "slide" => Kind::Prismatic,
            "ball" => Kind::Spherical,
            other => {
                return Err(element.wrong(format!("is of the type `{other}`; expected hinge, slide, ball or free")));
            }
        };
        let anchor_m = frame.point(element.numbers("pos")?.map_or(DVec3::ZERO, DVec3::from_array));
        let place = element.place.clone();
        let name = element.text("name").unwrap_or_default().to_owned();
        let joint = Joint { name, kind, anchor_m, ..Joint::weld(place, parent, child) };
        let [friction, armature] =
            [element.up_to(STRENGTH_MAX, "frictionloss")?, element.up_to(STRENGTH_MAX, "armature")?];
        let joint = Joint { friction, armature, ..joint };
        if kind == Kind::Spherical {
            element.read_all(&["axis", "ref", "springref"]);
            return self.ball(joint);
        }
        let given = element.numbers("axis")?.map_or(DVec3::Z, DVec3::from_array);
        if given.length() < 1e-9 {
            return Err(element.wrong("`axis` has no direction; expected a vector longer than 0"));
        }
        let unit = if kind == Kind::Revolute { self.compiler.angle_rad } else { 1.0 };
        let at_rest = element.number("ref")?.unwrap_or(0.0) * unit;
        let range = self.range(element)?.map(|range| range.map(|end| end * unit - at_rest));
        let key = self.keyframe.as_mut().and_then(Keyframe::next);
        let wanted = key.map_or(0.0, |[position]: [f64; 1]| position - at_rest);
        let start = range.map_or(wanted, |[least, greatest]| wanted.clamp(least, greatest));
        if start != wanted {
            let place = if key.is_some() { "that of the keyframe" } else { "its place in the file" };
            self.notes.push(element.note(format!("starts at the end of its range that is nearest to {place}")));
        }
        let zero = -at_rest - start;
        let axis = frame.rotation * given;
        let spring = element.number("springref")?.unwrap_or(0.0) * unit - at_rest;
        let motor = passive(element, spring - start)?;
        if range.is_none() {
            element.read_all(&["limited", "solreflimit", "solimplimit", "margin"]);
        }
        let range = range.map(|range| range.map(|end| end - start));
        let [motion, to_spring] = [start, spring].map(|travel| kind.motion(anchor_m, axis, travel));
        let between = Some(Joint { axis, range, motor, ..joint });
        Ok(StartedJoint { between, motion, to_spring, zero, start })
    }

    /// A body that moves freely: where the keyframe has it in the world, or else as the file has it.
    fn free(&mut self, host: Host) -> Result<StartedJoint, ImportError> {
        let Some(key) = &mut self.keyframe else { return Ok(StartedJoint::still(None)) };
        let Some([x, y, z, a, b, c, d]) = key.next() else { return Ok(StartedJoint::still(None)) };
        let pose = Pose { position: DVec3::new(x, y, z), rotation: key.rotation([a, b, c, d])? };
        Ok(StartedJoint { motion: host.pose.inverse().then(pose), ..StartedJoint::still(None) })
    }

    /// A ball joint, turned as the keyframe has it.
    fn ball(&mut self, joint: Joint) -> Result<StartedJoint, ImportError> {
        let Some(key) = &mut self.keyframe else { return Ok(StartedJoint::still(Some(joint))) };
        let Some(turned) = key.next() else { return Ok(StartedJoint::still(Some(joint))) };
        let rotation = key.rotation(turned)?;
        let motion = Pose { position: joint.anchor_m - rotation * joint.anchor_m, rotation };
        Ok(StartedJoint { motion, ..StartedJoint::still(Some(joint)) })
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
        Ok((limited && self.compiler.has_limits).then_some([least, greatest]))
    }
}

/// The spring with a damper, or the damper, that holds a joint by itself.
fn passive(element: &Element, position: f64) -> Result<Option<Motor>, ImportError> {
    let (stiffness, damping) = (element.up_to(STRENGTH_MAX, "stiffness")?, element.up_to(DAMPING_MAX, "damping")?);
    if stiffness > 0.0 {
        return Ok(Some(Motor::Spring { position, stiffness, damping, max_effort: None }));
    }
    Ok((damping > 0.0).then_some(Motor::Damper { velocity: 0.0, damping, max_effort: None }))
}
