//! Values that a scene may write in more than one form.

use schemars::JsonSchema;
use serde::Deserialize;

/// A point or a direction: `[x, y, z]`.
pub type Point = [f64; 3];

/// One number, which fixes a value, or `[least, greatest]`, within which a controller chooses.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, of levels a whole number, or a range [least, greatest]")]
#[schemars(inline)]
pub enum OneOrRange<T> {
    /// The value never changes.
    One(T),
    /// The controller may choose any value from the first to the second, both included.
    #[schemars(extend("x-rises" = true))]
    Range([T; 2]),
}

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

impl<T: Copy> OneOrRange<T> {
    /// The least and the greatest value.
    #[must_use]
    pub fn ends(self) -> (T, T) {
        match self {
            Self::One(value) => (value, value),
            Self::Range([least, greatest]) => (least, greatest),
        }
    }
}
