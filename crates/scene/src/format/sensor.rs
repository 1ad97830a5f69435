//! `[[sensor]]`: readings that programs take by name, and that the report has at the end.

use super::Point;
use schemars::JsonSchema;
use serde::Deserialize;

/// A sensor.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorFile {
    /// Its name: unique among the names of sensors, not empty.
    #[schemars(length(min = 1, max = 64))]
    pub name: String,
    /// Its reading. `joint-position`: how far `b` of a joint has moved from `a`, rad within ±π or metres. `joint-velocity`: rad/s or m/s.
    /// `joint-effort`: effort of motor and stops on `b`, N·m or N. `contact-force`: force of all contacts on an object,
    /// world axes, N. `imu`: of a rigid object the acceleration of its matter at a site less that of gravity, m/s², and
    /// its spin, rad/s, in the axes of the site. `pose`: position of a point of a rigid object, metres, and the
    /// rotation of its axes as a quaternion x, y, z, w.
    pub kind: SensorFileKind,
    /// Name of a joint, for kinds of joints.
    pub joint: Option<String>,
    /// Name of an object that moves, for all other kinds.
    pub object: Option<String>,
    /// Of a `contact-force` the object, fixed or not, whose contacts count. Default: all.
    pub with: Option<String>,
    /// Of a `pose` the point, in the axes of the object's shape, metres; default: their origin. Of an `imu` the place of its site; default:
    /// the centre of mass.
    pub at_m: Option<Point>,
    /// Of an `imu` how its site is turned in the axes of the object's shape: angles about their x, then y, then z, degrees. Default: not.
    pub rotation_deg: Option<Point>,
}

/// The reading of a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SensorFileKind {
    /// How far a joint has moved.
    JointPosition,
    /// How fast it moves.
    JointVelocity,
    /// Effort of its motor and stops.
    JointEffort,
    /// Force of all contacts on an object.
    ContactForce,
    /// Acceleration and spin in an object's own axes.
    Imu,
    /// Position and rotation of a point.
    Pose,
}
