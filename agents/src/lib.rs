//! Physics models that run as autonomous agents.
//!
//! In: step lengths and the published states of the other agents. Out: states, as [`Snapshot`]s.
//! Never here: a clock, a thread, a file, the GPU. Theory: `docs/theory/rod.md`.

mod agent;
pub mod conformance;
pub mod coupling;
mod drift;
mod envelope;
pub mod instrument;
mod rare;
mod resolution;
pub mod rigid;
pub mod rod;
pub mod shape;
mod snapshot;
pub mod soft;
pub mod synthetic;
mod time;

pub use agent::{
    Agent, AgentId, Companion, DT_MAX_S, Neighbour, Pull, StepError, StepReport, Surroundings, check_span,
};
pub use drift::DRIFT_S;
pub use rare::Rare;
pub use resolution::{N_MAX, Resolution, ResolutionRange};
pub use snapshot::{
    Anchor, Body, Bounds, Clasp, CurveState, Grasp, Grip, HASH_START, Inertia, LiesOn, RigidState, Snapshot, SoftState,
    Stand, Tips, ToolState, Upheld,
};
pub use time::{SimSpan, SimTime};
