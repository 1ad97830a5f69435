//! How a scene becomes agents that can run.
//!
//! In: a scene, and what joined it. Out: agents with their models, laws and places, clear of each other. Never here: their turns.

pub mod assemble;
pub mod ghost_world;
pub mod initial_overlap;
mod initial_shape;
pub mod joined;
pub mod overlap;
mod ties;
