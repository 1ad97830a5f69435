//! Alternative laws of contact next to the ledger: for comparison, and for links that need no inverse mass.
//!
//! In: places, velocities, the peer's published data. Out: forces on one side. Each side computes and applies only its own force.
//! Never here: which agents touch, any agent's state. Theory: docs/theory/coupling.md.

mod penalty;
mod tlm;

pub use metachron_core::Wave;
pub use penalty::{Approach, push_off_n};
pub use tlm::{Line, LineEnd, LineLaw, LineStep, LinkForces};
