//! `[[joint]]`: what holds two rigid objects together, or one to the world.

use super::Point;
use schemars::JsonSchema;
use serde::Deserialize;

/// A joint between two rigid objects, or between one and the world.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointFile {
    /// What it leaves free. `fixed`: nothing. `revolute`: a turn about `axis`. `spherical`: every turn. `prismatic`: a slide
    /// along `axis`. `spring`: everything, against a spring. `rope`: everything up to `length_m`.
    pub kind: JointKind,
    /// Name of a rigid object.
    pub a: String,
    /// Name of another rigid object, or `world`.
    pub b: String,
    /// Where it holds `a`, in the axes of its shape, metres. Default their origin.
    pub at_a_m: Option<Point>,
    /// Where it holds `b`, in the axes of its shape, or in the world's, metres. Default: where `at_a_m` is at the start;
    /// for a spring or rope the origin of `b`.
    pub at_b_m: Option<Point>,
    /// Axis of a `revolute` or `prismatic` joint in the axes of `a`; its length has no meaning.
    pub axis: Option<Point>,
    /// How far `at_b_m` may be from `at_a_m` along the axis of a `prismatic` joint, metres: `[least, greatest]`, each up to 1e4
    /// in magnitude. Default without end.
    pub range_m: Option<[f64; 2]>,
    /// How far a `revolute` joint turns, degrees from where it is at the start: `[least, greatest]`, 0 among them, each up to
    /// 180 in magnitude. Default without end.
    pub range_deg: Option<[f64; 2]>,
    /// Stiffness of a `spring`, N/m, 1e-6 … 1e9.
    pub stiffness_n_m: Option<f64>,
    /// Damping of a `spring`, N·s/m, 0 … 1e7. Default 0.
    pub damping_n_s_m: Option<f64>,
    /// Length of a `spring` at rest, metres, 0 … 1e4. Default: its length at the start.
    pub rest_m: Option<f64>,
    /// Greatest length of a `rope`, metres, 1e-6 … 1e4. Default: its length at the start.
    pub length_m: Option<f64>,
    /// Whether the two objects still touch each other. Default true for a spring or rope, false for the rest.
    pub collide: Option<bool>,
}

/// What a joint leaves free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum JointKind {
    /// Nothing.
    Fixed,
    /// A turn about one axis.
    Revolute,
    /// Every turn about one point.
    Spherical,
    /// A slide along one axis.
    Prismatic,
    /// Everything, against a spring between two points.
    Spring,
    /// Everything up to a distance of two points.
    Rope,
}

impl JointKind {
    /// The name as scenes write it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fixed => "fixed",
            Self::Revolute => "revolute",
            Self::Spherical => "spherical",
            Self::Prismatic => "prismatic",
            Self::Spring => "spring",
            Self::Rope => "rope",
        }
    }
}
