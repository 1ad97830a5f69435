//! Executors, which make turns: threads, a pool of workers, one thread in virtual time, one that follows a recorded order; and ghosts, whose turns are made elsewhere.
//!
//! In: agents that were introduced to each other. Out: runs, saved and read back. Never here: what a turn does.

pub mod archive;
#[cfg(test)]
mod executor_tests;
pub mod follower;
pub mod ghosts;
#[cfg(test)]
mod live_tests;
pub mod lockstep;
pub mod pool;
pub mod priority;
pub mod side_by_side;
#[cfg(test)]
pub mod testing;
pub mod threads;
