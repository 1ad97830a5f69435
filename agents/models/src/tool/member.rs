//! A tool in a contact cluster: its tip is a mass on a drive that follows the commanded point; its turns and its jaws are led.
//!
//! In: its goal, steps, the velocity of its tip. Out: the tip's mass, its drive, its skin. Never here: contacts, the path.
//! Theory: docs/theory/coupling.md, eq. 9d; docs/theory/clusters.md, section 9.

use super::Tool;
use super::agent::{SUPPORTING_MAX_M_S, reach, shape, speed, spin, through};
use super::drive::Drive;
use super::gripper::Jaws;
use crate::trajectory::PointMotion;
use glam::{DMat3, DQuat, DVec3};
use metachron_contact::member;
use metachron_contact::member::{
    Attachments, ClusterMember, MaterialPoint, MemberMotion, Pose, Role, SkinPoint, StepEnd, StepSystem,
};
use metachron_contact::solve::{Block, Side};
use metachron_contact::{AnchorSpring, StepContext, is_within_motion};
use metachron_core::{AgentId, Anchor, Archive, ArchiveError, SimSpan, SimTime, StepError, ToolState, archive_values};
use metachron_geometry::{ContactSide, Place, PlacedShape, ShapePose};

/// Its unknowns in a cluster.
#[derive(Debug, Clone)]
pub(super) struct Unknowns {
    time: SimTime,
    /// The spring of a user, from the start of the macro step on, and whether there is something near that jaws would grasp.
    hand: Option<AnchorSpring>,
    is_near: bool,
    /// The opening of the jaws when the last macro step began.
    jaw_before: f64,
    block: [Block; 1],
    free: [DVec3; 1],
    now: [DVec3; 1],
    /// Where the step begun leads it, and how fast: the commanded point, m/s, its turn, rad/s, its jaws, 1/s.
    led: ToolState,
    led_m_s: DVec3,
    led_rad_s: DVec3,
    jaw_per_s: f64,
    /// The state from which the macro step may begin again.
    saved: Option<SavedState>,
}

/// The state of a tool.
#[derive(Debug, Clone, Copy)]
struct SavedState {
    tool: ToolState,
    commanded: PointMotion,
    drive: Drive,
    jaws: Jaws,
    lag_m: f64,
    speed_m_s: f64,
    at_rest: bool,
    time: SimTime,
    hand: Option<AnchorSpring>,
}

impl Unknowns {
    /// Writes or reads the state that is known between steps.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive_values!(archive, self.time, self.hand, self.is_near, self.jaw_before, self.free, self.now)?;
        archive_values!(archive, self.led, self.led_m_s, self.led_rad_s, self.jaw_per_s)
    }

    pub fn new(tool: &ToolState, mass_kg: f64) -> Self {
        let value = DMat3::from_diagonal(DVec3::splat(mass_kg));
        Self {
            time: SimTime::ZERO,
            hand: None,
            is_near: false,
            jaw_before: tool.jaw,
            block: [Block { row: 0, column: 0, value }],
            free: [DVec3::ZERO],
            now: [tool.velocity],
            led: *tool,
            led_m_s: DVec3::ZERO,
            led_rad_s: DVec3::ZERO,
            jaw_per_s: 0.0,
            saved: None,
        }
    }
}

impl Tool {
    /// Where it is led to in `h_s` seconds.
    fn lead(&self, h_s: f64) -> ToolState {
        let Unknowns { hand, is_near, time, .. } = &self.unknowns;
        let led = match hand {
            Some(spring) => self.follow_user_spring(spring, h_s, *is_near),
            None => {
                let end = *time + span(h_s);
                let [from, to] = [*time, end].map(|time| self.script.at(time.as_secs_f64()));
                self.follow_script(&from, &to, h_s)
            }
        };
        let (tip, rotation) = through(self.pivot, led.tip, led.rotation);
        let velocity = if tip == led.tip { led.velocity } else { (tip - self.commanded.position) / h_s };
        ToolState { tip, rotation, velocity, ..led }
    }
}

impl Tool {
    /// Takes over its goal from the start of a macro step on.
    pub(super) fn begin_at(&mut self, context: &StepContext<'_>) {
        let hand = context.user_springs.first().copied();
        let is_near = hand.is_some() && self.may_catch(context);
        (self.unknowns.time, self.unknowns.hand, self.unknowns.is_near) = (context.time, hand, is_near);
    }

    /// Lets the jaws grasp and release by how they have moved since this was last called; steps are of `dt_s` seconds.
    pub(super) fn move_jaws(&mut self, context: &StepContext<'_>, dt_s: f64) {
        let was = std::mem::replace(&mut self.unknowns.jaw_before, self.tool.jaw);
        self.jaws.move_to(&self.spec, was, &self.tool, context);
        self.tool.grasp = self.jaws.grasp(&self.spec);
        self.tool.admits = self.open_for(context, dt_s);
    }

