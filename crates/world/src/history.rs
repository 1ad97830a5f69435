//! How a world goes on from where it was, and does again what was done to it: checkpoints, recordings, replays.
//!
//! In: a running world, or what one wrote. Out: the same, to the bit. Never here: what a command does.

pub mod checkpoint;
pub mod log;
pub mod output_file;
mod recorded;
pub mod recording;
mod replay;
mod saved;
