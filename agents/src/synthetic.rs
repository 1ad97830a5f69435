//! An agent with declared cost and error curves and no matter, for controllers and tests.

/// A synthetic agent: cost a step = `cost_us · (eps_ref / ε)^cost_order`, error = `error_m · (ε / eps_ref)^error_order`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SyntheticSpec {
    /// Cost of one step at the reference spacing, microseconds, ≥ 0.
    pub cost_us: f64,
    /// How the cost rises with refinement, ≥ 0.
    pub cost_order: f64,
    /// Error at the reference spacing, metres, ≥ 0.
    pub error_m: f64,
    /// How the error falls with refinement, ≥ 0.
    pub error_order: f64,
}
