//! A world that several processes step together.
//!
//! In: worlds of one scene, each on a host of its own. Out: one world, whose objects are each stepped by one of them. Never here: a
//! connection, a step.

pub mod divided;
pub mod flow;
mod groups;
mod kept;
pub mod placed_world;
mod windows;
