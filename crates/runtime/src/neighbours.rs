//! Who may touch whom, and what an agent sees of its peers.
//!
//! In: published bounds and snapshots. Out: the neighbours of a turn. Never here: contacts, clusters' steps.

pub mod broad_phase;
pub mod observation;
