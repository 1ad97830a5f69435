//! Values that a scene may write in more than one form.

pub use metachron_world::OneOrRange;
use schemars::JsonSchema;
use serde::Deserialize;

/// A point or a direction: `[x, y, z]`.
pub type Point = [f64; 3];

/// One number for all axes, or `[x, y, z]`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, or one an axis: [x, y, z]")]
#[schemars(inline)]
pub enum OneOrEach {
    /// The same along every axis.
    One(f64),
    /// Along x, y and z.
    Each(Point),
}
