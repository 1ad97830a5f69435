//! Time, numbers of agents, ranges of numbers, published states and linear algebra that every part of metachron shares.
//!
//! In: plain values. Out: types that models write and that contact, drawing and reports read.
//! Never here: a clock, a thread, a file, the GPU, a model of physics, a shape.
//!
//! ```
//! use metachron_core::{HASH_START, SimSpan, SimTime, Snapshot};
//!
//! let step = SimSpan::from_secs_f64(1.0 / 240.0).unwrap();
//! let mut now = SimTime::ZERO;
//! for _ in 0..240 {
//!     now += step;
//! }
//! // a span is rounded to a nanosecond: 240 of them end within 120 ns of a second
//! assert!((now.as_secs_f64() - 1.0).abs() < 121e-9);
//!
//! let before = Snapshot::default();
//! let later = Snapshot { time: now, ..Snapshot::default() };
//! assert_ne!(before.fold_hash(HASH_START), later.fold_hash(HASH_START));
//! ```

pub mod archive;
mod attachment;
pub mod body;
mod choice;
mod cluster_state;
mod contact;
mod disjoint_sets;
pub mod gains;
pub mod id;
mod inverse_mass;
pub mod kinds;
pub mod ledger;
mod local_model;
pub mod pair;
pub mod parallel;
mod range;
mod recycle;
mod removed;
pub mod resolution;
mod rotation;
mod sensor;
pub mod skyline_cholesky;
pub mod snapshot;
pub mod step;
pub mod step_doubling;
pub mod time;
pub mod wave;

pub use archive::{Archive, ArchiveError};
pub use attachment::{AttachmentEvent, AttachmentEventKind, AttachmentId};
pub use body::{
    Anchor, Body, Bounds, CurveState, GRASP_BELOW, Grasp, GraspOrientation, Grip, RigidState, SoftNodes, SoftState,
    ToolState,
};
pub use choice::NoSuchChoice;
pub use cluster_state::{ClusterSolves, ClusterState, SolveLevel};
pub use contact::{ContactPartner, ContactState, JointEffort, Wrench};
pub use disjoint_sets::DisjointSets;
pub use id::AgentId;
pub use inverse_mass::{InverseMass, inverse_of_free};
pub use ledger::{Ahead, Entry, Impulse, Ledger, Page, Scheduled, Site};
pub use local_model::{LocalBlock, LocalModel, LocalPartner};
pub use pair::{PairKind, PairState};
pub use parallel::{ParallelFor, PlainLoop};
pub use range::{NumberRange, OutOfRange, Ranges};
pub use recycle::recycled;
pub use removed::Removed;
pub use resolution::{N_MAX, Resolution, ResolutionRange};
pub use rotation::{shortest_turn, unit_rotation};
pub use sensor::SensorTouch;
pub use snapshot::{HASH_START, Inertia, Snapshot};
pub use step::{DT_MAX_S, StepError, StepReport, check_span};
pub use step_doubling::DRIFT_S;
pub use time::{SimSpan, SimTime};
pub use wave::Wave;
