//! Coordinates of joints: how far and how fast hinges and slides have moved, read, set and reset (`qpos` and `qvel` of MuJoCo).
//!
//! In: the newest states, and coordinates. Out: commands that move all bodies that the joints carry along, by forward
//! kinematics from the root of a tree of joints: the world, a kinematic body, or else its body of the lowest number.
//! Never here: forces, and how a joint is held in a step.

use super::sensors::{JointRef, centre_of_mass};
use crate::description::kinds::ExecutorKind;
use crate::error::WorldError;
use crate::world::World;
use glam::{DQuat, DVec3};
use metachron_contact::joint::{JOINT_GAP_MAX_M, Joint, JointKind, Mimic};
use metachron_contact::member::Pose;
use metachron_contact::{Input, SetMotion};
use metachron_core::{AgentId, AttachmentEventKind, AttachmentId, Body, shortest_turn};
use metachron_runtime::{AwaitedMotion, Command};
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// The largest turn by which coordinates may leave a loop open, radians: as far as [`JOINT_GAP_MAX_M`] at a metre.
const JOINT_GAP_MAX_RAD: f64 = JOINT_GAP_MAX_M;

/// How far a hinge or a slide has moved, and how fast it does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointState {
    /// The joint.
    pub joint: JointRef,
    /// How far its second body has moved from the first, from the joint's zero: rad, within −π … π, or m.
    pub position: f64,
    /// How fast, rad/s or m/s.
    pub velocity: f64,
}

/// The axes of a body's shape: where they are and how they move, in the world or beside another body.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Frame {
    origin_m: DVec3,
    rotation: DQuat,
    /// Of the matter in the origin.
    velocity_m_s: DVec3,
    spin_rad_s: DVec3,
}

impl Frame {
    /// This frame, which is beside `base`, in the axes that `base` is in.
    fn from(self, base: Self) -> Self {
        let arm_m = base.rotation * self.origin_m;
        Self {
            origin_m: base.origin_m + arm_m,
            rotation: (base.rotation * self.rotation).normalize(),
            velocity_m_s: base.velocity_m_s + base.spin_rad_s.cross(arm_m) + base.rotation * self.velocity_m_s,
            spin_rad_s: base.spin_rad_s + base.rotation * self.spin_rad_s,
        }
    }

    /// The world beside this frame: `self.inverse().from(self)` is the identity at rest.
    fn inverse(self) -> Self {
        let back = self.rotation.conjugate();
        Self {
            origin_m: back * -self.origin_m,
            rotation: back,
            velocity_m_s: back * (self.spin_rad_s.cross(self.origin_m) - self.velocity_m_s),
            spin_rad_s: back * -self.spin_rad_s,
        }
    }

    /// This frame beside another one in the same axes.
    fn beside(self, base: Self) -> Self {
        self.from(base.inverse())
    }

    fn pose(self) -> Pose {
        Pose { origin_m: self.origin_m, centre_m: self.origin_m, rotation: self.rotation, ..Pose::WORLD }
    }
}

/// A rigid body of a tree of joints.
#[derive(Debug, Clone, Copy)]
struct TreeBody {
    frame: Frame,
    /// The centre of mass in its axes, metres.
    com_m: DVec3,
    /// Whether users lead it, so that joints do not.
    is_led: bool,
}

/// How far and how fast a joint is to have moved.
#[derive(Debug, Clone, Copy)]
struct Coordinate {
    position: f64,
    velocity: f64,
}

/// All bodies that joints hold, and these joints.
struct JointTree<'a> {
    bodies: BTreeMap<AgentId, TreeBody>,
    joints: BTreeMap<u32, &'a Joint>,
}

/// The place of a body after some coordinates were set, and whether they have moved it.
#[derive(Debug, Clone, Copy)]
struct Reached {
    frame: Frame,
    is_moved: bool,
}

/// Bodies that were reached from the roots, and joints that closed a loop on the way. `None` is the world.
#[derive(Default)]
struct Walk {
    reached: BTreeMap<Option<AgentId>, Reached>,
    used: BTreeSet<u32>,
    closing: Vec<u32>,
}

