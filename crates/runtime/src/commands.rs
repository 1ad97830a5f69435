//! What users do to agents: commands with their bounds, on their way to the turn that takes them, and as loads of its steps.
//!
//! In: commands of any thread. Out: loads of a step. Never here: how a model answers them.

pub mod bounds;
mod command;
pub mod loads;
pub mod mailbox;
