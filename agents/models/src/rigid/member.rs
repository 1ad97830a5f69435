//! A rigid body in a contact cluster: two blocks, the velocity of its centre of mass and its spin.
//!
//! In: steps and velocities. Out: its inertia, its free flight, its skin. Never here: contacts. Theory: docs/theory/clusters.md, section 9.

use super::Restraint;
use super::RigidBody;
use super::body::{REST_S, STILL_M_S};
use super::motion::{Flight, Motion};
use glam::{DMat3, DQuat, DVec3};
use metachron_contact::member::{
    Attachments, ClusterMember, Locked, MaterialPoint, MemberMotion, Pose, Role, SkinPoint, StepEnd, StepSystem,
};
use metachron_contact::solve::{Block, Side};
use metachron_core::{Anchor, Archive, ArchiveError, Inertia, StepError, inverse_of_free};
use metachron_geometry::{ContactSide, Place, PlacedShape, ShapePose};

/// The block of its spin; block 0 is the velocity of its centre of mass.
const SPIN: usize = 1;

/// How many times as heavy a body is along an axis that is locked: one part in so many is left of the motion by an impulse, and is then
/// taken away.
const LOCKED_TIMES: f64 = 1e8;

/// A mass or an inertia with axes of the world locked, `heaviest` along any of them.
fn locked(mass: DMat3, axes: [bool; 3], heaviest: f64) -> DMat3 {
    let mut mass = mass;
    for axis in (0..3).filter(|axis| axes[*axis]) {
        for other in 0..3 {
            mass.col_mut(axis)[other] = 0.0;
            mass.col_mut(other)[axis] = 0.0;
        }
        mass.col_mut(axis)[axis] = LOCKED_TIMES * heaviest;
    }
    mass
}

/// Its unknowns in a cluster.
#[derive(Debug, Clone)]
pub(super) struct Unknowns {
    blocks: [Block; 2],
    /// Velocity and spin at the end of the step without contact, and now.
    pub(super) free: [DVec3; 2],
    now: [DVec3; 2],
    saved: Option<SavedState>,
}

/// A state to go back to.
#[derive(Debug, Clone, Copy)]
struct SavedState {
    motion: Motion,
    acceleration: DVec3,
    angular_acceleration: DVec3,
    quiet_s: f64,
    at_rest: bool,
}

impl Default for Unknowns {
    fn default() -> Self {
        let block = |at| Block { row: at, column: at, value: DMat3::IDENTITY };
        Self { blocks: [block(0), block(1)], free: [DVec3::ZERO; 2], now: [DVec3::ZERO; 2], saved: None }
    }
}

impl Unknowns {
    /// Writes or reads the velocities that are known between steps.
    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        archive.value(&mut self.now)
    }

    /// Takes the velocities that a body begins with.
    pub(super) fn start(&mut self, now: [DVec3; 2]) {
        self.now = now;
    }
}

impl RigidBody {
    /// The inertia tensor in world axes, kg·m².
    fn inertia(&self) -> DMat3 {
        let to_world = DMat3::from_quat(self.motion.rotation * self.distribution.axes);
        to_world * DMat3::from_diagonal(self.distribution.moments) * to_world.transpose()
    }

    /// Its motion after `h_s` seconds with the velocities `v`; by its own free flight where nothing has touched it.
    fn moved(&self, v: &[DVec3], h_s: f64, touched: bool) -> Motion {
        let mut motion = self.motion;
        let Flight { restraint, .. } = self.flight;
        let given = restraint.rotation(v[SPIN] - self.unknowns.free[SPIN]);
        let given = self.motion.inertia_times(&self.distribution, given);
        if !touched {
            motion.angular += given;
            motion.velocity += restraint.translation(v[0] - self.unknowns.free[0]);
            motion.fly(&self.distribution, &self.flight, h_s);
            return motion;
        }
        if restraint.angular_damping_per_s > 0.0 {
            motion.angular *= libm::exp(-restraint.angular_damping_per_s * h_s);
        }
        motion.angular += given;
        motion.velocity = restraint.translation(v[0]);
        motion.position += motion.velocity * h_s;
        motion.turn_held(&self.distribution, &restraint, h_s);
        motion
    }

