//! The sensors of a scene: what each reads, and where it sits.
//!
//! In: what a scene says. Out: the same as plain data. Never here: what they read in a world.

use glam::{DQuat, DVec3};
use metachron_core::{AgentId, ContactPartner};

/// A sensor of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// Its name, unique among the names of sensors.
    pub name: String,
    /// Its kind, with its mount.
    pub kind: SensorKind,
}

/// The kinds of sensors.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SensorKind {
    /// How far the second body of a joint has moved from the first, from its zero: rad of a hinge within −π … π, metres of a slide, the
    /// distance of the anchors of a spring or rope. One number.
    JointPosition(u32),
    /// How fast, rad/s or m/s. One number.
    JointVelocity(u32),
    /// The effort of its motor and its stops together on the second body, N·m of a hinge, N of a slide: the mean of the
    /// last step. One number.
    JointEffort(u32),
    /// The force of all contacts on an object, world axes, N: the mean of the last step. Three numbers.
    ContactForce {
        /// The object.
        object: AgentId,
        /// Whose contacts count; `None` for all.
        with: Option<ContactPartner>,
    },
    /// The reading of an accelerometer on a rigid body, the acceleration of the matter there less that of gravity,
    /// m/s², then of a gyroscope, rad/s, both in the axes of its site. Accelerations are the mean of the last step,
    /// spins are at its end. Six numbers.
    Imu {
        /// The body.
        object: AgentId,
        /// The gravity on it, m/s².
        gravity_m_s2: DVec3,
        /// Where on the body it is.
        site: Site,
    },
    /// Where a point of a rigid body is, metres, and the rotation of its shape's axes as a unit quaternion x, y, z, w. Seven numbers.
    Pose {
        /// The body.
        object: AgentId,
        /// The point, metres in the axes of its shape.
        at_m: DVec3,
    },
}

/// Where on a rigid body a sensor sits, and how it is turned there: by default in the centre of mass, in the axes of the shape.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Site {
    /// Its place, metres in the axes of the body's shape; `None` for the centre of mass.
    pub at_m: Option<DVec3>,
    /// The rotation from its own axes to the shape's, of length 1.
    pub rotation: DQuat,
}

impl SensorKind {
    /// Its name in scene files and reports.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::JointPosition(_) => "joint-position",
            Self::JointVelocity(_) => "joint-velocity",
            Self::JointEffort(_) => "joint-effort",
            Self::ContactForce { .. } => "contact-force",
            Self::Imu { .. } => "imu",
            Self::Pose { .. } => "pose",
        }
    }
}
