//! What programs do to a running world: commands, states that are set, objects that join and leave, its pace.
//!
//! In: calls from any thread. Out: the same at the objects' next steps, logged. Never here: what a world shows.

pub mod call_lock;
mod commands;
mod membership;
pub mod pace;
mod set_state;