impl World {
    /// The coordinate of a hinge or a slide: of the newest states, or as it was set since.
    ///
    /// # Errors
    /// [`WorldError::NoCoordinate`] for a joint of another kind; [`WorldError::Foreign`] and [`WorldError::Gone`].
    pub fn joint_state(&self, joint: JointRef) -> Result<JointState, WorldError> {
        let spec = self.joint_with_coordinate(joint)?;
        let a = self.tree_body(spec.a)?;
        let b = spec.b.map(|b| self.tree_body(b)).transpose()?;
        let (a, b) = (a.frame, b.map_or_else(Frame::default, |b| b.frame));
        let beside = b.beside(a);
        let velocity = match spec.kind {
            JointKind::Revolute { axis, .. } => beside.spin_rad_s.dot(axis.normalize()),
            JointKind::Prismatic { axis, .. } => {
                let anchor_m = beside.rotation * spec.anchor_b_m;
                (beside.velocity_m_s + beside.spin_rad_s.cross(anchor_m)).dot(axis.normalize())
            }
            _ => return Err(WorldError::NoCoordinate { joint: self.joint_name(joint.number()) }),
        };
        Ok(JointState { joint, position: spec.travel(&a.pose(), &b.pose()), velocity })
    }

    /// The coordinates of all hinges and slides whose bodies are there, in the order of the scene.
    ///
    /// # Errors
    /// The errors of [`Self::joint_state`].
    pub fn joint_states(&self) -> Result<Vec<JointState>, WorldError> {
        let all = self.joints().filter(|listed| listed.joint.takes_motor());
        // a joint of a body that was removed holds nothing
        let is_there = |id: AgentId| self.agent(self.tag().object(id)).is_ok();
        let all = all.filter(|listed| is_there(listed.joint.a) && listed.joint.b.is_none_or(is_there));
        all.map(|listed| self.joint_state(listed.at)).collect()
    }

    /// Puts joints to coordinates before the next step, and with them all bodies that they carry. The root of a tree of
    /// joints stays: the world, a kinematic body, or of a tree that nothing holds its body of the lowest number. Joints
    /// that are not named keep their places and rates, also spherical and fixed ones; torn ones, springs and ropes
    /// carry nothing. A joint that follows another one goes along with it. Joints of a loop are set together, all but one, to
    /// coordinates that close it within 1 mm and 1 mrad; the next step brings their rates together.
    ///
    /// # Errors
    /// [`WorldError::BadCoordinate`] for a coordinate that is outside the joint's range by more than 1 mm or 1 mrad, or
    /// not finite, [`WorldError::NoCoordinate`], [`WorldError::OpenLoop`]; [`WorldError::TimePasses`] on threads and in
    /// a pool while time is not paused; the errors of [`World::command`]. Nothing was done then.
    pub fn set_joint_states(&self, states: &[JointState]) -> Result<(), WorldError> {
        let mut set = BTreeMap::new();
        for JointState { joint, position, velocity } in states.iter().copied() {
            self.check_coordinate(joint, position, velocity)?;
            set.insert(joint.number(), Coordinate { position, velocity });
        }
        self.set_followers(&mut set)?;
        self.put_joints(&set)
    }

    /// Puts all joints back to where the scene has them at the start, at rest: hinges, slides, spherical and fixed
    /// ones. The root of a tree of joints stays where it is.
    ///
    /// # Errors
    /// [`WorldError::TimePasses`], and the errors of [`World::command`].
    pub fn reset_joints(&self) -> Result<(), WorldError> {
        let starts = (0..).zip(&self.instruments().starts);
        self.put_joints(&starts.map(|(joint, start)| (joint, Coordinate { position: *start, velocity: 0.0 })).collect())
    }

    fn joint_with_coordinate(&self, joint: JointRef) -> Result<&Joint, WorldError> {
        self.agent(joint.body())?;
        let spec = self.joint_at(joint.number())?;
        let none = || WorldError::NoCoordinate { joint: self.joint_name(joint.number()) };
        spec.takes_motor().then_some(spec).ok_or_else(none)
    }

