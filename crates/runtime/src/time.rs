//! What time it is, and what work costs: clocks, an agent's time and phases, the declared machine.
//!
//! In: wall time, or the prices of a machine. Out: times that are due. Never here: turns, threads that wait for them.

pub mod agent_clock;
pub mod clock;
pub mod cpu;
pub mod faults;
pub mod machine;
pub mod virtual_events;
