//! How a turn is made: one step of an agent with all that belongs to it.
//!
//! In: an agent that is due. Out: its next state, published. Never here: which agent is due, whose thread makes its turn.

pub mod agent_runner;
pub mod helpers;
pub mod model;
pub mod prefetch;
mod publish;
pub mod turn_order;
pub mod turn_parts;
pub mod watchdog;
