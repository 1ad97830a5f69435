//! `[[joint]]`: a joint between two rigid objects, or between one and the world.

use super::Point;
use schemars::JsonSchema;
use serde::Deserialize;

/// A joint between two rigid objects, or between one and the world.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointFile {
    /// Its name, by which programs drive it and sensors read it: unique among the names of joints. Default: none.
    #[schemars(length(min = 1, max = 64))]
    pub name: Option<String>,
    /// Motion that it leaves free. `fixed`: none. `revolute`: rotation about `axis`. `spherical`: any rotation. `prismatic`: sliding
    /// along `axis`. `spring`: all, against a spring. `rope`: all, up to a distance of `length_m`.
    pub kind: JointKind,
    /// Name of a rigid object.
    pub a: String,
    /// Name of another rigid object, or `world`.
    pub b: String,
    /// Anchor on `a`, in the axes of its shape, metres. Default: their origin.
    pub at_a_m: Option<Point>,
    /// Anchor on `b`, in the axes of its shape, or the world's if `b` is `world`, metres. Default: the position of `at_a_m` at the start;
    /// for a spring or rope the origin of `b`, where `b` is not `world`.
    pub at_b_m: Option<Point>,
    /// Axis of a `revolute` or `prismatic` joint in the axes of `a`; its length has no meaning.
    pub axis: Option<Point>,
    /// Range of the position of `at_b_m` relative to `at_a_m` along the axis of a `prismatic` joint, metres: `[least, greatest]`, each up
    /// to 1e4 in magnitude. Default: unlimited.
    pub range_m: Option<[f64; 2]>,
    /// Range of the angle of a `revolute` joint, degrees from that at the start: `[least, greatest]`, containing 0, each up to 180 in
    /// magnitude. Default: unlimited.
    pub range_deg: Option<[f64; 2]>,
    /// Motor of a `revolute` or `prismatic` joint.
    pub motor: Option<MotorFile>,
    /// Dry friction of a `revolute` joint, N·m, beside its motor, or of a `spherical` one. Default 0.
    pub friction_n_m: Option<f64>,
    /// Dry friction of a `prismatic` joint, N, beside its motor. Default 0.
    pub friction_n: Option<f64>,
    /// Inertia about the axis of a `revolute` joint, kg·m², of a rotor behind its gear, or about every axis of a `spherical` one: it resists changes of
    /// the rate at which `b` turns against `a`.
    /// Default 0.
    pub armature_kg_m2: Option<f64>,
    /// Inertia along the axis of a `prismatic` joint, kg: it resists changes of the rate at which `b` slides against `a`. Default 0.
    pub armature_kg: Option<f64>,
    /// Another joint that a `revolute` or `prismatic` joint follows, as a gear or a finger of a gripper does.
    pub mimic: Option<MimicFile>,
    /// Stiffness of a `spring`, N/m.
    pub stiffness_n_m: Option<f64>,
    /// Damping of a `spring`, N·s/m. Default 0.
    pub damping_n_s_m: Option<f64>,
    /// Rest length of a `spring`, metres. Default: its length at the start.
    pub rest_m: Option<f64>,
    /// Greatest length of a `rope`, metres. Default: its length at the start.
    pub length_m: Option<f64>,
    /// Whether the two objects can collide with each other, also once the joint has torn. Default true for a spring or rope, false for
    /// the others.
    pub collide: Option<bool>,
    /// Force above which it tears, N: the mean over a common step of the two; its torques do not count. It
    /// is gone then for good, and the report has it under `events`. Default: never.
    pub tears_above_n: Option<f64>,
    /// Greatest force that it gives, N; below `tears_above_n`: a load above it moves the point of `b`
    /// that it holds, or lengthens a `rope` or `spring`, for good. Its torques are not bounded. The report has the
    /// first time under `events`. Default: as much as it takes.
    pub yields_above_n: Option<f64>,
}

/// Joint that another one follows: the travel of both is tied from where they start, whatever acts on either.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MimicFile {
    /// Name of a `revolute` or `prismatic` joint.
    pub joint: String,
    /// Radians or metres for each radian or metre of that joint. Default 1.
    pub ratio: Option<f64>,
}

/// Motor of a joint: it drives `b` relative to `a` about or along `axis`, the position counted as the joint's range is. A velocity alone is
/// kept exactly as long as the effort suffices; a position is approached by a spring, with a damper against the velocity (default 0).
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotorFile {
    /// Angle of a `revolute` joint at which its spring rests, degrees; it is reached the shorter way around.
    pub position_deg: Option<f64>,
    /// Velocity of a `revolute` joint, rad/s.
    pub velocity_rad_s: Option<f64>,
    /// Greatest torque, N·m. Default: as much as it takes.
    pub max_torque_n_m: Option<f64>,
    /// Stiffness of the spring to `position_deg`, N·m/rad.
    pub stiffness_n_m_rad: Option<f64>,
    /// Damping against `velocity_rad_s`, N·m·s/rad: without a position the motor gives this times the missing
    /// velocity.
    pub damping_n_m_s_rad: Option<f64>,
    /// Position of a `prismatic` joint at which its spring rests, metres.
    pub position_m: Option<f64>,
    /// Velocity of a `prismatic` joint, m/s.
    pub velocity_m_s: Option<f64>,
    /// Greatest force, N. Default: as much as it takes.
    pub max_force_n: Option<f64>,
    /// Stiffness of the spring to `position_m`, N/m.
    pub stiffness_n_m: Option<f64>,
    /// Damping against `velocity_m_s`, N·s/m: without a position the motor gives this times the missing
    /// velocity.
    pub damping_n_s_m: Option<f64>,
}

/// Motion that a joint leaves free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum JointKind {
    /// None.
    Fixed,
    /// Rotation about one axis.
    Revolute,
    /// Any rotation about one point.
    Spherical,
    /// Sliding along one axis.
    Prismatic,
    /// All motion, against a spring between two points.
    Spring,
    /// All motion, up to a distance between two points.
    Rope,
}
