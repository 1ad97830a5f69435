//! Reads the joints of a scene file: the objects at both ends, the anchors, and whether the joint can hold there.
//!
//! In: [`JointFile`]s and the objects of the scene. Out: [`Joint`]s that can hold from the first step on, problems to the
//! [`Checker`]. Never here: solving joints.

use super::common::point;
use super::force_limits::ForceLimits;
use super::joint_keys::{check_keys, followed, free_motion};
use super::joint_rules::{PlacedJoint, check_start, contradictions, tie_mimics};
use super::objects::{NamedObject, Objects};
use crate::check::{Checker, Place};
use crate::format::{JointFile, JointKind as Kind};
use glam::{DQuat, DVec3};
use metachron_core::AgentId;
use metachron_models::rigid::{Joint, JointKind, Mimic};
use metachron_world::Spec;

/// The name of the world in joints: no object may have it.
pub(super) const WORLD: &str = "world";

/// One end of a joint, and its pose at the start.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    /// `None` is the world.
    pub(super) agent: Option<AgentId>,
    /// Whether no force moves it.
    pub(super) is_led: bool,
    pub(super) position: DVec3,
    pub(super) rotation: DQuat,
}

impl End {
    pub(super) fn to_world(self, local: DVec3) -> DVec3 {
        self.position + self.rotation * local
    }

    fn to_local(self, world: DVec3) -> DVec3 {
        self.rotation.conjugate() * (world - self.position)
    }
}

/// One end of a joint with its anchor in world coordinates, metres.
#[derive(Debug, Clone, Copy)]
struct Anchored {
    end: End,
    anchor: DVec3,
}

/// The joints of the scene.
pub(crate) fn joints(c: &mut Checker<'_, '_>, files: &[JointFile], objects: &Objects) -> Vec<Joint> {
    let mut placed: Vec<PlacedJoint> = (0..files.len()).filter_map(|at| place_joint(c, at, files, objects)).collect();
    contradictions(c, &placed);
    // a scene with a joint that cannot be is none
    if placed.len() == files.len() {
        tie_mimics(c, &mut placed);
    }
    placed.into_iter().filter_map(PlacedJoint::joint).collect()
}

/// Reads one joint and checks that it can hold at the start.
fn place_joint(c: &mut Checker<'_, '_>, index: usize, files: &[JointFile], objects: &Objects) -> Option<PlacedJoint> {
    let (file, place) = (&files[index], c.place(&format!("joint.{index}")));
    let before = c.count();
    let is_complete = check_keys(c, &place, file);
    let (a, b) = (end(c, &place, "a", &file.a, objects), end(c, &place, "b", &file.b, objects));
    let (a, b) = (a?, b?);
    if a.agent == b.agent || a.is_led && b.is_led {
        let (what, expected) = if a.agent == b.agent && a.agent.is_some() {
            ("is the same object as `a`", "expected another object: a joint connects two")
        } else if a.agent.or(b.agent).is_some() {
            (
                "is moved by no force, and neither is `a`",
                "expected at least one object that is neither fixed nor kinematic",
            )
        } else {
            ("is fixed, and so is `a`", "expected at least one object that moves")
        };
        c.wrong(&place, "b", what, expected);
        return None;
    }
    let from = a.to_world(point(file.at_a_m));
    let to = other_anchor(c, &place, file, b, from)?;
    let free = if is_complete { free_motion(c, &place, file, from.distance(to)) } else { None };
    let limits = ForceLimits::read(c, &place, [file.tears_above_n, file.yields_above_n]);
    let ratio = file.mimic.as_ref().and_then(|mimic| mimic.ratio).unwrap_or(1.0);
    let mimic = followed(c, &place, index, files).map(|joint| Mimic { joint, ratio, offset: 0.0 });
    if c.count() > before {
        return None;
    }
    let (ends, anchors, free_motion, collide) = ([a, b], [from, to], free?, collide(file));
    // the keys of other kinds are refused
    let friction = file.friction_n_m.or(file.friction_n).unwrap_or(0.0);
    let armature = file.armature_kg_m2.or(file.armature_kg).unwrap_or(0.0);
    let placed = PlacedJoint { place, ends, anchors, free_motion, collide, limits, friction, armature, mimic };
    check_start(c, &placed).then_some(placed)
}

