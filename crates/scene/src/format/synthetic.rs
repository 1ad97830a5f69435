//! `model = "synthetic"`: an agent with declared cost and error and without matter.

use super::OneOrRange;
use schemars::JsonSchema;
use serde::Deserialize;

/// An agent with declared cost and error curves, for controllers and tests.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SyntheticFile {
    /// Cost of one step at the coarsest `eps_m`, microseconds, 0 … 1e6.
    pub cost_us: f64,
    /// How the cost rises with refinement: cost · (coarsest / ε)^order, 0 … 4. Default 1.
    pub cost_order: Option<f64>,
    /// Error at the coarsest `eps_m`, metres, 0 … 1e3. Default 0.
    pub error_m: Option<f64>,
    /// How the error falls with refinement: error · (ε / coarsest)^order, 0 … 8. Default 2.
    pub error_order: Option<f64>,
    /// Spacing ε, metres, 1e-6 … 1e3: one number fixes it; `[finest, coarsest]` is the range that the controller may use.
    /// Default 0.01, fixed.
    pub eps_m: Option<OneOrRange<f64>>,
}
