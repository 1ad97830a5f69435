//! The tool agent: the sequence of one step.
//!
//! In: a span, the user spring, graspable neighbours. Out: a [`ToolState`]. Never here: contact forces.
//!
//! The tip follows a commanded point: the script, or the user spring while one holds the tool. The offset from that target decays
//! like a critically damped spring, solved exactly, so that being taken, released or put off by lost time never makes it jump.
//! In a cluster contact moves the tip off the commanded point as far as the force limit of the drive allows ([`super::drive`]).

use super::drive::Drive;
use super::gripper::{Jaws, nearest, nearest_of};
use super::member::Unknowns;
use super::pivot::Pivot;

use super::{ToolError, ToolSpec};
use crate::trajectory::{PointMotion, Pose, Script};
use glam::{DQuat, DVec3};
use metachron_contact::{Agent, AnchorSpring, Input, Inputs, StepContext, Stepping};
use metachron_core::{
    AgentId, Anchor, Archive, ArchiveError, Body, Bounds, GRASP_BELOW, Snapshot, ToolState, archive_values,
    shortest_turn,
};
use metachron_geometry::ToolShape;
use metachron_geometry::{CollisionShape, ShapeKind};
use std::fmt;
use std::sync::Arc;

/// A driven tool with its own clock.
#[derive(Clone)]
pub struct Tool {
    pub(super) spec: ToolSpec,
    pub(super) script: Script,
    pub(super) pivot: Option<Pivot>,
    pub(super) tool: ToolState,
    /// The commanded point and its velocity: the tip is there if no contact pushes it.
    pub(super) commanded: PointMotion,
    pub(super) drive: Drive,
    /// Distance of the tip from the target of the script or the user spring, metres.
    pub(super) lag_m: f64,
    pub(super) jaws: Jaws,
    pub(super) form: Arc<CollisionShape>,
    /// Speed of its fastest point in the last step, m/s.
    pub(super) speed_m_s: f64,
    pub(super) at_rest: bool,
    /// Its unknowns in a contact cluster.
    pub(super) unknowns: Unknowns,
}

impl fmt::Debug for Tool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Tool").field("tool", &self.tool).field("jaws", &self.jaws).finish_non_exhaustive()
    }
}

/// Coulomb friction coefficient of wet steel.
const FRICTION: f64 = 0.2;

/// Rate at which the tip closes up to a user spring, 1/s: nine tenths of the distance in 65 ms; the tremor of a mouse is filtered out.
const USER_RATE_PER_S: f64 = 60.0;
/// Rate at which jaws open and close where no script sets them, 1/s.
const JAW_RATE_PER_S: f64 = 4.0;
/// Under a user spring, jaws close on a body whose skin is nearer than this share of their reach.
const CATCH_SHARE: f64 = 0.5;
/// A tip closer than this to its script has arrived, metres (and m/s).
const ARRIVED: f64 = 1e-7;
/// A tool on which sleeping bodies rest keeps still below this speed, m/s.
pub(super) const SUPPORTING_MAX_M_S: f64 = 2e-3;

impl Tool {
    /// Builds the tool of `spec`, in its first keyframe or at the given offset from it.
    ///
    /// # Errors
    /// [`ToolError`] for a script without keyframes, times that do not rise, and any number outside its range.
    pub fn new(spec: ToolSpec) -> Result<Self, ToolError> {
        spec.check()?;
        let pivot = spec.pivot();
        let script = match pivot {
            Some(pivot) => Script::new(&pivot.thread(&spec.keyframes), spec.repeat),
            None => Script::new(&spec.keyframes, spec.repeat),
        };
        let Pose { tip, velocity, rotation, jaw } = script.at(0.0);
        let tip = tip + spec.starts_off_m;
        let (tip, rotation) = through(pivot, tip, rotation);
        let spin = DVec3::ZERO;
        let (grasp, admits, force_n, is_idle) = (None, None, 0.0, false);
        let tool = ToolState { tip, led: tip, rotation, velocity, spin, jaw, grasp, admits, force_n, is_idle };
        let form = CollisionShape { traits: spec.traits, ..CollisionShape::new(ShapeKind::Tool(shape()), FRICTION) };
        let form = Arc::new(form);
        let (commanded, drive) = (PointMotion { position: tip, velocity }, Drive::new(spec.max_force_n));
        let unknowns = Unknowns::new(&tool, drive.mass_kg());
        Ok(Self {
            spec,
            script,
            pivot,
            tool,
            commanded,
            drive,
            lag_m: 0.0,
            jaws: Jaws::new(),
            form,
            speed_m_s: 0.0,
            at_rest: false,
            unknowns,
        })
    }

    /// Target of the user spring for the tip.
    pub(super) fn user_target(&self, spring: &AnchorSpring) -> PointMotion {
        let local = if let Anchor::Local(local) = spring.anchor { local } else { DVec3::ZERO };
        let held = PointMotion { position: spring.target, velocity: spring.target_velocity };
        match &self.pivot {
            Some(pivot) => pivot.tip_for(&self.tool, local, held),
            None => PointMotion { position: held.position - self.tool.rotation * local, ..held },
        }
    }

    /// Whether jaws led by a user would close on a body nearby.
    pub(super) fn may_catch(&self, context: &StepContext<'_>) -> bool {
        nearest(&self.spec, self.tool.tip, context).is_some_and(|near| near.gap_m < CATCH_SHARE * self.spec.reach_m)
    }

