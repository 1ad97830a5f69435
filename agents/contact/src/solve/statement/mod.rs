//! What a contact problem is, as plain data, and when it is refused.
//!
//! In: members, contacts, rows of joints. Out: the same, checked. Never here: unknowns of a solve.

pub mod error;
pub mod joint;
pub mod problem;
pub mod side;
pub mod validate;
