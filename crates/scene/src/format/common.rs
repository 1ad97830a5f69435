//! The keys that objects of every model share.

use super::{ContactFile, FaultsFile, OneOrEach, OneOrRange, Point};
use metachron_world::kinds::{Material, ShadingKind};
use schemars::JsonSchema;
use serde::Deserialize;

/// Keys of every object, whatever its model.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CommonFile {
    /// The object's name: unique in the scene, not empty, at most 64 characters.
    #[schemars(length(min = 1, max = 64))]
    pub name: String,
    /// Requested steps per second. Default: 1000 / `dt_ms` (its least value, if it is a range), or 240 without `dt_ms`.
    /// A single `dt_ms` must agree with it.
    pub rate_hz: Option<f64>,
    /// Step length, milliseconds: one number fixes it; `[least, greatest]` is the range that the controller may use.
    /// Default: 1000 / `rate_hz`, fixed.
    pub dt_ms: Option<OneOrRange<f64>>,
    /// Quantity that the controller holds within `dt_ms` and `eps_m`: `rate` (default), or `error`, which needs `tolerance_m`.
    /// For a sheet, solid or rope `hold` lists the parts that never move; `tolerance_m` alone selects `error` there.
    pub hold: Option<HoldKind>,
    /// Greatest error by the object's own estimate, metres: the longest steps and the coarsest ε within its ranges that
    /// keep it are used.
    pub tolerance_m: Option<f64>,
    /// Level of the primitive drawn over one interval, 0 … 10: O(2ⁿ) polygons. Default: `[1, 5]`.
    pub n: Option<OneOrRange<u8>>,
    /// Weight of the object's picture relative to that of others. Default 1.
    pub importance: Option<f64>,
    /// Whether policies that choose by cost may leave the object out of the picture where not even the coarsest of everything fits. Default: that of `[target]`.
    pub may_vanish: Option<bool>,
    /// Colour as `#rrggbb` (sRGB). Default: by material.
    #[schemars(regex(pattern = "^#[0-9a-fA-F]{6}$"))]
    pub colour: Option<String>,
    /// Material of its surface. Default: tissue for a tube, sheet or solid, metal for a tool, plastic for the rest.
    pub material: Option<Material>,
    /// Shading of its surface: `flat`, `gouraud`, `per-pixel`, `textured` of tissue and of meshes with a texture, or `any` (default), which
    /// leaves it to the policy.
    pub shading: Option<ShadingKind>,
    /// Whether it stops stepping when it is at rest and nothing touches it. Default true.
    pub sleep: Option<bool>,
    /// Name of the host that steps it, with all that is with it, where several do (`run --hosts`); `--host-of` has precedence. No effect elsewhere.
    pub host: Option<String>,
    /// Faults injected into its clock and its messages; keys that are left out take the values of the world.
    pub faults: Option<FaultsFile>,
    /// Its contacts: the groups that it collides with, how a pair shares its coefficients, whether it only senses.
    pub contact: Option<ContactFile>,
    /// Repeats an object: number of copies along x, y and z, each 1 … 1000. The first is at the object's own position, the
    /// others are `spacing_m` apart, counted along x, then y, then z; their names are `NAME-0`, `NAME-1`, ….
    #[schemars(length(min = 3, max = 3))]
    pub grid: Option<[u32; 3]>,
    /// Distance of neighbours in the grid along x, y and z, metres, up to 1e4 in magnitude.
    pub spacing_m: Option<Point>,
    /// Rise from each copy of the grid to the next, along x and along y, metres, up to 1e4 in magnitude. Default `[0, 0]`.
    #[schemars(length(min = 2, max = 2))]
    pub rise_m: Option<[f64; 2]>,
    /// Moves every copy of the grid by a random distance along each axis, uniform up to this far either way, metres; one
    /// number, or one per axis: `[x, y, z]`. Default 0.
    pub scatter_m: Option<OneOrEach>,
    /// Turns every copy of the grid, of a rigid body, by a random angle about each of the world's axes, x, then y, then z, uniform up to this far either way,
    /// degrees; one number, or one per axis: `[x, y, z]`. Default 0.
    pub scatter_deg: Option<OneOrEach>,
    /// Seed of the random distances and turns. Default 0.
    pub scatter_seed: Option<u32>,
}

/// Quantity that the controller of an object holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HoldKind {
    /// The rate of its steps.
    Rate,
    /// The error of its result.
    Error,
}
