//! Tuning: finds, explains and checks gains. How a scene's frame time responds to its resolution, and which law holds it best; likewise an
//! agent's load to its step and spacing.
//!
//! In: frames of an experiment ([`Observed`]). Out: the plant behind them ([`Plant`]), the behaviour of a law on it ([`explain`],
//! [`judge`]) and the best gains ([`search()`]). Closed loops are simulated with the controller used for drawing,
//! [`crate::control::PictureControl`], on the fitted plant, so that the gains found apply to the real loop. Never here: scenes, threads of
//! agents, drawing, files.
//! Theory: `docs/theory/control.md`, section 8.

mod agents;
mod gains;
mod loops;

#[cfg(test)]
mod tests;

pub use agents::agent_plant::{AgentIdentifyError, AgentPlant, AgentWindow};
pub use agents::agent_tuning::{AgentTuning, AgentVerdict, judge_agents, tune_agents};
pub use gains::explain::{Explanation, explain, refusal};
pub use gains::relay::relay_gains;
pub use gains::search::{Family, Search, SearchResult, search};
pub use gains::trials::{Extent, Margins, Verdict, judge, measure, speeds_in_reach};
pub use gains::tuning::{NORMALISED, Origin, Row, Tuning, tune};
pub use loops::candidate::Candidate;
pub use loops::disturbance::Disturbance;
pub use loops::equilibria::{FixedPoint, fixed_points};
pub use loops::margins::Loop;
pub use loops::measures::{BAND, Cycle, LATE, Measures, settled_after};
pub use loops::plant::{IdentifyError, Observed, Plant, TimeRange};
pub use loops::play::{Start, Trial, TrialFrame, play};
pub use loops::robust_fit::Line;

/// The law accepts all gains that scenes, the window and the search allow.
const _: () = {
    use crate::log_law;
    use metachron_core::gains;
    assert!(log_law::KAPPA.0 == gains::KAPPA.least && log_law::KAPPA.1 == gains::KAPPA.greatest);
    assert!(log_law::LEAD.0 == gains::LEAD.least && log_law::LEAD.1 == gains::LEAD.greatest);
};
