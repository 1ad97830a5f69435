//! How threads meet without waiting for each other: all of it but `ring` is run through every order of steps by `tests/loom`.
//!
//! In: what one thread writes, rests and wakes. Out: the newest of it, whole, to any thread. Never here: what the values mean, agents, clocks.

pub mod callers_turn;
mod dirty_set;
pub mod ring;
pub mod seqlock;
pub mod sleep;
pub mod slot;
mod sync;
pub mod table;
mod worker_wakeup;
