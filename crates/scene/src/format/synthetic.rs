//! `model = "synthetic"`: an agent with declared cost and error and without matter.

use super::OneOrRange;
use schemars::JsonSchema;
use serde::Deserialize;

/// An agent with declared cost and error curves, for controllers and tests.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SyntheticFile {
    /// Spacing ε, metres: one number fixes it; `[finest, coarsest]` is the range that the controller may use.
    /// Default 0.01, fixed.
    pub eps_m: Option<OneOrRange<f64>>,
}
