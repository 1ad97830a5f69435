//! What is asked of control and what it answers: objects in view, levels, policies, plans.
//!
//! In: the appearance of objects, the wish of a user. Out: types of both. Never here: how a policy chooses.

pub mod level;
pub mod plan;
pub mod policy;
pub mod query;
pub mod status;
pub mod view;
