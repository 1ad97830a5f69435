//! The harness of the charts of asynchronous pairs: agents on clocks of their own, without a runtime.
//!
//! In: agents, laws, faults. Out: their published states and sums at a common time. Never here: figures.

pub(super) mod bench;
mod penalty;
pub(super) mod play;