    /// How the point `arm_m` from its tip moves with the tip.
    fn side_at(&self, arm_m: DVec3) -> Side {
        self.pivot.map_or_else(|| Side::node(0, 0), |pivot| pivot.side(self.tool.tip, arm_m))
    }
}

impl ClusterMember for Tool {
    fn role(&self) -> Role {
        Role::Rigid
    }

    fn look(&mut self, context: &StepContext<'_>, dt_s: f64) {
        self.begin_at(context);
        self.move_jaws(context, dt_s);
    }

    fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        let led = self.lead(h_s);
        let inside = is_within_motion(led.tip);
        if !(inside && led.velocity.is_finite() && led.rotation.is_finite()) {
            let what = format!("what leads it moves the tip to {}", led.tip);
            return Err(StepError::Diverged { model: "tool", dt_s: h_s, what });
        }
        let led_m_s = (led.tip - self.commanded.position) / h_s;
        let unknowns = &mut self.unknowns;
        unknowns.now = [self.tool.velocity];
        // the drive brings the tip's mass along with the commanded point, as far as its force goes; at its limit nothing is left for that
        let most_n = if self.drive.is_saturated() { 0.0 } else { self.spec.max_force_n };
        let change = led_m_s + self.drive.rate() - self.tool.velocity;
        unknowns.free = [self.tool.velocity + change.clamp_length_max(most_n * h_s / self.drive.mass_kg())];
        // with a pivot the tip's own velocity turns the shaft, and only the turn about it is led
        let (_, rotation) =
            self.pivot.map_or((led.tip, led.rotation), |_| through(self.pivot, self.tool.tip, led.rotation));
        unknowns.led_rad_s = spin(self.tool.rotation, rotation, h_s);
        unknowns.jaw_per_s = (led.jaw - self.tool.jaw) / h_s;
        (unknowns.led, unknowns.led_m_s) = (led, led_m_s);
        Ok(())
    }

    fn system(&self) -> StepSystem<'_> {
        let Unknowns { block, free, now, .. } = &self.unknowns;
        StepSystem { blocks: block, free, velocities: now, ..StepSystem::default() }
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        let ToolState { tip, rotation, jaw, .. } = self.tool;
        Some(PlacedShape { form: &self.form, view: ShapePose::Tool { tip, rotation, jaw } })
    }

    fn skin_point(&self, place: &Place, _contact: ContactSide) -> SkinPoint {
        let Place::Point(point) = *place else { return Side::node(0, 0).into() };
        let (arm, rotation) = (point - self.tool.tip, self.tool.rotation);
        let opening = shape().opening_m_s(rotation.conjugate() * arm, self.unknowns.jaw_per_s);
        let led_m_s = self.unknowns.led_rad_s.cross(arm) + rotation * opening;
        SkinPoint { led_m_s, ..self.side_at(arm).into() }
    }

    fn keep(&mut self) {
        let Unknowns { time, hand, .. } = self.unknowns;
        let Self { tool, commanded, lag_m, speed_m_s, at_rest, .. } = *self;
        let (drive, jaws) = (self.drive, self.jaws);
        let saved = SavedState { tool, commanded, drive, jaws, lag_m, speed_m_s, at_rest, time, hand };
        self.unknowns.saved = Some(saved);
    }

    fn go_back(&mut self) {
        let Some(saved) = self.unknowns.saved else { return };
        let SavedState { tool, commanded, drive, jaws, lag_m, speed_m_s, at_rest, time, hand } = saved;
        (self.tool, self.commanded, self.drive, self.jaws) = (tool, commanded, drive, jaws);
        (self.lag_m, self.speed_m_s, self.at_rest) = (lag_m, speed_m_s, at_rest);
        (self.unknowns.time, self.unknowns.hand) = (time, hand);
    }

    fn end(&mut self, &StepEnd { v, h_s, .. }: &StepEnd<'_>) -> Result<(), StepError> {
        if !v[0].is_finite() {
            let what = "its tip is not at a finite place".to_owned();
            return Err(StepError::Diverged { model: "tool", dt_s: h_s, what });
        }
        let Unknowns { led, led_m_s, led_rad_s, free, .. } = self.unknowns;
        let pushed_n_s = (v[0] - free[0]) * self.drive.mass_kg();
        let to = PointMotion { position: led.tip, velocity: led.velocity };
        // the tip comes to a stop where the shaft ends
        let moved_m_s = self.pivot.map_or(v[0], |pivot| {
            let (from, to) = (self.tool.tip, self.tool.tip + v[0] * h_s);
            let stop = pivot.within(to, self.tool.rotation);
            if stop == to { v[0] } else { (stop - from) / h_s }
        });
        let driven = self.drive.follow(to, [led_m_s, moved_m_s], h_s);
        self.commanded = driven.commanded;
        let (position, rotation) = through(self.pivot, driven.tip.position, led.rotation);
        let turned_rad_s = self.pivot.map_or(DVec3::ZERO, |pivot| pivot.spin_rad_s(position, driven.tip.velocity));
        let tip = ToolState { tip: position, rotation, velocity: driven.tip.velocity, ..led };
        self.speed_m_s = speed(&self.tool, &tip, h_s);
        let force_n = (pushed_n_s - driven.impulse_n_s).length() / h_s;
        let unknowns = &mut self.unknowns;
        unknowns.time += span(h_s);
        if let Some(hand) = &mut unknowns.hand {
            hand.target += hand.target_velocity * h_s;
        }
        let end = self.script.at(self.unknowns.time.as_secs_f64());
        let wanted = self.unknowns.hand.map_or(end.tip, |spring| self.user_target(&spring).position);
        self.lag_m = tip.tip.distance(wanted);
        let over = self.script.is_over(self.unknowns.time.as_secs_f64());
        let is_idle = self.unknowns.hand.is_none() && over && self.has_reached(&end);
        self.tool = ToolState { spin: led_rad_s + turned_rad_s, is_idle, force_n, ..tip };
        self.jaws.age(h_s);
        self.tool.grasp = self.jaws.grasp(&self.spec);
        self.at_rest = false;
        Ok(())
    }

    fn can_sleep(&self) -> bool {
        self.tool.is_idle && self.tool.velocity.length() < SUPPORTING_MAX_M_S && !self.jaws.holds()
    }

    fn sleep(&mut self) {
        self.at_rest = true;
        self.tool.velocity = DVec3::ZERO;
        // rounding of its way back from a user must not stay
        if self.drive.has_arrived() {
            let end = self.script.at(self.unknowns.time.as_secs_f64());
            self.commanded = PointMotion { position: end.tip, velocity: DVec3::ZERO };
            (self.tool.tip, self.tool.rotation) = through(self.pivot, end.tip, self.tool.rotation);
        }
    }

    fn motion(&self) -> Option<&dyn MemberMotion> {
        Some(self)
    }

    fn attachments(&self) -> Option<&dyn Attachments> {
        Some(self)
    }
}

