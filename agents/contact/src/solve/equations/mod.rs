//! The equations of a contact problem: rows with their laws and scales, the members' matrix with what contacts add to it.
//!
//! In: a problem. Out: residuals, and linear steps by a factor or by iterations. Never here: which step a level takes.

pub mod bound;
mod coupled;
pub mod gradients;
pub mod members;
pub mod rows;
mod scale;
pub mod skew;
pub mod system;
