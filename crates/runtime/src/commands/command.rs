//! Commands as users write them.
//!
//! ```
//! use glam::DVec3;
//! use metachron_core::Anchor;
//! use metachron_runtime::Command;
//!
//! // two newtons upwards at 0.6 m along a tube, for 50 ms of its time
//! let lift = Command::force(Anchor::Arc(0.6), DVec3::Z * 2.0).key(1).for_ms(50);
//! ```

use super::mailbox::{Command, Keyed};
use glam::{DQuat, DVec3};
use metachron_contact::joint::Motor;
use metachron_contact::{AnchorForce, AnchorSpring, Carving, PoseGoal, SetMotion, SetMotor};
use metachron_core::{Anchor, Resolution, SimSpan};

impl Command {
    /// A force of `force_n`, N, world axes, at a material point, under key 0, until it is taken back.
    #[must_use]
    pub const fn force(anchor: Anchor, force_n: DVec3) -> Self {
        Self::Force(Keyed::first(Some(AnchorForce { anchor, force_n, torque_n_m: DVec3::ZERO })))
    }

    /// A torque of `torque_n_m`, N·m, world axes, at a material point, under key 0, until it is taken back.
    #[must_use]
    pub const fn torque(anchor: Anchor, torque_n_m: DVec3) -> Self {
        Self::Force(Keyed::first(Some(AnchorForce { anchor, force_n: DVec3::ZERO, torque_n_m })))
    }

    /// An impulse of `impulse_n_s`, N·s, world axes, at a material point.
    #[must_use]
    pub const fn impulse(anchor: Anchor, impulse_n_s: DVec3) -> Self {
        Self::Impulse(AnchorForce { anchor, force_n: impulse_n_s, torque_n_m: DVec3::ZERO })
    }

    /// A spring of `stiffness_n_m`, N/m, and `damping_n_s_m`, N·s/m, from a point in space to a material point, under key 0, until it is taken
    /// back. It leads a tool.
    #[must_use]
    pub const fn spring(anchor: Anchor, target: DVec3, stiffness_n_m: f64, damping_n_s_m: f64) -> Self {
        let target_velocity = DVec3::ZERO;
        Self::Spring(Keyed::first(Some(AnchorSpring {
            by: None,
            anchor,
            target,
            target_velocity,
            stiffness_n_m,
            damping_n_s_m,
        })))
    }

    /// A motor for a joint, by its number in the scene, until it is taken back.
    #[must_use]
    pub const fn motor(joint: u32, motor: Motor) -> Self {
        Self::Motor(Keyed { key: joint, what: Some(SetMotor { joint, motor: Some(motor) }), lasts: None })
    }

    /// Leads a kinematic body to a pose within its next step, and holds it there until it is taken back: where the origin of its axes is to be,
    /// metres, and its rotation to the world's axes.
    #[must_use]
    pub fn pose(position_m: DVec3, rotation: DQuat) -> Self {
        let (velocity_m_s, spin_rad_s) = (DVec3::ZERO, DVec3::ZERO);
        Self::Pose(Keyed::first(Some(PoseGoal { position_m, rotation, velocity_m_s, spin_rad_s })))
    }

    /// The same pose, which moves on from when the body takes it, m/s and rad/s, world axes.
    #[must_use]
    pub const fn moving(mut self, velocity: DVec3, spin: DVec3) -> Self {
        if let Self::Pose(Keyed { what: Some(goal), .. }) = &mut self {
            (goal.velocity_m_s, goal.spin_rad_s) = (velocity, spin);
        }
        self
    }

    /// To another place: the origin of a rigid body's axes, or the centre of mass of a deformable, metres, and by how
    /// much it turns.
    #[must_use]
    pub fn teleport(position_m: DVec3, rotation: DQuat) -> Self {
        Self::SetMotion(SetMotion { position_m: Some(position_m), rotation: Some(rotation), ..SetMotion::default() })
    }

    /// Another velocity, m/s, and spin, rad/s, of all its matter.
    #[must_use]
    pub fn velocity(velocity_m_s: DVec3, spin_rad_s: DVec3) -> Self {
        Self::SetMotion(SetMotion {
            velocity_m_s: Some(velocity_m_s),
            spin_rad_s: Some(spin_rad_s),
            ..SetMotion::default()
        })
    }

    /// The pressure of its filling, inside minus outside, Pa; an agent that refuses this pressure stays as it is.
    #[must_use]
    pub const fn pressure(pressure_pa: f64) -> Self {
        Self::SetPressure(pressure_pa)
    }

    /// Another resolution, clamped to its range.
    #[must_use]
    pub const fn resolution(wanted: Resolution) -> Self {
        Self::Retune(wanted)
    }

    /// Another length of its steps, clamped to its range.
    #[must_use]
    pub const fn step(dt: SimSpan) -> Self {
        Self::SetDt(dt)
    }

    /// Wakes it up from rest.
    #[must_use]
    pub const fn wake() -> Self {
        Self::Wake
    }

    /// Removes the cells of a solid or a sheet whose middles are within `radius_m`, m, of the line from `from_m` to `to_m`, m, where they are at
    /// its next step; a ball where both ends are one point. Nothing happens where there are none, or where none would be left.
    #[must_use]
    pub const fn carve(from_m: DVec3, to_m: DVec3, radius_m: f64) -> Self {
        Self::Carve(Carving { from_m, to_m, radius_m })
    }

    /// The same under another key, 0 … 7, of a spring or a force; others have none.
    #[must_use]
    pub const fn key(mut self, key: u32) -> Self {
        match &mut self {
            Self::Spring(spring) => spring.key = key,
            Self::Force(force) => force.key = key,
            _ => {}
        }
        self
    }

    /// The same for this long, in the agent's time, from when the agent takes it; a command that acts once or for good
    /// stays so.
    #[must_use]
    pub const fn expires_after(mut self, span: SimSpan) -> Self {
        match &mut self {
            Self::Spring(spring) => spring.lasts = Some(span),
            Self::Force(force) => force.lasts = Some(span),
            Self::Motor(motor) => motor.lasts = Some(span),
            Self::Pose(pose) => pose.lasts = Some(span),
            _ => {}
        }
        self
    }

    /// [`Command::expires_after`] in milliseconds.
    #[must_use]
    pub const fn for_ms(self, milliseconds: u64) -> Self {
        self.expires_after(SimSpan::from_millis(milliseconds))
    }

    /// Takes back the spring, the force or the motor of its key, or the pose.
    #[must_use]
    pub const fn taken_back(mut self) -> Self {
        match &mut self {
            Self::Spring(spring) => spring.what = None,
            Self::Force(force) => force.what = None,
            Self::Motor(motor) => motor.what = None,
            Self::Pose(pose) => pose.what = None,
            _ => {}
        }
        self
    }
}
