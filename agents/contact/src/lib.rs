//! Interaction between agents: contact laws, the ledger between different clocks, and the prediction of a peer's motion.
//!
//! In: contacts, free velocities and how bodies respond to impulses; snapshots of neighbours. Out: impulses, and the ledgers that
//! record them. Never here: any model's own state, threads. Theory: `docs/theory/contact.md`, `docs/theory/coupling.md`.
//!
pub mod agent;
pub mod audit;
pub mod cluster;
pub mod exchange;
pub mod joint;
pub mod law;
pub mod laws;
pub mod push_out;
pub mod stepper;
pub mod taken;
pub mod tank;

pub use agent::{Agent, AnchorSpring, Neighbour, StepContext};
pub use exchange::{Exchange, acknowledged};
pub use law::{Law, Link};
pub use push_out::PUSH_OUT_SHARE;
