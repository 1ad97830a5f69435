//! `model = "mesh"` and `model = "tree"`: scenery that is only drawn; and `[[group]]`, objects drawn as one mesh from afar.

use super::Point;
use metachron_drawable::Generator;
use schemars::JsonSchema;
use serde::Deserialize;

/// A triangle mesh that is drawn with as many triangles as the frame has time for. It is only drawn: nothing collides with it
/// (a `rigid` object of shape `mesh` with `fixed = true` does collide).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshFile {
    /// A file of triangles, binary glTF (.glb, +y up), STL or OBJ (+z up), its path relative to the scene file; not with `generate`. The surface
    /// may be open, but no edge may be shared by more than two triangles, and no coordinate may be past ± 1e5 m.
    pub file: Option<String>,
    /// A generated mesh, about a metre large; not with `file`.
    pub generate: Option<Generator>,
    /// Seed of a generated mesh. Default 0.
    pub seed: Option<u32>,
    /// Triangles of the full mesh: of a generated mesh, or the number to which a file with more is reduced. Default: 1000 for
    /// a generated mesh, all for a file.
    #[schemars(range(min = 4, max = 1_000_000), extend("x-unit" = ""))]
    pub triangles: Option<u32>,
    /// Fewest triangles that it is drawn with; a mesh with fewer has all drawn. Default: as few as it can be reduced to.
    pub least_triangles: Option<u32>,
    /// Factor that converts coordinates to metres. Default 1.
    pub scale: Option<f64>,
    /// Position of the origin of the mesh's axes, metres. Default: the world's origin.
    pub position_m: Option<Point>,
    /// Rotation by angles about the world's x, then y, then z axis, degrees. Default none.
    pub rotation_deg: Option<Point>,
    /// Texture: `checker`, `planks`, `books`, or a PNG or JPEG file, its path relative to the scene file; multiplied by `colour`. An image
    /// is mapped by the file's texture coordinates (`TEXCOORD_n` of a .glb, `vt` of an OBJ file); a pattern, an image on a mesh without
    /// them, and one with `texture_m` are mapped straight onto each side. Default: for a .glb file the image of its base colours, if they
    /// all use one; else none.
    pub texture: Option<String>,
    /// Length of one repeat of `texture` where it is mapped onto each side, metres. Default 1.
    pub texture_m: Option<f64>,
    /// Makes a dome: 120 copies along the edges of a geodesic sphere of this radius, metres; each spans its edge from −1 to
    /// 1 on its z axis; their names are `NAME-0` … `NAME-119`. Not with `scale`, nor in a `proxy`.
    pub dome_m: Option<f64>,
    /// How it moves, by itself and whatever is in its way. Not in a `proxy`, which moves as the members of its group do. Default: never.
    pub motion: Option<MotionFile>,
}

/// The motion of a mesh: it turns about its own origin, which swings along a line.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotionFile {
    /// Angular velocity about the origin of the mesh's axes (of a dome: about its centre), rad/s, each −1e4 … 1e4. Default none.
    pub spin_rad_s: Option<Point>,
    /// Greatest offset of the swing, metres. At the start it is 0 and grows. Default none.
    pub swing_m: Option<Point>,
    /// Swings per second, Hz. Default 0.1.
    pub swing_hz: Option<f64>,
}

/// A tree of boughs and leaves: two drawn objects, `NAME` and `NAME.leaves`, with levels from points and lines up to triangles.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TreeFile {
    /// Seed of its shape. Default 0.
    pub seed: Option<u32>,
    /// Height, metres.
    pub height_m: f64,
    /// Boughs; each has 10 triangles at its finest. Default 62.
    pub branches: Option<u32>,
    /// Leaves; each has 2 triangles at its finest. Default 240.
    pub leaves: Option<u32>,
    /// `levels` (default): lines and points from afar, meshes when near. `prefix`: always the mesh, as much of it as there is time for.
    pub lod: Option<TreeLod>,
    /// Colour of the leaves as `#rrggbb` (sRGB). Default: a green. `colour` is that of the trunk.
    #[schemars(regex(pattern = "^#[0-9a-fA-F]{6}$"))]
    pub leaves_colour: Option<String>,
    /// Weight of the leaves' picture, as a share of `importance`. Default 0.5.
    pub leaves_importance: Option<f64>,
    /// Position, metres. Default: the origin.
    pub position_m: Option<Point>,
    /// Rotation by angles about the world's x, then y, then z axis, degrees. Default none.
    pub rotation_deg: Option<Point>,
}

/// Objects that may be drawn as one mesh instead, which has levels of its own and moves as they do.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroupFile {
    /// The group's name: unique among objects and groups.
    #[schemars(length(min = 1, max = 64))]
    pub name: String,
    /// Names of its meshes, trees, simulated objects and groups; one that ends in `*` selects every name that begins with the part before
    /// it. Nothing is in two groups, and no group in itself.
    ///
    /// While a group is drawn as one mesh, and its simulated members touch nothing outside it, they are simulated as finely and as often
    /// as that mesh shows, within their `eps_m` and `dt_ms`.
    #[schemars(length(min = 1, max = 10_000))]
    pub members: Vec<String>,
    /// The mesh that replaces all of them where they are at the start, reduced to `levels`. Default: one made of their own coarse meshes; a
    /// group with simulated members needs one.
    pub proxy: Option<MeshFile>,
    /// Triangles of the group's impostors, coarsest first: 1 to 8 rising numbers, each 1 … 100000, to which its mesh is reduced. The more
    /// time there is, the finer the impostor that is drawn, and past the finest its members. Default: the finest has a twentieth of the
    /// members' triangles, 12 … 2000 (with a `proxy` all that it has), each coarser one a quarter, down to 12.
    #[schemars(length(min = 1, max = 8), inner(range(min = 1, max = 100_000)))]
    pub levels: Option<Vec<u32>>,
}

/// How a tree is drawn from afar.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TreeLod {
    /// Lines and points.
    #[default]
    Levels,
    /// The first part of its mesh's triangles.
    Prefix,
}
