//! The levels of a solution: Newton's steps, interior points, the guard behind them, and how all answers once they stand.
//!
//! In: equations and an iterate. Out: a better iterate. Never here: which level comes next.

pub mod held;
pub mod interior;
pub mod iterate;
pub mod newton;
pub mod passivity;
