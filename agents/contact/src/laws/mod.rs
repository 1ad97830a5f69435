//! The law of asynchronous pairs next to the ledger: a line between two clocks, for pairs that need no inverse mass.
//!
//! In: places, velocities, the peer's published data. Out: forces on one side. Each side computes and applies only its own force.
//! Never here: which agents touch, any agent's state. Theory: docs/theory/coupling.md.

mod tlm;

pub use metachron_core::Wave;
pub use tlm::{Line, LineLaw, LineStep};
