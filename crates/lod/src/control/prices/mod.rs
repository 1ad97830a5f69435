//! What a level costs and what it gains.
//!
//! In: measured frames and the sizes of objects. Out: a ladder of levels for each object, with prices and benefits. Never here: the choice.

pub mod area;
pub mod benefit;
pub mod ladder;
pub mod logic;
pub mod price;
pub mod serial;
