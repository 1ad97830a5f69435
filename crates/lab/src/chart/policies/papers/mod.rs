//! The experiments of the papers on frame budgets, a file each.
//!
//! In: a case of a paper. Out: its row and its figure. Never here: comparisons that no paper has.

pub mod auditorium;
pub mod domes;
pub mod grove;
pub mod levels;
pub mod library;
pub mod rooms;
pub mod scanline;
pub mod values;
pub mod walkthrough;
