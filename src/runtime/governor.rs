//! The seam to whoever steers an agent's rate: measured times out, demands in.
//!
//! Never here: a control law. The runtime measures and obeys; it decides no ε.

use metachron_core::{Resolution, SimSpan};

/// Steers one agent by what its turns take.
pub trait Governor: Send {
    /// Told after every turn; what it demands holds from the next turn on.
    fn after_step(&mut self, measure: &TurnMeasure) -> Demand;
}

/// What a turn took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnMeasure {
    /// Wall time the turn took, seconds, waiting for a core included; virtual in lockstep.
    pub work_s: f64,
    /// Wall time between turns at the rate that is wanted, seconds, at the timeline's present speed.
    pub wanted_period_s: f64,
    /// Wall time between the starts of the last turns, seconds, smoothed over about eight of them; equal to `wanted_period_s`
    /// as long as there is nothing to measure (first turn, after a rest, a pause or a change of speed).
    pub real_period_s: f64,
    /// How long after its release the turn began, wall seconds, ≥ 0.
    pub lateness_s: f64,
    /// Simulated time dropped before this turn.
    pub dropped: SimSpan,
    /// The step's length.
    pub dt: SimSpan,
    /// The resolution the step was made at; `None` for a model that has none.
    pub resolution: Option<Resolution>,
    /// What the agent says of its own error, metres.
    pub residual_m: f64,
    /// The part of it that its steps made, metres.
    pub drift_m: f64,
}

/// What a governor wants of its agent; `None` leaves things as they are.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Demand {
    /// Step by this span; clamped to the agent's range.
    pub dt: Option<SimSpan>,
    /// Simulate at this resolution; clamped to the agent's range.
    pub resolution: Option<Resolution>,
}
