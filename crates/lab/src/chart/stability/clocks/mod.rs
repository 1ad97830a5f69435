//! Bodies whose clocks differ: does energy grow where they touch or are tied?
//!
//! In: bodies with steps of their own. Out: energy and momentum over time. Never here: one common clock.

pub mod closed;
mod closed_system;
pub mod drop;
pub mod impact;
pub mod penalty_limit;
