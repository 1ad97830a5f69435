//! The report of a step, and the errors of a step that is refused or diverges.

use crate::SimSpan;

/// The cost and the outcome of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepReport {
    /// Work done, in the model's unit; a declared machine gives the cost of a unit in seconds.
    /// Tube: segments × systems solved: one per substep, more where its rule iterates, plus the systems of its own
    /// error estimate. Rigid, tool: 1. Synthetic: its declared microseconds.
    pub work: f64,
    /// Number of substeps that the step was divided into, ≥ 1.
    pub substeps: u32,
    /// Whether the agent may sleep: it has not moved for a while and nothing acts on it.
    pub at_rest: bool,
}

/// Why a step was refused or abandoned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// The span was zero, or longer than the model can take. State: untouched.
    #[error("the step length is {dt_s} s; expected above 0 and at most {max_s} s")]
    BadSpan {
        /// The requested span, in seconds.
        dt_s: f64,
        /// The longest span the model takes, in seconds.
        max_s: f64,
    },
    /// The state is no longer finite. The agent must not step again; its last snapshot stays valid.
    #[error("the {model} model diverged in a step of {dt_s} s: {what}")]
    Diverged {
        /// The model's name.
        model: &'static str,
        /// The span of the failed step, in seconds.
        dt_s: f64,
        /// The quantity that stopped being finite first, and where.
        what: String,
    },
}

/// The longest step any model takes, in seconds: past it a real-time agent no longer follows its scene.
pub const DT_MAX_S: f64 = 1.0;

/// The length of `dt` in seconds, if a model may step by it.
///
/// # Errors
/// [`StepError::BadSpan`] for zero and for more than [`DT_MAX_S`].
pub fn check_span(dt: SimSpan) -> Result<f64, StepError> {
    let dt_s = dt.as_secs_f64();
    if dt_s > 0.0 && dt_s <= DT_MAX_S { Ok(dt_s) } else { Err(StepError::BadSpan { dt_s, max_s: DT_MAX_S }) }
}
