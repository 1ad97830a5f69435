//! Which states a frame shows: newest snapshots brought to its time, agents that join and leave, groups that move.
//!
//! In: snapshots and the time of a frame. Out: poses and shapes at that time. Never here: a step of physics, how they are drawn.

mod impostor_fit;
pub mod membership;
mod pose;
pub mod scene_view;
