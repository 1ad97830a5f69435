//! `model = "synthetic"`: an agent with declared cost and error and without matter.

use super::OneOrRange;
use schemars::JsonSchema;
use serde::Deserialize;

/// An agent with declared cost and error curves, for controllers and tests.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SyntheticFile {
    /// Cost of one step at the coarsest `eps_m`, microseconds.
    pub cost_us: f64,
    /// How the cost rises with refinement: cost · (coarsest / ε)^order. Default 1.
    pub cost_order: Option<f64>,
    /// Error at the coarsest `eps_m`, metres. Default 0.
    pub error_m: Option<f64>,
    /// How the error falls with refinement: error · (ε / coarsest)^order. Default 2.
    pub error_order: Option<f64>,
    /// Spacing ε, metres: one number fixes it; `[finest, coarsest]` is the range that the controller may use.
    /// Default 0.01, fixed.
    pub eps_m: Option<OneOrRange<f64>>,
}
