//! A kinematic body: a solid that moves as it is led, by poses that users send or by keyframes, and gives way to nothing.
//!
//! In: a [`RigidSpec`] with [`super::Led`], poses ([`StepContext::pose`]). Out: its motion, a snapshot. Never here: its
//! contacts and their forces on it ([`Snapshot::contact_wrench`]).
//!
//! A pose is reached within the step in which it is received, whatever the distance: a body in contact sees the
//! velocity that this takes. A body that is led no more goes back to its keyframes as a tool does to its script;
//! without any it stays where it is.

use super::mass_properties::MassDistribution;
use super::{RigidError, RigidSpec};
use crate::trajectory::{Pose as Pace, Script};
use glam::{DQuat, DVec3};
use metachron_contact::member::{
    Attachments, ClusterMember, MaterialPoint, MemberMotion, Pose, Role, SkinPoint, StepEnd,
};
use metachron_contact::solve::Side;
use metachron_contact::{Agent, Input, Inputs, PoseGoal, SetMotion, StepContext, Stepping};
use metachron_core::{
    Anchor, Archive, ArchiveError, Body, Bounds, Inertia, RigidState, SimSpan, SimTime, Snapshot, StepError,
    archive_values, shortest_turn,
};
use metachron_geometry::{CollisionShape, ContactSide, Place, PlacedShape, ShapeKind, ShapePose, SolidShape};
use std::sync::Arc;

/// A solid that moves as it is led.
pub struct KinematicBody {
    form: Arc<CollisionShape>,
    /// Its middle in its own axes, metres: the centre of mass of a homogeneous filling.
    com_local: DVec3,
    radius_m: f64,
    script: Option<Script>,
    may_sleep: bool,
    now: Now,
    /// Velocity of its middle and spin in the step begun, and where that ends.
    led_m_s: DVec3,
    led_rad_s: DVec3,
    to: BodyPose,
    kept: Option<Now>,
}

/// Where its middle is, metres, and its rotation to the world's axes.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
struct BodyPose {
    position: DVec3,
    rotation: DQuat,
}

/// Its state.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
struct Now {
    time: SimTime,
    at: BodyPose,
    /// The velocity of its middle and its spin, in the last step.
    velocity: DVec3,
    spin: DVec3,
    /// Where the user leads it now.
    goal: Option<PoseGoal>,
    at_rest: bool,
}

impl KinematicBody {
    /// Builds the body of `spec`.
    ///
    /// # Errors
    /// [`RigidError`] as for a body that is moved by forces.
    pub fn new(spec: &RigidSpec) -> Result<Self, RigidError> {
        spec.check_numbers()?;
        let com_local = MassDistribution::of_body(spec)?.com;
        let shape = SolidShape::moving(&spec.solid, com_local)?;
        let radius_m = shape.radius_m;
        let RigidSpec { friction, restitution, traits, .. } = *spec;
        let form = CollisionShape { kind: ShapeKind::Solid(shape), friction, restitution, traits };
        let keys = spec.led.as_ref().filter(|led| !led.keyframes.is_empty());
        let script = keys.map(|led| Script::new(&led.keyframes, led.repeat));
        let start = script.as_ref().map(|script| script.at(0.0));
        let (origin, rotation) = start.map_or((spec.position, spec.rotation.normalize()), |at| (at.tip, at.rotation));
        let at = BodyPose { position: origin + rotation * com_local, rotation };
        let (velocity, spin) = (DVec3::ZERO, DVec3::ZERO);
        let now = Now { time: SimTime::ZERO, at, velocity, spin, goal: None, at_rest: false };
        let (led_m_s, led_rad_s) = (velocity, spin);
        let (form, may_sleep) = (Arc::new(form), spec.sleep);
        Ok(Self { form, com_local, radius_m, script, may_sleep, now, led_m_s, led_rad_s, to: at, kept: None })
    }

    /// Where it is led in a step of `h_s` seconds from now.
    fn led_to(&self, h_s: f64) -> BodyPose {
        let Now { time, at, velocity, goal, .. } = self.now;
        let middle =
            |origin: DVec3, rotation: DQuat| BodyPose { position: origin + rotation * self.com_local, rotation };
        if let Some(goal) = goal {
            let PoseGoal { position_m, rotation, .. } = goal.after(h_s);
            return middle(position_m, rotation);
        }
        let Some(script) = &self.script else { return at };
        let [from, to] = [0.0, h_s].map(|later_s| script.at(time.as_secs_f64() + later_s));
        let arm = at.rotation * self.com_local;
        let now = Pace {
            tip: at.position - arm,
            // the mean of a step is no slope: only a body led elsewhere deviates
            velocity: if self.is_on(&from) { from.velocity } else { velocity - self.now.spin.cross(arm) },
            rotation: at.rotation,
            jaw: 0.0,
        };
        let Pace { tip, rotation, .. } = now.returning(&from, &to, h_s);
        middle(tip, rotation)
    }

    /// Whether it is where its script has it.
    fn is_on(&self, script: &Pace) -> bool {
        let BodyPose { position, rotation } = self.now.at;
        let off_m = position - rotation * self.com_local - script.tip;
        off_m.length() < ARRIVED_M && rotation.dot(script.rotation).abs() > 1.0 - SAME_TURN
    }

    /// The velocity of a point of space in the step begun, as if it were the body's, m/s.
    fn led_at(&self, point: DVec3) -> DVec3 {
        self.led_m_s + self.led_rad_s.cross(point - self.now.at.position)
    }
}

/// A body closer than this to its script is on it, metres.
const ARRIVED_M: f64 = 1e-9;
/// Rotations whose dot product is within this of one are the same.
const SAME_TURN: f64 = 1e-14;

impl ClusterMember for KinematicBody {
    fn role(&self) -> Role {
        Role::Kinematic
    }

