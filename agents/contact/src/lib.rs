//! Interaction between agents: contact laws, the ledger between different clocks, and the prediction of a peer's motion.
//!
//! In: contacts, free velocities and how bodies respond to impulses; snapshots of neighbours. Out: impulses, and the ledgers that
//! record them. Never here: any model's own state, threads. Theory: `docs/theory/contact.md`, `docs/theory/coupling.md`.
//!
//! ```
//! use glam::DVec3;
//! use metachron_contact::{Contact, Problem, Response, Settings, Solver};
//! use metachron_core::ContactJacobian;
//!
//! /// A point of 2 kg.
//! struct Point;
//! impl Response for Point {
//!     fn respond(&mut self, impulses: &mut [DVec3]) {
//!         impulses.iter_mut().for_each(|impulse| *impulse *= 0.5);
//!     }
//! }
//!
//! let mut slots = ContactJacobian::default();
//! slots.add_linear(0, 1.0);
//! let contact = Contact {
//!     key: 0, slots, normal: DVec3::Z, gap_m: 0.0, friction: 0.5, rebound_m_s: 0.0, back_m_s: DVec3::ZERO, age_s: 0.0,
//! };
//! let settings = Settings { iterations: 1000, tolerance_m_s: 1e-9 };
//! let problem = Problem { contacts: &[contact], kin: &[], h_s: 0.01, mobilities: &[0.5], settings };
//! let mut velocities = [DVec3::new(0.2, 0.0, -1.0)];
//! Solver::forming().solve(&problem, &mut velocities, &mut Point);
//! // the cone allows half of the normal impulse across: more than enough to stop the point
//! assert!(velocities[0].length() < 1e-6);
//! ```

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
