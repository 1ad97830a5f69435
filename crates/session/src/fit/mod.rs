//! The cheapest steps, divisions and integrators that a tolerance allows: numbers only.
//!
//! In: the options for every object, and a function that tries a choice. Out: the converged answer with its own error, the cheapest choice
//! within a tolerance of it, and the limiting factor if the tolerance cannot be met.
//! Never here: scenes, agents, files. The caller defines the trials and their costs.

mod converge;
mod path;
mod search;

pub use converge::{Converged, converge};
pub use path::{Path, farthest_m};
pub use search::{Choice, Found, Search, Setting, Trial};

#[cfg(test)]
mod tests;
