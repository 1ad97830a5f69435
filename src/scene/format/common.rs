//! The keys that objects of every model share.

use super::OneOrRange;
use schemars::JsonSchema;
use serde::Deserialize;

/// The keys of [`CommonFile`]: they are read apart from the keys of the model.
pub const COMMON_KEYS: [&str; 8] = ["name", "rate_hz", "dt_ms", "n", "importance", "colour", "material", "sleep"];

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
    /// Level of the primitive drawn over one interval, 0 … 10: O(2ⁿ) polygons. Default: `[1, 5]`.
    pub n: Option<OneOrRange<u8>>,
    /// Weight of the object's picture against the others', 0.001 … 1000. Default 1.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub importance: Option<f64>,
    /// Colour as `#rrggbb` (sRGB). Default: by material.
    #[schemars(regex(pattern = "^#[0-9a-fA-F]{6}$"))]
    pub colour: Option<String>,
    /// What its surface looks like. Default: tissue for a tube, metal for an instrument, plastic for the rest.
    pub material: Option<Material>,
    /// Whether it stops stepping when it is at rest and nothing touches it. Default true.
    pub sleep: Option<bool>,
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
