//! Policies that choose for each object by itself, a file an author.
//!
//! In: a problem. Out: a level for each object. Never here: groups.

pub mod funkhouser;
pub mod incremental;
pub mod marginal;
pub mod passes;
pub mod robin_hood;
pub mod threshold;
