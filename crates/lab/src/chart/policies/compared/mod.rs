//! What all policies are compared by beyond the papers: bounds, disturbances, time, stillness.
//!
//! In: policies by name. Out: rows and figures. Never here: the experiments of the papers.

pub mod bound;
pub mod disturbed;
pub mod every;
pub mod selection;
pub mod still;
