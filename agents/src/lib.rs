//! Physics models that can live as autonomous agents.
//!
//! In: step lengths and what an agent sees of the others. Out: states, as [`Snapshot`]s.
//! Never here: a clock, a thread, a file, the GPU. Theory: `docs/theory/rod.md`.

mod agent;
mod body;
pub mod conformance;
pub mod coupling;
mod drift;
mod envelope;
mod id;
mod impulse_response;
pub mod instrument;
mod rare;
mod resolution;
pub mod rigid;
pub mod rod;
pub mod shape;
mod snapshot;
pub mod soft;
mod step;
pub mod synthetic;
mod time;

pub use agent::{Agent, Companion, Neighbour, Pull, Surroundings};
pub use body::{Anchor, Body, Bounds, Clasp, CurveState, GRASP_BELOW, Grasp, Grip, RigidState, SoftState, ToolState};
pub use drift::DRIFT_S;
pub use id::AgentId;
pub use impulse_response::{CurveResponse, ImpulseResponse};
pub use rare::Rare;
pub use resolution::{N_MAX, Resolution, ResolutionRange};
pub use snapshot::{HASH_START, Inertia, LiesOn, Snapshot, Stand, Tips, Upheld};
pub use step::{DT_MAX_S, StepError, StepReport, check_span};
pub use time::{SimSpan, SimTime};
