//! Contacts of strands: with each other, with blocks, with themselves.
//!
//! In: balls joined by spans. Out: their contacts. Never here: skins, contacts of two blocks.

pub mod chain_chain;
pub mod chain_convex;
pub mod self_chain;
