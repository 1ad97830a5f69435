//! What is known of what agents did: events, turns, measured costs, samples of points.
//!
//! In: what a turn measures and what happened in it. Out: the same for any thread that asks. Never here: what a turn does next.

pub mod events;
pub mod governor;
pub mod histogram;
pub mod metrics;
pub mod probe;
pub mod streams;
pub mod turns;