/// One end of a joint: a rigid object, the world, or a fixed object, which becomes a pose in the world.
fn end(c: &mut Checker<'_, '_>, place: &Place, key: &str, name: &str, objects: &Objects) -> Option<End> {
    if name == WORLD {
        if key == "a" {
            c.wrong(place, key, "is the world", "expected a rigid object; the world is written as `b`");
            return None;
        }
        return Some(End { agent: None, is_led: true, position: DVec3::ZERO, rotation: DQuat::IDENTITY });
    }
    let wrong = |c: &mut Checker<'_, '_>, what: &str, expected: &str| {
        c.wrong(place, key, format_args!("names `{name}`, {what}"), expected);
        None
    };
    match objects.names.get(name) {
        Some(NamedObject::Rigid(id)) => {
            let member = objects.agents.iter().find(|member| member.id == id)?;
            let Spec::Rigid(body) = &member.spec else { return None };
            let is_led = body.led.is_some();
            Some(End { agent: Some(id), is_led, position: body.position, rotation: body.rotation.normalize() })
        }
        Some(NamedObject::Fixed) => {
            let solid = objects.obstacles.iter().find(|obstacle| obstacle.name == name)?;
            Some(End { agent: None, is_led: true, position: solid.position, rotation: solid.rotation.normalize() })
        }
        Some(NamedObject::Tube(_)) => wrong(
            c,
            "which is a tube",
            "expected a rigid object; a tube is held by a `[[coupling]]` of `kind = \"attach\"`, or by its own `clamp` and `pin`",
        ),
        Some(NamedObject::Soft(_)) => wrong(
            c,
            "which is soft",
            "expected a rigid object; a sheet, solid or rope is held by a `[[coupling]]` of `kind = \"attach\"`, or by its own `hold`",
        ),
        Some(NamedObject::Tool(_)) => wrong(
            c,
            "which is a tool",
            "expected a rigid object; a tool holds by its jaws, or by a `[[coupling]]` of `kind = \"attach\"`",
        ),
        Some(NamedObject::Synthetic(_)) => {
            wrong(c, "which is a synthetic agent without a body", "expected a rigid object")
        }
        Some(NamedObject::Scenery) => wrong(c, "which is scenery and only drawn", "expected a rigid object"),
        None => {
            let joinable = |named| matches!(named, NamedObject::Rigid(_) | NamedObject::Fixed);
            c.reference(place, key, name, objects.names.only(joinable));
            None
        }
    }
}

/// The anchor on `b`, in the world: `at_b_m` if given; else the anchor on `a`, or for springs and ropes the origin of `b`.
fn other_anchor(c: &mut Checker<'_, '_>, place: &Place, file: &JointFile, b: End, from: DVec3) -> Option<DVec3> {
    match (file.at_b_m, file.kind) {
        (Some(at), _) => Some(b.to_world(at.into())),
        (None, Kind::Spring | Kind::Rope) if b.agent.is_none() && file.b == WORLD => {
            let expected = format!("expected the other end of the {} in the world, metres", c.written(place, "kind"));
            c.wrong(place, "at_b_m", "is missing", expected);
            None
        }
        (None, Kind::Spring | Kind::Rope) => Some(b.position),
        (None, _) => Some(from),
    }
}

fn collide(file: &JointFile) -> bool {
    file.collide.unwrap_or(matches!(file.kind, Kind::Spring | Kind::Rope))
}

impl PlacedJoint {
    /// The joint with an agent as `a`. Where `a` is fixed in the file, the ends are swapped and the axis is reversed: b's motion relative
    /// to a about `axis` is a's relative to b about the opposite axis.
    fn joint(self) -> Option<Joint> {
        let Self { ends: [a, b], anchors: [from, to], .. } = self;
        let (a, b) = (Anchored { end: a, anchor: from }, Anchored { end: b, anchor: to });
        match (a.end.agent, b.end.agent) {
            (Some(id), _) => Some(self.between(id, a, b, 1.0)),
            (None, Some(id)) => Some(self.between(id, b, a, -1.0)),
            (None, None) => None,
        }
    }

    /// The joint of the agent `id`, which is at `a`; `sign` is that of the axis.
    fn between(&self, id: AgentId, a: Anchored, b: Anchored, sign: f64) -> Joint {
        let (Anchored { end: a, anchor: from }, Anchored { end: b, anchor: to }) = (a, b);
        let mut kind = self.free_motion;
        if let JointKind::Revolute { axis, .. } | JointKind::Prismatic { axis, .. } = &mut kind {
            *axis = a.rotation.conjugate() * self.axis() * sign;
        }
        // a joint to the world is given in the world's axes
        let (anchor_b_m, rotation_b) = match b.agent {
            Some(_) => (b.to_local(to), b.rotation),
            None => (to, DQuat::IDENTITY),
        };
        let rest = (a.rotation.conjugate() * rotation_b).normalize();
        let Self { collide, limits: ForceLimits { tears_above_n, yields_above_n }, friction, armature, mimic, .. } =
            *self;
        let anchor_a_m = a.to_local(from);
        let limited = Joint { collide, tears_above_n, yields_above_n, ..Joint::new(id, b.agent, kind) };
        Joint { anchor_a_m, anchor_b_m, rest, friction, armature, mimic, ..limited }
    }
}