    /// How it answers impulses: along and about locked axes not at all.
    pub(super) fn answers(&self) -> Inertia {
        let Restraint { locked_rotation, .. } = self.flight.restraint;
        let inverse_mass = self.flight.restraint.translation(DVec3::splat(self.distribution.mass_kg.recip()));
        let inverse_inertia = if locked_rotation == [false; 3] {
            self.motion.inverse_inertia(&self.distribution)
        } else {
            inverse_of_free(self.inertia(), locked_rotation)
        };
        Inertia::Rigid { inverse_mass, inverse_inertia }
    }

    /// Its blocks: where an axis is locked, it is as heavy there as nothing that touches it moves, and no impulse is left over.
    fn masses(&self) -> [DMat3; 2] {
        let (mass, inertia) = (DMat3::from_diagonal(DVec3::splat(self.distribution.mass_kg)), self.inertia());
        let Restraint { locked_translation, locked_rotation, .. } = self.flight.restraint;
        if !self.flight.restraint.locks() {
            return [mass, inertia];
        }
        let heaviest = self.distribution.moments.max_element();
        [locked(mass, locked_translation, self.distribution.mass_kg), locked(inertia, locked_rotation, heaviest)]
    }

    fn diverged(&self, dt_s: f64, what: &str) -> StepError {
        StepError::Diverged { model: "rigid", dt_s, what: what.to_owned() }
    }
}

impl ClusterMember for RigidBody {
    fn role(&self) -> Role {
        Role::Rigid
    }

    fn begin(&mut self, h_s: f64) -> Result<(), StepError> {
        let mut flight = self.motion;
        flight.fly_predicted(&self.distribution, &self.flight, h_s);
        let masses = self.masses();
        let Unknowns { blocks, free, now, .. } = &mut self.unknowns;
        *now = [self.motion.velocity, self.motion.spin(&self.distribution)];
        *free = [flight.velocity, flight.spin(&self.distribution)];
        blocks.iter_mut().zip(masses).for_each(|(block, mass)| block.value = mass);
        if flight.is_sane(&self.distribution) {
            Ok(())
        } else {
            Err(self.diverged(h_s, "the body left the coordinate range"))
        }
    }

    fn system(&self) -> StepSystem<'_> {
        let Unknowns { blocks, free, now: velocities, .. } = &self.unknowns;
        StepSystem { blocks, free, velocities, ..StepSystem::default() }
    }

    fn skin(&self) -> Option<PlacedShape<'_>> {
        let Motion { position, rotation, .. } = self.motion;
        Some(PlacedShape { form: &self.form, view: ShapePose::Solid { position, rotation } })
    }

    fn skin_point(&self, place: &Place, _contact: ContactSide) -> SkinPoint {
        match *place {
            Place::Point(point) => Side::rigid(0, point - self.motion.position).into(),
            Place::Chain { .. } | Place::Surface { .. } => Side::FIXED.into(),
        }
    }

    fn carry(&mut self, impulses_n_s2: &[DVec3]) {
        let Flight { restraint, .. } = self.flight;
        self.motion.position += restraint.translation(impulses_n_s2[0] / self.distribution.mass_kg);
        let turn = inverse_of_free(self.inertia(), restraint.locked_rotation) * impulses_n_s2[SPIN];
        if turn != DVec3::ZERO {
            self.motion.rotation = (glam::DQuat::from_scaled_axis(turn) * self.motion.rotation).normalize();
        }
    }

    fn keep(&mut self) {
        let Self { motion, acceleration, angular_acceleration, quiet_s, at_rest, .. } = *self;
        self.unknowns.saved = Some(SavedState { motion, acceleration, angular_acceleration, quiet_s, at_rest });
    }

    fn go_back(&mut self) {
        let Some(saved) = self.unknowns.saved else { return };
        let SavedState { motion, acceleration, angular_acceleration, quiet_s, at_rest } = saved;
        (self.motion, self.acceleration, self.angular_acceleration) = (motion, acceleration, angular_acceleration);
        (self.quiet_s, self.at_rest) = (quiet_s, at_rest);
    }

    fn end(&mut self, &StepEnd { v, h_s, touched, .. }: &StepEnd<'_>) -> Result<(), StepError> {
        let before = self.motion;
        self.motion = self.moved(v, h_s, touched);
        if !self.motion.is_sane(&self.distribution) {
            self.motion = before;
            return Err(self.diverged(h_s, "the body left the coordinate range"));
        }
        let spin = self.motion.spin(&self.distribution);
        self.acceleration = (self.motion.velocity - before.velocity) / h_s;
        self.angular_acceleration = (spin - before.spin(&self.distribution)) / h_s;
        self.unknowns.now = [self.motion.velocity, spin];
        self.at_rest = false;
        self.count_still(&before, h_s, touched);
        Ok(())
    }

    fn can_sleep(&self) -> bool {
        self.may_sleep && self.quiet_s >= REST_S
    }

    fn sleep(&mut self) {
        self.at_rest = true;
        (self.motion.velocity, self.motion.angular) = (DVec3::ZERO, DVec3::ZERO);
        (self.acceleration, self.angular_acceleration) = (DVec3::ZERO, DVec3::ZERO);
        self.unknowns.now = [DVec3::ZERO; 2];
    }

    fn motion(&self) -> Option<&dyn MemberMotion> {
        Some(self)
    }

    fn attachments(&self) -> Option<&dyn Attachments> {
        Some(self)
    }
}