    fn look(&mut self, context: &StepContext<'_>, _dt_s: f64) {
        (self.now.time, self.now.goal) = (context.time, context.pose);
    }

    fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        let (from, to) = (self.now.at, self.led_to(h_s));
        let inside = to.position.abs().max_element() <= super::spec::REACH_MAX;
        if !(inside && to.position.is_finite() && to.rotation.is_finite()) {
            let what = format!("what leads it moves it to {}", to.position);
            return Err(StepError::Diverged { model: "rigid", dt_s: h_s, what });
        }
        self.led_m_s = (to.position - from.position) / h_s;
        self.led_rad_s = shortest_turn(from.rotation, to.rotation) / h_s;
        self.to = to;
        Ok(())
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        let BodyPose { position, rotation } = self.now.at;
        Some(PlacedShape { form: &self.form, view: ShapePose::Solid { position, rotation } })
    }

    fn skin_point(&self, place: &Place, _contact: ContactSide) -> SkinPoint {
        let led_m_s = if let Place::Point(point) = *place { self.led_at(point) } else { DVec3::ZERO };
        SkinPoint { led_m_s, ..Side::FIXED.into() }
    }

    fn keep(&mut self) {
        self.kept = Some(self.now);
    }

    fn go_back(&mut self) {
        self.now = self.kept.unwrap_or(self.now);
    }

    fn end(&mut self, &StepEnd { h_s, .. }: &StepEnd<'_>) -> Result<(), StepError> {
        let Now { time, goal, .. } = self.now;
        self.now = Now {
            time: time + SimSpan::from_secs_f64(h_s).unwrap_or(SimSpan::ZERO),
            at: self.to,
            velocity: self.led_m_s,
            spin: self.led_rad_s,
            goal: goal.map(|goal| goal.after(h_s)),
            at_rest: false,
        };
        Ok(())
    }

    fn can_sleep(&self) -> bool {
        let Now { time, velocity, spin, goal, .. } = self.now;
        let stands = velocity == DVec3::ZERO && spin == DVec3::ZERO;
        let awaits = match (&self.script, goal) {
            (Some(script), None) => !script.is_over(time.as_secs_f64()),
            // a pose ends, and then it goes back
            (Some(_), Some(_)) => true,
            (None, goal) => goal.is_some_and(|goal| !goal.stands()),
        };
        self.may_sleep && stands && !awaits
    }

    fn sleep(&mut self) {
        self.now.at_rest = true;
    }

    fn motion(&self) -> Option<&dyn MemberMotion> {
        Some(self)
    }

    fn attachments(&self) -> Option<&dyn Attachments> {
        Some(self)
    }
}

impl MemberMotion for KinematicBody {
    fn pose(&self, _v: &[DVec3], t_s: f64) -> Option<Pose> {
        let BodyPose { position, rotation } = self.now.at;
        let (led_rad_s, centre_m) = (self.led_rad_s, position + self.led_m_s * t_s);
        let rotation = if t_s > 0.0 { DQuat::from_scaled_axis(led_rad_s * t_s) * rotation } else { rotation };
        let origin_m = centre_m - rotation * self.com_local;
        Some(Pose { centre_m, origin_m, rotation, turns: Side::FIXED, led_rad_s })
    }

    fn speed_bound(&self, _v: &[DVec3]) -> f64 {
        self.led_m_s.length() + self.led_rad_s.length() * self.radius_m
    }
}

impl Attachments for KinematicBody {
    fn anchor(&self, anchor: Anchor) -> Option<MaterialPoint> {
        let Anchor::Local(local) = anchor else { return None };
        let point = self.now.at.position + self.now.at.rotation * local;
        Some(MaterialPoint::led(point, self.led_at(point)))
    }
}

impl Agent for KinematicBody {
    fn model(&self) -> &'static str {
        "rigid"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Cluster(self)
    }

    fn shift_clock(&mut self, by_s: f64) {
        self.script.iter_mut().for_each(|script| script.begin_later(by_s));
    }

    /// Its place alone: its motion follows from its goal or keyframes.
    fn set_motion(&mut self, set: &SetMotion) -> bool {
        let BodyPose { position, rotation } = self.now.at;
        let origin_m = set.position_m.unwrap_or(position - rotation * self.com_local);
        let rotation = set.rotation.map_or(rotation, DQuat::normalize);
        let to = BodyPose { position: origin_m + rotation * self.com_local, rotation };
        if to.position.abs().max_element() > super::spec::REACH_MAX || to == self.now.at {
            return false;
        }
        self.now = Now { at: to, velocity: DVec3::ZERO, spin: DVec3::ZERO, at_rest: false, ..self.now };
        true
    }

    fn inputs(&self) -> Inputs {
        Inputs::of(&[Input::Pose, Input::Place])
    }

    /// Its estimate of its own error is the rounding of its coordinates.
    fn write_snapshot(&self, into: &mut Snapshot) {
        let Now { at: BodyPose { position, rotation }, velocity, spin, at_rest, .. } = self.now;
        into.clear();
        into.resolution = None;
        into.body = Body::Rigid(RigidState { position, rotation, velocity, spin });
        into.inertia = Inertia::Immovable;
        into.energy_j = 0.0;
        into.residual_m = (position.abs().max_element() + self.radius_m) * f64::EPSILON;
        into.at_rest = at_rest;
        into.bounds = Some(Bounds {
            low: position - self.radius_m,
            high: position + self.radius_m,
            speed_m_s: velocity.length() + spin.length() * self.radius_m,
        });
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.now, self.to, self.led_m_s, self.led_rad_s)?;
        self.script.as_mut().map_or(Ok(()), |script| script.archive(archive))
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        Some(self.form.clone())
    }
}
