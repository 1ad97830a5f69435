//! Choices without steps: meshes of any number of triangles, rates of agents.
//!
//! In: weights, ranges, a budget. Out: a share for each. Never here: levels.

pub mod barrier;
pub mod gobbetti;
pub mod rates;
pub mod water;