impl MemberMotion for RigidBody {
    fn pose(&self, v: &[DVec3], t_s: f64) -> Option<Pose> {
        let motion = if t_s > 0.0 { self.moved(v, t_s, v != self.unknowns.free) } else { self.motion };
        let Motion { position, rotation, .. } = motion;
        let origin_m = position - rotation * self.distribution.com;
        let turns = Side::node(0, SPIN);
        Some(Pose { centre_m: position, origin_m, rotation, turns, led_rad_s: DVec3::ZERO })
    }

    fn locked(&self) -> Option<Locked> {
        let Flight { restraint, .. } = self.flight;
        let Restraint { locked_translation, locked_rotation, .. } = restraint;
        let (mass_kg, inertia) = (self.distribution.mass_kg, self.inertia());
        restraint.locks().then_some(Locked { locked_translation, locked_rotation, mass_kg, inertia })
    }

    fn skin_after<'a>(&'a self, v: &[DVec3], t_s: f64, _nodes: &'a mut Vec<DVec3>) -> Option<PlacedShape<'a>> {
        let Motion { position, rotation, .. } = self.motion;
        let (position, rotation) = (position + v[0] * t_s, DQuat::from_scaled_axis(v[SPIN] * t_s) * rotation);
        Some(PlacedShape { form: &self.form, view: ShapePose::Solid { position, rotation } })
    }

    fn speed_bound(&self, v: &[DVec3]) -> f64 {
        v[0].length() + v[1].length() * self.radius_m
    }
}

impl Attachments for RigidBody {
    fn anchor(&self, anchor: Anchor) -> Option<MaterialPoint> {
        let Anchor::Local(local) = anchor else { return None };
        let arm = self.motion.rotation * local;
        Some(MaterialPoint::new(self.motion.position + arm, Side::rigid(0, arm)))
    }

    fn turn(&self, anchor: Anchor) -> Option<Side> {
        matches!(anchor, Anchor::Local(_)).then(|| Side::node(0, SPIN))
    }
}

impl RigidBody {
    /// Counts the time that it is still after a step from `before`.
    fn count_still(&mut self, before: &Motion, h_s: f64, touched: bool) {
        let still = self.motion.velocity.length() + self.swing_m_s() < STILL_M_S;
        // one that hovers at the top of its flight is not at rest
        let held = touched || (self.flight.gravity == DVec3::ZERO && *before == self.motion);
        self.quiet_s = if still && held { self.quiet_s + h_s } else { 0.0 };
    }
}
