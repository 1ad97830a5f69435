//! `chart policies`: the papers' experiments on frame budgets, on numeric scenes with a declared machine, and live.

pub(super) mod auditorium;
mod auditorium_model;
pub(super) mod bound;
mod camera;
mod chooser;
mod closed_loop;
mod common;
pub(super) mod disturbed;
pub(super) mod domes;
pub(super) mod every;
mod forest;
mod geodesic;
pub(super) mod grove;
pub(super) mod levels;
pub(super) mod library;
pub(super) mod live;
mod machine;
mod metrics;
pub(super) mod plates;
mod played;
pub(super) mod rooms;
pub(super) mod scanline;
mod scene;
pub(super) mod selection;
pub(super) mod still;
pub(super) mod values;
pub(super) mod walkthrough;
