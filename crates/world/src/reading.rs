//! What programs read of a running world: states, joints, sensors, events, and what is where.
//!
//! In: the newest states of its objects. Out: numbers in the order of objects. Never here: a change of the world.

pub mod events;
pub mod frames;
pub mod joint_states;
pub mod object;
pub mod queries;
pub mod sensors;
pub mod stress;
