//! Which level each object gets, by every policy.
//!
//! In: ladders and a budget. Out: a plan. Never here: prices, the measured time of a frame.

pub mod adaptive;
mod convex;
pub mod feedback;
pub mod groups;
pub mod hierarchy;
mod impostors;
pub mod quality_boost;
mod robin_hood;
pub mod select;
pub mod steady;
pub mod vanish;
