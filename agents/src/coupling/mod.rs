//! What touching bodies do to each other: laws only, no state of any agent.
//!
//! In: contacts, free velocities and how bodies answer impulses. Out: impulses. Never here: who touches whom (each model
//! finds its own contacts), threads, time. Theory: `docs/theory/contact.md`.

mod contact;
mod solver;

pub use contact::{Contact, PUSH_OUT_SHARE, Slots};
pub use solver::{Problem, Response, Settings, Solver, SolverReport};

#[cfg(test)]
mod tests;
