//! Interaction between agents: contact laws, the ledger between different clocks, and the prediction of a peer's motion.
//!
//! In: contacts, free velocities and how bodies respond to impulses; snapshots of neighbours. Out: impulses, and the ledgers that
//! record them. Never here: any model's own state, threads. Theory: `docs/theory/contact.md`, `docs/theory/coupling.md`.
//!
//! ```
//! use glam::DVec3;
//! use metachron_contact::{Contact, Problem, Settings, Solver};
//! use metachron_core::ContactJacobian;
//!
//! let mut jacobian = ContactJacobian::default();
//! jacobian.add_linear(0, 1.0);
//! let (normal, back_m_s) = (DVec3::Z, DVec3::ZERO);
//! let contact = Contact { key: 0, jacobian, normal, gap_m: 0.0, friction: 0.5, rebound_m_s: 0.0, back_m_s, age_s: 0.0 };
//! let settings = Settings { iterations: 1000, tolerance_m_s: 1e-9 };
//! let problem = Problem { contacts: &[contact], related_keys: &[], h_s: 0.01, mobilities: &[0.5], settings };
//! let mut velocities = [DVec3::new(2.0, 0.0, -1.0)]; // of a point of 2 kg
//! Solver::default().solve(&problem, &mut velocities, &mut |j: &mut [DVec3]| j.iter_mut().for_each(|j| *j /= 2.0));
//! // Coulomb: stopping 1 m/s along the normal takes 0.5 m/s from the sliding
//! assert!((velocities[0] - DVec3::new(1.5, 0.0, 0.0)).length() < 1e-6);
//! ```

pub mod agent;
pub mod asynchronous;
pub mod audit;
pub mod beside;
pub mod cluster;
pub mod contact;
pub mod crowd;
pub mod delassus;
pub mod exchange;
pub mod joint;
pub mod knock;
pub mod lasting;
pub mod law;
pub mod laws;
pub mod mates;
pub mod other;
pub mod presses;
pub mod solver;
pub mod stepper;
pub mod taken;
pub mod tank;

pub use agent::{Agent, AnchorSpring, IslandMember, Neighbour, StepContext};
pub use asynchronous::acknowledged;
pub use contact::{Contact, PUSH_OUT_SHARE};
pub use exchange::Exchange;
pub use knock::Knock;
pub use lasting::smooth;
pub use law::{Law, Link, OwnershipTraits, keep_step, owns};
pub use mates::Feet;
pub use mates::{Far, Mate, Mates, Owner, Pulled, Search};
pub use other::{Astray, Other, WAKE_M_S};
pub use presses::Presses;
pub use solver::inverse_mass;
pub use solver::{Problem, Response, Settings, Solver, SolverReport};

#[cfg(test)]
mod tests;
