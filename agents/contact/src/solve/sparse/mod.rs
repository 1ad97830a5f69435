//! Sparse factors of symmetric positive definite matrices: order, fronts, dense tiles.
//!
//! In: blocks of a matrix. Out: its factor and solutions with it. Never here: contacts, laws.

pub mod factor;
mod fronts;
mod order;
pub mod sparse_factor;
pub mod tiles;
