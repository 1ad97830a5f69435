//! Interaction between agents: contact laws, the ledger between different clocks, and the prediction of a peer's motion.
//!
//! In: contacts, free velocities and how bodies respond to impulses; snapshots of neighbours. Out: impulses, and the ledgers that
//! record them. Never here: any model's own state, threads. Theory: `docs/theory/contact.md`, `docs/theory/coupling.md`.

pub mod audit;
pub mod beside;
mod contact;
pub mod crowd;
mod exchange;
mod foot;
mod form;
mod formed;
mod knock;
mod lasting;
mod law;
pub mod laws;
mod ledger;
mod mates;
mod other;
mod presses;
mod rebound;
mod six;
mod solver;
mod sprung;
mod taken;
pub mod tank;
pub mod touch;

pub use contact::{Contact, PUSH_OUT_SHARE, Slots};
pub use exchange::{Exchange, PairKind, PairState, acknowledged};
pub(crate) use foot::{Carried, Foot, Lies, Stance, is_borne, press};
pub use form::{Form, FormKind, Place, Placed, SolidForm, SurfaceForm, Touch, View, height_j_kg};
pub(crate) use knock::Knock;
pub use lasting::smooth;
pub use law::{Law, Link, Standing, keep_step, owns};
pub use ledger::{Ahead, Coming, Entry, Impulse, Ledger, Page, Site};
pub(crate) use mates::Feet;
pub use mates::{Far, Mate, Mates, Owner, Pulled, Search};
pub use other::{Astray, Other, WAKE_M_S};
pub use presses::Presses;
pub use rebound::Rebound;
pub(crate) use rebound::{since_s, spared};
pub use six::{Six, Twist};
pub(crate) use solver::inverse_mass;
pub use solver::{Problem, Response, Settings, Solver, SolverReport};
pub use sprung::Sprung;

#[cfg(test)]
pub(crate) mod harness;
#[cfg(test)]
mod tests;
