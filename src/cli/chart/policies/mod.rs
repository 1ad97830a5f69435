//! `chart policies`: the papers' experiments on frame budgets, as models in numbers: every policy before the same frames.

pub(super) mod auditorium;
pub(super) mod bound;
mod camera;
mod chooser;
mod closed_loop;
mod common;
pub(super) mod disturbed;
mod forest;
pub(super) mod grove;
mod hall;
mod machine;
mod metrics;
mod scene;
pub(super) mod selection;
pub(super) mod still;
pub(super) mod values;
pub(super) mod walkthrough;