impl MemberMotion for Tool {
    fn pose(&self, v: &[DVec3], t_s: f64) -> Option<Pose> {
        let way = v.first().map_or(DVec3::ZERO, |v| *v * t_s);
        let led_rad_s = self.unknowns.led_rad_s;
        let centre_m = self.tool.tip + way;
        let rolled = DQuat::from_scaled_axis(led_rad_s * t_s) * self.tool.rotation;
        let rotation = self.pivot.map_or(rolled, |pivot| pivot.aligned(rolled, centre_m));
        let turns = self.pivot.map_or(Side::FIXED, |pivot| pivot.turns(self.tool.tip));
        Some(Pose { centre_m, origin_m: centre_m, rotation, turns, led_rad_s })
    }

    fn skin_after<'a>(&'a self, v: &[DVec3], t_s: f64, _nodes: &'a mut Vec<DVec3>) -> Option<PlacedShape<'a>> {
        let Pose { centre_m: tip, rotation, .. } = self.pose(v, t_s)?;
        let jaw = self.tool.jaw + self.unknowns.jaw_per_s * t_s;
        Some(PlacedShape { form: &self.form, view: ShapePose::Tool { tip, rotation, jaw } })
    }

    fn speed_bound(&self, v: &[DVec3]) -> f64 {
        let (front, back, side_m) = reach();
        let Unknowns { led_rad_s, jaw_per_s, .. } = self.unknowns;
        let reach_m = front.length().max(back.length()) + side_m;
        let moved_m_s = v[0].length();
        let moved_m_s = self.pivot.map_or(moved_m_s, |pivot| pivot.speed_bound(self.tool.tip, moved_m_s, reach_m));
        moved_m_s + led_rad_s.length() * reach_m + jaw_per_s.abs() * side_m
    }

    fn passes_through(&self, other: AgentId) -> bool {
        self.tool.grasp.is_some_and(|grasp| grasp.target == other) || self.tool.admits == Some(other)
    }
}

impl Attachments for Tool {
    fn anchor(&self, anchor: Anchor) -> Option<MaterialPoint> {
        let Anchor::Local(local) = anchor else { return None };
        let arm = self.tool.rotation * local;
        let led_m_s = self.unknowns.led_rad_s.cross(arm);
        Some(MaterialPoint { led_m_s, ..MaterialPoint::new(self.tool.tip + arm, self.side_at(arm)) })
    }

    fn drive(&self) -> Option<member::Drive> {
        Some(member::Drive {
            point: MaterialPoint::new(self.tool.tip, Side::node(0, 0)),
            target_m: self.commanded.position,
            target_m_s: self.unknowns.led_m_s,
            stiffness_n_m: self.drive.stiffness_n_m(),
            damping_n_s_m: self.drive.damping_n_s_m(),
            limit_n: self.spec.max_force_n,
        })
    }
}

/// A step of `h_s` seconds in whole nanoseconds, as clocks count.
fn span(h_s: f64) -> SimSpan {
    SimSpan::from_secs_f64(h_s).unwrap_or(SimSpan::ZERO)
}
