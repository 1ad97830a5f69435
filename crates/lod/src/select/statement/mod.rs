//! What is to be chosen, and how good a choice can be: the problem, its hulls, its optimum and its bound.
//!
//! In: levels with costs and benefits, a budget. Out: the same as a problem, its exact answer, its relaxation. Never here: a policy of a paper.

pub mod exact;
pub mod hull;
pub mod linear;
pub mod problem;
pub mod ratio;
