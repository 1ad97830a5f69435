//! What the numeric experiments are played with: scenes and machines as numbers, policies by name, the loop, its metrics.
//!
//! In: a scene, a machine, a policy. Out: the frames of a run, measured. Never here: an experiment.

pub mod auditorium_model;
pub mod camera;
pub mod chooser;
pub mod closed_loop;
pub mod common;
pub mod forest;
pub mod geodesic;
pub mod machine;
pub mod metrics;
pub mod scene;
