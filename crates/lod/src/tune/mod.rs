//! Tuning: finds, explains and checks gains. How a scene's frame time responds to its resolution, and which law holds it best; likewise an
//! agent's load to its step and spacing.
//!
//! In: frames of an experiment ([`Observed`]). Out: the plant behind them ([`Plant`]), the behaviour of a law on it ([`explain`],
//! [`judge`]) and the best gains ([`search()`]). Closed loops are simulated with the controller used for drawing,
//! [`crate::control::PictureControl`], on the fitted plant, so that the gains found apply to the real loop. Never here: scenes, threads of
//! agents, drawing, files.
//! Theory: `docs/theory/control.md`, section 8.

mod agent_plant;
mod agent_tuning;
mod candidate;
mod disturbance;
mod equilibria;
mod explain;
mod margins;
mod measures;
mod plant;
mod play;
mod relay;
mod robust_fit;
mod search;
mod trials;
mod tuning;

#[cfg(test)]
mod tests;

pub use agent_plant::{AgentIdentifyError, AgentPlant, AgentWindow};
pub use agent_tuning::{AgentTuning, AgentVerdict, judge_agents, tune_agents};
pub use candidate::Candidate;
pub use disturbance::Disturbance;
pub use equilibria::{FixedPoint, fixed_points};
pub use explain::{Explanation, explain, refusal};
pub use margins::Loop;
pub use measures::{BAND, Cycle, LATE, Measures, settled_after};
pub use plant::{IdentifyError, Observed, Plant, TimeRange};
pub use play::{Start, Trial, TrialFrame, play};
pub use relay::relay_gains;
pub use robust_fit::Line;
pub use search::{Family, Search, SearchResult, search};
pub use trials::{Extent, Margins, Verdict, judge, measure, speeds_in_reach};
pub use tuning::{NORMALISED, Origin, Row, Tuning, tune};

/// The law accepts all gains that scenes, the window and the search allow.
const _: () = {
    use crate::log_law;
    use metachron_core::gains;
    assert!(log_law::KAPPA.0 == gains::KAPPA.0 && log_law::KAPPA.1 == gains::KAPPA.1);
    assert!(log_law::LEAD.0 == gains::LEAD.0 && log_law::LEAD.1 == gains::LEAD.1);
};