    /// Follows the user spring: the tip goes to its target, the rotation stays, the jaws close on a body that `is_near`.
    pub(super) fn follow_user_spring(&self, spring: &AnchorSpring, dt: f64, is_near: bool) -> ToolState {
        let target = self.user_target(spring);
        let off = self.commanded.relative_to(target).decayed(USER_RATE_PER_S, dt);
        let tip = target.position + target.velocity * dt + off.position;
        let wanted = if is_near || self.jaws.holds() { 0.0 } else { 1.0 };
        let jaw = self.tool.jaw + (wanted - self.tool.jaw).clamp(-JAW_RATE_PER_S * dt, JAW_RATE_PER_S * dt);
        ToolState { tip, velocity: target.velocity + off.velocity, jaw, ..self.tool }
    }

    /// Follows the script; the offset from it decays.
    pub(super) fn follow_script(&self, from: &Pose, to: &Pose, dt: f64) -> ToolState {
        let jaw_off = self.tool.jaw - from.jaw;
        let jaw = to.jaw + jaw_off - jaw_off.clamp(-JAW_RATE_PER_S * dt, JAW_RATE_PER_S * dt);
        let (_, scripted) = through(self.pivot, self.tool.tip, from.rotation);
        let PointMotion { position: tip, velocity } = self.commanded;
        let now = Pose { tip, velocity, rotation: self.tool.rotation, jaw };
        let Pose { tip, velocity, rotation, .. } = now.returning(&Pose { rotation: scripted, ..*from }, to, dt);
        ToolState { tip, velocity, rotation, jaw: jaw.clamp(0.0, 1.0), ..self.tool }
    }

    /// The agent that open jaws may grasp or have just released: the nearest of the agents that are near them, or may
    /// be within two steps of `dt_s` seconds.
    pub(super) fn open_for(&self, context: &StepContext<'_>, dt_s: f64) -> Option<AgentId> {
        let reach_m = self.spec.reach_m + reach().2 + 2.0 * dt_s * self.speed_m_s;
        let nearest = || nearest_of(&self.spec, self.tool.tip, context, reach_m);
        if self.tool.jaw > GRASP_BELOW { nearest().map(|near| near.target) } else { None }
    }

    /// Whether the commanded point has reached the end of the script: an obstacle that saturates the drive holds it back.
    pub(super) fn has_reached(&self, end: &Pose) -> bool {
        (self.commanded.position - end.tip).length() < ARRIVED && self.commanded.velocity.length() < ARRIVED
    }
}

/// The pose of a tool with its tip as near to `tip` as it reaches, and its shaft through the pivot if it has one.
pub(super) fn through(pivot: Option<Pivot>, tip: DVec3, rotation: DQuat) -> (DVec3, DQuat) {
    let Some(pivot) = pivot else { return (tip, rotation) };
    let tip = pivot.within(tip, rotation);
    (tip, pivot.aligned(rotation, tip))
}

/// The shape of every tool.
pub(super) fn shape() -> ToolShape {
    ToolShape::default()
}

/// The ends of a tool in its own axes, and its sideways extent from the line between them, metres.
pub(super) fn reach() -> (DVec3, DVec3, f64) {
    let ToolShape { shaft_radius_m: r, shaft_length_m } = shape();
    // jaws: 2 radii before the tip and 6 behind it, 4 to the side when they are wide open; clevis and ring, then the shaft
    (DVec3::Z * (2.0 * r), DVec3::NEG_Z * (10.0 * r + shaft_length_m), 5.0 * r)
}

/// The box around a tool whose points move no faster than `speed_m_s`.
fn bounds(tool: &ToolState, speed_m_s: f64) -> Bounds {
    let (front, back, side_m) = reach();
    let (front, back) = (tool.tip + tool.rotation * front, tool.tip + tool.rotation * back);
    Bounds { low: front.min(back) - side_m, high: front.max(back) + side_m, speed_m_s }
}

/// Speed of a tool's fastest point between two states `dt` seconds apart, m/s.
pub(super) fn speed(before: &ToolState, after: &ToolState, dt: f64) -> f64 {
    let (front, back, side_m) = reach();
    let way = |end: DVec3| (after.tip + after.rotation * end).distance(before.tip + before.rotation * end);
    (way(front).max(way(back)) + (after.jaw - before.jaw).abs() * side_m) / dt
}

/// The angular velocity that turns one rotation into another in `dt` seconds, world axes, rad/s.
pub(super) fn spin(from: DQuat, to: DQuat, dt: f64) -> DVec3 {
    shortest_turn(from, to) / dt
}

impl Agent for Tool {
    fn model(&self) -> &'static str {
        "tool"
    }

    fn stepping(&mut self) -> Stepping<'_> {
        Stepping::Cluster(self)
    }

    fn inputs(&self) -> Inputs {
        Inputs::of(&[Input::Spring, Input::Force])
    }

    fn shift_clock(&mut self, by_s: f64) {
        self.script.begin_later(by_s);
    }

    fn write_snapshot(&self, into: &mut Snapshot) {
        into.clear();
        into.resolution = None;
        into.body = Body::Tool(ToolState { led: self.commanded.position, ..self.tool });
        into.energy_j = 0.0;
        into.residual_m = self.lag_m;
        into.touches.extend(self.tool.grasp.map(|grasp| grasp.target));
        into.at_rest = self.at_rest;
        into.inertia = self.drive.inertia();
        into.bounds = Some(bounds(&self.tool, self.speed_m_s));
    }

    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.tool, self.commanded, self.drive, self.lag_m, self.jaws)?;
        archive_values!(archive, self.speed_m_s, self.at_rest)?;
        self.script.archive(archive)?;
        self.unknowns.archive(archive)
    }

    fn form(&self) -> Option<Arc<CollisionShape>> {
        Some(self.form.clone())
    }
}