    fn check_coordinate(&self, joint: JointRef, position: f64, velocity: f64) -> Result<(), WorldError> {
        let spec = self.joint_with_coordinate(joint)?;
        let bad = |what, value, wanted: String| {
            Err(WorldError::BadCoordinate { joint: self.joint_name(joint.number()), what, value, wanted })
        };
        let (range, unit, gap) = match spec.kind {
            JointKind::Revolute { range_rad, .. } => (range_rad, "rad", JOINT_GAP_MAX_RAD),
            JointKind::Prismatic { range_m, .. } => (range_m, "m", JOINT_GAP_MAX_M),
            _ => (None, "", 0.0),
        };
        if !velocity.is_finite() {
            return bad("velocity", velocity, "a finite number".to_owned());
        }
        match range {
            // a body that leans on a stop is a little beyond it
            Some([low, high]) if !(low - gap..=high + gap).contains(&position) => {
                bad("position", position, format!("{low} to {high} {unit}"))
            }
            None if !position.is_finite() => bad("position", position, "a finite number".to_owned()),
            _ => Ok(()),
        }
    }

    /// Sets the joints that follow those that are set, and checks those that are set themselves.
    fn set_followers(&self, set: &mut BTreeMap<u32, Coordinate>) -> Result<(), WorldError> {
        let joints: Vec<_> = self.joints().filter_map(|listed| Some((listed.at, listed.joint.mimic?))).collect();
        let led = |set: &BTreeMap<u32, Coordinate>, mimic: &Mimic| {
            let Coordinate { position, velocity } = *set.get(&mimic.joint)?;
            Some(Coordinate { position: mimic.ratio * position + mimic.offset, velocity: mimic.ratio * velocity })
        };
        // a joint may follow one that follows another
        while let Some((at, coordinate)) = joints
            .iter()
            .filter(|(at, _)| !set.contains_key(&at.number()))
            .find_map(|(at, mimic)| Some((*at, led(set, mimic)?)))
        {
            self.check_coordinate(at, coordinate.position, coordinate.velocity)?;
            set.insert(at.number(), coordinate);
        }
        for (at, mimic) in &joints {
            let Some(found) = set.get(&at.number()) else { continue };
            let leads = self.joints().nth(mimic.joint as usize);
            let Some(leads) = leads else { continue };
            let led_by = match set.get(&mimic.joint) {
                Some(leads) => leads.position,
                None => self.joint_state(leads.at)?.position,
            };
            let travels = mimic.together([self.joint_with_coordinate(*at)?, leads.joint], [found.position, led_by]);
            if mimic.gap(travels).abs() > JOINT_GAP_MAX_M {
                let wanted = mimic.ratio * led_by + mimic.offset;
                let wanted = format!("{wanted}, as it follows joint {}", self.joint_name(mimic.joint));
                let (joint, value) = (self.joint_name(at.number()), found.position);
                return Err(WorldError::BadCoordinate { joint, what: "position", value, wanted });
            }
        }
        Ok(())
    }

    /// Moves the bodies that joints with these coordinates carry.
    fn put_joints(&self, set: &BTreeMap<u32, Coordinate>) -> Result<(), WorldError> {
        if self.executor() != ExecutorKind::Lockstep && self.timeline().runs_at(self.now()) {
            return Err(WorldError::TimePasses);
        }
        let tree = self.joint_tree()?;
        let walk = tree.walk(set);
        for number in &walk.closing {
            let joint = tree.joints[number];
            let ends = [Some(joint.a), joint.b].map(|end| walk.reached[&end]);
            if set.contains_key(number) || ends.iter().any(|end| end.is_moved) {
                self.check_closed(*number, joint, ends.map(|end| end.frame), set.get(number))?;
            }
        }
        let moves: Vec<_> = walk
            .reached
            .iter()
            .filter_map(|(id, reached)| Some(((*id)?, reached)).filter(|(_, reached)| reached.is_moved))
            .map(|(id, reached)| (id, tree.bodies[&id].motion_to(reached.frame)))
            .collect();
        for (id, motion) in &moves {
            Command::SetMotion(*motion).check().map_err(|error| self.refused(*id, &error.to_string()))?;
        }
        moves.into_iter().try_for_each(|(id, motion)| self.command(self.object_of(id)?, Command::SetMotion(motion)))
    }

