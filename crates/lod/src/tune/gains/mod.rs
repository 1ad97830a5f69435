//! Which gains are best, and why others are not.
//!
//! In: a plant. Out: gains, judged and explained. Never here: how a loop is simulated.

pub mod explain;
pub mod relay;
pub mod search;
pub mod trials;
pub mod tuning;
