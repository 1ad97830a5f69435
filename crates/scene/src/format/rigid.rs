//! `model = "rigid"`: a rigid body, or with `fixed = true` a solid that never moves.

use super::Point;
use super::ranges::within;
use metachron_drawable::Generator;
use metachron_models::rigid::LIMITS;
use schemars::JsonSchema;
use serde::Deserialize;

/// A rigid body, or a static solid that others collide with, beside the keys of its [`SolidShapeFile`].
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(transform = within(LIMITS))]
pub struct RigidFile {
    /// The solids of a `compound`, 1 … 16: each has a shape with its keys, and may have `position_m`, `rotation_deg` and `density_kg_m3`.
    #[schemars(length(min = 1, max = 16))]
    pub part: Option<Vec<SolidShapeFile>>,
    /// Velocity of the centre of mass at the start, m/s, up to 1e4. Default none.
    pub velocity_m_s: Option<Point>,
    /// Angular velocity at the start about the world's axes, rad/s, up to 1e4. Default none.
    pub spin_rad_s: Option<Point>,
    /// Mass, kilograms. Not together with `density_kg_m3`.
    pub mass_kg: Option<f64>,
    /// Centre of mass in the axes of the object, metres; beside `inertia_kg_m2`. Default: the origin of those axes.
    pub centre_of_mass_m: Option<Point>,
    /// Moments and products of inertia about the centre of mass along the axes of the object, kg·m²: `[xx, yy, zz, xy, xz, yz]`, beside
    /// `mass_kg`. The products are elements of the tensor, as in URDF and MJCF. Default: the shape's, evenly filled.
    pub inertia_kg_m2: Option<[f64; 6]>,
    /// Coefficient of restitution; a pair takes the larger one. Default 0.
    pub restitution: Option<f64>,
    /// Coulomb friction coefficient; a pair takes the geometric mean. Default 0.5.
    pub friction: Option<f64>,
    /// How many times as strong gravity is for it. Default 1.
    pub gravity_scale: Option<f64>,
    /// Rate by which its velocity decays, 1/s. Default 0.
    pub linear_damping_per_s: Option<f64>,
    /// Rate by which its angular momentum decays, 1/s. Default 0.
    pub angular_damping_per_s: Option<f64>,
    /// Axes of the world along which it does not move. Default none.
    pub lock_translation: Option<Vec<Axis>>,
    /// Axes of the world about which it does not turn. Default none.
    pub lock_rotation: Option<Vec<Axis>>,
    /// Whether it never moves. Default false; a plane is always fixed.
    pub fixed: Option<bool>,
    /// Whether it moves as keyframes and commands lead it, and gives way to nothing; mass and density have no effect then. Default false.
    pub kinematic: Option<bool>,
    /// Poses of a kinematic object, at most 10000; it starts in the first. Default: it stays at `position_m` until a command leads it.
    #[schemars(length(max = 10_000))]
    pub keyframe: Option<Vec<PoseKeyFile>>,
    /// Whether the motion along `keyframe` starts again after the last, to which it returns from there in as long as its last leg took. Default
    /// false.
    pub repeat: Option<bool>,
}

/// A solid, alone or as a part of a `compound`: its shape, its place and its density.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SolidShapeFile {
    /// Its shape. `ball`: `radius_m`. `box`: `half_extents_m`. `capsule` and `cylinder` (along z): `radius_m`,
    /// `half_height_m`. `plane`: the half space below z = 0 of its axes, always fixed. `hull` and `mesh`: `file`
    /// or `generate`. `compound`: several solids as one, one `[[object.part]]` each. A part is neither a plane nor a compound.
    pub shape: Shape,
    /// Radius of a ball, capsule or cylinder, metres.
    pub radius_m: Option<f64>,
    /// Half the edges of a box, metres.
    pub half_extents_m: Option<Point>,
    /// Half the length of a cylinder, or of a capsule's straight part, metres.
    pub half_height_m: Option<f64>,
    /// A .glb file (+y up), an STL or an OBJ file (+z up), its path relative to the scene file: the points of a hull, the triangles of a mesh.
    pub file: Option<String>,
    /// A generated surface, about a metre large; not with `file`.
    pub generate: Option<Generator>,
    /// Seed of a generated surface. Default 0.
    pub seed: Option<u32>,
    /// Triangles of a generated surface. Default 4000.
    pub triangles: Option<u32>,
    /// Factor that converts the surface's coordinates to metres. Default 1.
    pub scale: Option<f64>,
    /// How far points of a surface may lie above a face of its hull, metres: the hull is simplified so far, and 0 keeps all points.
    /// Default 1e-4, or a thousandth of the diagonal of the box around the points where that is less.
    pub hull_within_m: Option<f64>,
    /// Position of the origin of its axes, of a part in those of the object, metres. Default: the world's or the object's origin.
    pub position_m: Option<Point>,
    /// Rotation by angles about the x, then y, then z axis of the world, of a part those of the object, degrees. Default none.
    pub rotation_deg: Option<Point>,
    /// Density, kg/m³; where the object has a mass, the densities of its parts only share it. Default 1000 where no mass is given; of a part
    /// that of the object.
    pub density_kg_m3: Option<f64>,
}

/// An axis of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// The first.
    X,
    /// The second.
    Y,
    /// The third: up.
    Z,
}

/// Pose of a kinematic object at one time.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PoseKeyFile {
    /// Seconds from the start; later than the keyframe before. Default 0 for the first.
    pub at_s: Option<f64>,
    /// Position of the origin of the shape's axes, metres.
    pub position_m: Point,
    /// Rotation by angles about the world's x, then y, then z axis, degrees. Default: that of the keyframe before; for the first, the
    /// object's `rotation_deg`.
    pub rotation_deg: Option<Point>,
}

/// The shape of a rigid body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// A ball.
    Ball,
    /// A box.
    Box,
    /// A capsule along z.
    Capsule,
    /// A cylinder along z.
    Cylinder,
    /// The half space below z = 0.
    Plane,
    /// The convex hull of a file's points.
    Hull,
    /// A file's triangles.
    Mesh,
    /// Several solids as one.
    Compound,
}