    fn refused(&self, id: AgentId, reason: &str) -> WorldError {
        let name = self.agents().of(id).map_or_else(String::new, |agent| agent.name().to_owned());
        WorldError::Refused { name, reason: reason.to_owned() }
    }

    /// Checks that a joint which closes a loop holds where its two bodies have come to; one that is not set follows them.
    fn check_closed(
        &self,
        number: u32,
        joint: &Joint,
        ends: [Frame; 2],
        set: Option<&Coordinate>,
    ) -> Result<(), WorldError> {
        let [a, b] = ends;
        let position = set.map_or_else(|| joint.travel(&a.pose(), &b.pose()), |set| set.position);
        let (found, wanted) = (b.beside(a), b_beside_a(joint, Coordinate { position, velocity: 0.0 }));
        let anchor_m = |frame: Frame| frame.origin_m + frame.rotation * joint.anchor_b_m;
        let apart_m = anchor_m(found).distance(anchor_m(wanted));
        let turns = matches!(joint.kind, JointKind::Spherical);
        let apart_rad = if turns { 0.0 } else { shortest_turn(found.rotation, wanted.rotation).length() };
        if apart_m <= JOINT_GAP_MAX_M && apart_rad <= JOINT_GAP_MAX_RAD {
            return Ok(());
        }
        Err(WorldError::OpenLoop { joint: self.joint_name(number), apart: format!("{apart_m} m and {apart_rad} rad") })
    }

    /// All bodies that joints hold now.
    fn joint_tree(&self) -> Result<JointTree<'_>, WorldError> {
        let mut tree = JointTree { bodies: BTreeMap::new(), joints: BTreeMap::new() };
        let mut torn = Vec::new();
        for listed in self.joints() {
            for id in [Some(listed.joint.a), listed.joint.b].into_iter().flatten() {
                // a joint of a body that was removed holds nothing
                if tree.bodies.contains_key(&id) || self.agent(self.tag().object(id)).is_err() {
                    continue;
                }
                tree.bodies.insert(id, self.tree_body(id)?);
                let events = &self.latest(self.tag().object(id))?.events;
                torn.extend(
                    events.iter().filter(|event| event.kind == AttachmentEventKind::Tore).map(|event| event.attachment),
                );
            }
        }
        for listed in self.joints() {
            let (joint, number) = (listed.joint, listed.at.number());
            let is_there = |id: AgentId| tree.bodies.contains_key(&id);
            let holds = !matches!(joint.kind, JointKind::Spring { .. } | JointKind::Rope { .. });
            let is_whole = !torn.contains(&AttachmentId::Joint(number));
            if holds && is_whole && is_there(joint.a) && joint.b.is_none_or(is_there) {
                tree.joints.insert(number, joint);
            }
        }
        Ok(tree)
    }

    /// A body as its newest state has it, with its waiting commands.
    fn tree_body(&self, id: AgentId) -> Result<TreeBody, WorldError> {
        let object = self.tag().object(id);
        let agent = self.agent(object)?;
        let AwaitedMotion { state, motion } = agent.awaited_motion();
        let com_m = centre_of_mass(agent);
        let body = state.map_or_else(|| self.latest(object).map(|state| state.body.clone()), Ok)?;
        let Body::Rigid(rigid) = body else {
            return Err(self.refused(id, "only rigid bodies have joints"));
        };
        let rotation = motion.rotation.unwrap_or(rigid.rotation).normalize();
        let spin_rad_s = motion.spin_rad_s.unwrap_or(rigid.spin);
        let arm_m = rotation * com_m;
        let frame = Frame {
            origin_m: motion.position_m.unwrap_or(rigid.position - rigid.rotation * com_m),
            rotation,
            velocity_m_s: motion.velocity_m_s.unwrap_or(rigid.velocity) - spin_rad_s.cross(arm_m),
            spin_rad_s,
        };
        Ok(TreeBody { frame, com_m, is_led: agent.inputs().has(Input::Pose) })
    }
}

