//! The cheapest steps, divisions and methods that a tolerance allows: numbers only.
//!
//! In: what may be chosen for every object, and a way to try choices out. Out: the converged answer with its own error, the
//! cheapest choice within a tolerance of it, and what limits one that cannot be met.
//! Never here: scenes, agents, files. What is tried, and at what price, is told by who asks.

mod converge;
mod path;
mod search;

pub use converge::{Converged, converge};
pub use path::{Path, farthest_m};
pub use search::{Choice, Found, Search, Setting, Trial};

#[cfg(test)]
mod tests;
