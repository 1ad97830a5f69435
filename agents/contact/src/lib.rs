//! Interaction between agents: contact laws, the ledger between different clocks, and the prediction of a peer's motion.
//!
//! In: contacts, free velocities and how bodies respond to impulses; snapshots of neighbours. Out: impulses, and the ledgers that
//! record them. Never here: any model's own state, threads. Theory: `docs/theory/contact.md`, `docs/theory/coupling.md`.

pub mod agent;
pub mod audit;
pub mod beside;
pub mod contact;
pub mod crowd;
pub mod delassus;
pub mod exchange;
pub mod knock;
pub mod lasting;
pub mod law;
pub mod laws;
pub mod mates;
pub mod other;
pub mod presses;
pub mod solver;
pub mod taken;
pub mod tank;

pub use agent::{Agent, AnchorSpring, Companion, Neighbour, StepContext};
pub use contact::{Contact, PUSH_OUT_SHARE};
pub use exchange::{Exchange, acknowledged};
pub use knock::Knock;
pub use lasting::smooth;
pub use law::{Law, Link, Standing, keep_step, owns};
pub use mates::Feet;
pub use mates::{Far, Mate, Mates, Owner, Pulled, Search};
pub use other::{Astray, Other, WAKE_M_S};
pub use presses::Presses;
pub use solver::inverse_mass;
pub use solver::{Problem, Response, Settings, Solver, SolverReport};

#[cfg(test)]
mod tests;
