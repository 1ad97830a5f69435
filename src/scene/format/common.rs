//! The keys that objects of every model share.

use super::{FaultsFile, OneOrEach, OneOrRange, Point, ShadingKind};
use schemars::JsonSchema;
use serde::Deserialize;

/// The keys of [`CommonFile`]: they are read apart from the keys of the model.
pub const COMMON_KEYS: [&str; 17] = [
    "name",
    "rate_hz",
    "dt_ms",
    "hold",
    "tolerance_m",
    "n",
    "importance",
    "colour",
    "material",
    "shading",
    "sleep",
    "faults",
    "grid",
    "spacing_m",
    "rise_m",
    "scatter_m",
    "scatter_seed",
];

/// What every object may say, whatever its model.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CommonFile {
    /// The object's name: unique in the scene, not empty, at most 64 characters.
    #[schemars(length(min = 1, max = 64))]
    pub name: String,
    /// Wanted steps per second, 1 … 100000. Default: 1000 / `dt_ms` (the least, where that is a range), or 240.
    /// With a single `dt_ms` it must agree with it.
    #[schemars(range(min = 1.0, max = 100_000.0))]
    pub rate_hz: Option<f64>,
    /// Step length in milliseconds, 0.01 … 1000: one number fixes it, `[least, greatest]` is what the controller may use.
    /// Default: 1000 / `rate_hz`, fixed.
    pub dt_ms: Option<OneOrRange<f64>>,
    /// What its controller holds within `dt_ms` and `eps_m`: `rate` (default) or `error`, which wants `tolerance_m`.
    /// For a sheet, solid or rope `hold` names what is held; `tolerance_m` alone says this of it.
    pub hold: Option<HoldKind>,
    /// The error that it may have by its own estimate, metres, 1e-9 … 1e3: it takes the longest steps and the coarsest ε of
    /// its ranges that keep it.
    #[schemars(range(min = 1e-9, max = 1e3))]
    pub tolerance_m: Option<f64>,
    /// Level of the primitive drawn over one interval, 0 … 10: O(2ⁿ) polygons. Default: `[1, 5]`.
    pub n: Option<OneOrRange<u8>>,
    /// Weight of the object's picture against the others', 0.001 … 1000. Default 1.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub importance: Option<f64>,
    /// Colour as `#rrggbb` (sRGB). Default: by material.
    #[schemars(regex(pattern = "^#[0-9a-fA-F]{6}$"))]
    pub colour: Option<String>,
    /// What its surface looks like. Default: tissue for a tube, sheet or solid, metal for an instrument, plastic for the rest.
    pub material: Option<Material>,
    /// How the light on it is worked out: `flat`, `gouraud`, `per-pixel` (default), or `any`, whichever the policy takes.
    pub shading: Option<ShadingKind>,
    /// Whether it stops stepping when it is at rest and nothing touches it. Default true.
    pub sleep: Option<bool>,
    /// What goes wrong with its clock and its messages on purpose; what is left out is the world's.
    pub faults: Option<FaultsFile>,
    /// Repeats an object: how many along x, y and z, each 1 … 1000. The first stands where the object says, the
    /// others `spacing_m` apart, counted along x, then y, then z; their names are `NAME-0`, `NAME-1`, ….
    #[schemars(length(min = 3, max = 3))]
    pub grid: Option<[u32; 3]>,
    /// Distance of neighbours in the grid along x, y and z, metres, up to 1e4 in magnitude.
    pub spacing_m: Option<Point>,
    /// How much higher each next one of the grid stands, along x and along y, metres, up to 1e4 in magnitude. Default `[0, 0]`.
    #[schemars(length(min = 2, max = 2))]
    pub rise_m: Option<[f64; 2]>,
    /// Moves every object of the grid by a random distance along each axis, evenly up to this far either way, metres,
    /// 0 … 1e4; one number, or one an axis: `[x, y, z]`. Default 0.
    pub scatter_m: Option<OneOrEach>,
    /// Seed of the random distances. Default 0.
    pub scatter_seed: Option<u32>,
}

/// What the controller of an object holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HoldKind {
    /// The rate at which it steps.
    Rate,
    /// The error of its answer.
    Error,
}

/// How a surface looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Material {
    /// Wet tissue.
    Tissue,
    /// Brushed metal.
    Metal,
    /// Matt plastic.
    Plastic,
    /// Dry skin.
    Skin,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_of_common_keys_is_the_keys_of_the_type() {
        let schema = schemars::schema_for!(CommonFile);
        let mut listed = COMMON_KEYS.to_vec();
        listed.sort_unstable();
        let mut keys: Vec<_> =
            schema.get("properties").unwrap().as_object().unwrap().keys().map(String::as_str).collect();
        keys.sort_unstable();
        assert_eq!(listed, keys);
    }
}
