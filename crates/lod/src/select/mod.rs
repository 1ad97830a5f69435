//! Selection of a level for every object: the policies of the papers, the exact optima, and upper bounds.
//!
//! In: levels with a cost in ticks and a benefit, and a budget. Out: a level for every object, its certificate, and whether it fits.
//! Never here: clocks, the meaning of a tick, the origin of a benefit ([`crate::cost`]), allocation-free steady state ([`crate::adaptive`]
//! has that). Theory: `docs/theory/budget.md`, eq. 1 … 31.
//!
//! Every order is total: by exact ratio, then cost, then the object's id, then its level. So no answer depends on the order in which
//! objects were pushed, and equal inputs give bit-identical results.

pub mod barrier;
mod exact;
pub mod funkhouser;
pub mod gobbetti;
pub mod half;
mod hull;
pub mod incremental;
mod linear;
pub mod maciel;
pub mod marginal;
pub mod mason;
pub mod mason_flat;
mod passes;
mod problem;
pub mod rates;
mod ratio;
pub mod robin_hood;
pub mod threshold;
pub mod tree;
pub mod tree_exact;
pub mod water;

pub use exact::{TooHard, exact};
pub use hull::{Hulls, Step};
pub use linear::{Linear, linear};
pub use problem::{Entry, Level, Mode, Problem, Selection};
pub use ratio::Ratio;