impl TreeBody {
    /// The command that takes it there.
    fn motion_to(&self, frame: Frame) -> SetMotion {
        let Frame { origin_m, rotation, velocity_m_s, spin_rad_s } = frame;
        SetMotion {
            position_m: Some(origin_m),
            rotation: Some(rotation),
            velocity_m_s: Some(velocity_m_s + spin_rad_s.cross(rotation * self.com_m)),
            spin_rad_s: Some(spin_rad_s),
        }
    }
}

impl JointTree<'_> {
    /// Goes from the root of each tree to its ends.
    fn walk(&self, set: &BTreeMap<u32, Coordinate>) -> Walk {
        let mut walk = Walk::default();
        let led = self.bodies.iter().filter(|(_, body)| body.is_led).map(|(id, _)| Some(*id));
        let held: Vec<_> = led.chain([None]).collect();
        let mut incident: BTreeMap<Option<AgentId>, Vec<u32>> = BTreeMap::new();
        for (number, joint) in &self.joints {
            [Some(joint.a), joint.b].into_iter().for_each(|end| incident.entry(end).or_default().push(*number));
        }
        let free = self.bodies.keys().map(|id| vec![Some(*id)]);
        for roots in [held].into_iter().chain(free) {
            let mut queue: VecDeque<_> = roots.into_iter().filter(|root| !walk.reached.contains_key(root)).collect();
            for root in &queue {
                walk.reached.insert(*root, Reached { frame: self.frame(*root), is_moved: false });
            }
            while let Some(base) = queue.pop_front() {
                for number in incident.get(&base).into_iter().flatten() {
                    queue.extend(self.follow(*number, base, set, &mut walk));
                }
            }
        }
        walk
    }

    /// Goes over a joint from `base` to the body at its other end, unless it was gone over, or closes a loop.
    fn follow(
        &self,
        number: u32,
        base: Option<AgentId>,
        set: &BTreeMap<u32, Coordinate>,
        walk: &mut Walk,
    ) -> Option<Option<AgentId>> {
        if !walk.used.insert(number) {
            return None;
        }
        let joint = self.joints[&number];
        let (from_a, other) = if base == Some(joint.a) { (true, joint.b) } else { (false, Some(joint.a)) };
        if walk.reached.contains_key(&other) {
            walk.closing.push(number);
            return None;
        }
        let beside = self.beside(number, set);
        let Reached { frame, is_moved } = walk.reached[&base];
        let frame = if from_a { beside } else { beside.inverse() }.from(frame);
        walk.reached.insert(other, Reached { frame, is_moved: is_moved || set.contains_key(&number) });
        Some(other)
    }

    fn frame(&self, body: Option<AgentId>) -> Frame {
        body.map_or_else(Frame::default, |id| self.bodies[&id].frame)
    }

    /// Where b of a joint is to be beside a: as set, or as it is.
    fn beside(&self, number: u32, set: &BTreeMap<u32, Coordinate>) -> Frame {
        let joint = self.joints[&number];
        match set.get(&number) {
            Some(coordinate) => b_beside_a(joint, *coordinate),
            None => self.frame(joint.b).beside(self.frame(Some(joint.a))),
        }
    }
}

/// Where b is beside a where the joint has this coordinate; a joint without one at its zero.
fn b_beside_a(joint: &Joint, Coordinate { position, velocity }: Coordinate) -> Frame {
    let (mut turn, mut slid_m, mut velocity_m_s, mut spin_rad_s) =
        (DQuat::IDENTITY, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    match joint.kind {
        JointKind::Revolute { axis, .. } => {
            let axis = axis.normalize();
            (turn, spin_rad_s) = (DQuat::from_axis_angle(axis, position), axis * velocity);
        }
        JointKind::Prismatic { axis, .. } => {
            let axis = axis.normalize();
            (slid_m, velocity_m_s) = (axis * position, axis * velocity);
        }
        _ => {}
    }
    let rotation = (turn * joint.rest).normalize();
    let arm_m = rotation * joint.anchor_b_m;
    let origin_m = joint.anchor_a_m + slid_m - arm_m;
    Frame { origin_m, rotation, velocity_m_s: velocity_m_s - spin_rad_s.cross(arm_m), spin_rad_s }
}
