//! Which agents are in a run, and what others hold of each: its number and name, its handle, what is left when it has gone.
//!
//! In: agents with their rates and links. Out: handles with the newest states. Never here: how a turn is made.

pub mod agent_record;
pub mod agent_spawn;
pub mod agents;
mod form_slot;
pub mod handle;
pub mod reader;
pub mod removed_agent;
pub mod spawn;
