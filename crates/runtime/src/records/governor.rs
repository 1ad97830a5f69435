//! Interface to the controller of an agent's rate: measured times out, demands in.
//!
//! Never here: a control law. The runtime measures and obeys; it decides no ε.

use metachron_core::{Archive, ArchiveError, Resolution, SimSpan};

/// Controls one agent by the times of its turns.
pub trait Governor: Send {
    /// The demand with which its agent begins, asked for once, before the first turn; none by default.
    fn begins_with(&self) -> Demand {
        Demand::default()
    }

    /// Called after every turn; its demand holds from the next turn on.
    fn after_step(&mut self, measure: &TurnMeasure) -> Demand;

    /// Writes its state to an archive, or reads it from one ([`metachron_contact::Agent::archive`]).
    ///
    /// # Errors
    /// [`ArchiveError::Refused`] by one that does not save its state, as this one does where a governor has nothing else;
    /// [`ArchiveError`] for a state of another one.
    fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        let _ = archive;
        Err(ArchiveError::Refused { what: "its governor".to_owned() })
    }
}

/// Measurements of a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnMeasure {
    /// Wall time the turn took, seconds, waiting for a core included; virtual in lockstep. Zero at the free pace, where turns take none of the
    /// simulated time, however long they take: no rate has to be lowered for them.
    pub work_s: f64,
    /// Wall time between turns at the requested rate, seconds, at the timeline's present speed.
    pub wanted_period_s: f64,
    /// Wall time between the starts of the last turns, seconds, smoothed over about eight of them; equal to `wanted_period_s`
    /// as long as there is nothing to measure (first turn, after a rest, a pause or a change of speed, at the free pace).
    pub real_period_s: f64,
    /// How long after its release the turn began, wall seconds, ≥ 0.
    pub lateness_s: f64,
    /// Simulated time dropped before this turn.
    pub dropped: SimSpan,
    /// The step's length.
    pub dt: SimSpan,
    /// The resolution of the step; `None` for a model that has none.
    pub resolution: Option<Resolution>,
    /// The agent's estimate of its own error, metres.
    pub residual_m: f64,
    /// The part of it caused by its time steps, metres.
    pub drift_m: f64,
}

/// A governor's demand on its agent; `None` leaves the present value.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Demand {
    /// The step length; clamped to the agent's range.
    pub dt: Option<SimSpan>,
    /// The resolution of the simulation; clamped to the agent's range.
    pub resolution: Option<Resolution>,
}
