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

pub(crate) use camera::{Path, key};
pub(crate) use chooser::Policy;
pub(crate) use closed_loop::{Frame, Show};
pub(crate) use common::{Case, LEVEL_PARTS, curves, number};
pub(crate) use forest::{CameraPath, Forms};
pub(crate) use geodesic::{DOMES, STRUTS};
pub(crate) use machine::{Fault, RandomSource};
pub(crate) use metrics::{Row, deviation95, error_over_allowed, mean, overshoot, predicts, settled, within};
pub(crate) use scene::{BenefitModel, ObjectLevel, Scene, SceneObject};
