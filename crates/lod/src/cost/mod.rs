//! Cost and benefit of a level: models that are fitted to a machine, and heuristics of benefit.
//!
//! In: measured times, counts of polygons, vertices and pixels, an object's appearance on the screen. Out: costs and benefits for
//! [`crate::select`] and [`crate::adaptive`]. Never here: a measurement, a clock, a file. Theory: `docs/theory/budget.md`, sections 8 and
//! 9.

pub mod benefit;
pub mod curve;
pub mod fit;
pub mod overlap;
pub mod pipeline;
pub mod prior;
pub mod stages;
pub mod value;
