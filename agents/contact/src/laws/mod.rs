//! Laws of contact beside the ledger, for comparison and for links that need no inverse mass.
//!
//! In: places, velocities, what the other side published. Out: forces on one side. Both sides act on themselves alone.
//! Never here: who touches whom, any agent's state. Theory: docs/theory/coupling.md.

mod penalty;
mod tlm;

pub use metachron_core::Wave;
pub use penalty::push_off_n;
pub use tlm::{Drawn, End, Line};
