//! Selection of a level for every object: the policies of the papers, the exact optima, and upper bounds.
//!
//! In: levels with a cost in ticks and a benefit, and a budget. Out: a level for every object, its certificate, and whether it fits.
//! Never here: clocks, the meaning of a tick, the origin of a benefit ([`crate::cost`]), allocation-free steady state ([`crate::adaptive`]
//! has that). Theory: `docs/theory/budget.md`, eq. 1 … 31.
//!
//! Every order is total: by exact ratio, then cost, then the object's id, then its level. So no answer depends on the order in which
//! objects were pushed, and equal inputs give bit-identical results.

mod continuous;
mod groups;
mod separate;
mod statement;

pub use continuous::{barrier, gobbetti, rates, water};
pub use groups::{half, maciel, mason, mason_flat, tree, tree_exact};
pub use separate::{funkhouser, incremental, marginal, robin_hood, threshold};
pub use statement::exact::{TooHard, exact};
pub use statement::hull::{Hulls, Step};
pub use statement::linear::{Linear, linear};
pub use statement::problem::{Entry, Level, Mode, Problem, Selection};
pub use statement::ratio::Ratio;
