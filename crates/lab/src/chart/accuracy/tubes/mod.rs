//! The error of tubes against independent answers, a file a test.
//!
//! In: a method and its step. Out: an error and a cost. Never here: sheets and solids.

pub mod buckling;
pub mod cantilever;
pub mod catenary;
pub mod elastica;
pub mod end_moment;
pub mod four_point;
pub mod frequencies;
pub mod helix;
pub mod inflation;
pub mod swing;
