//! Models of matter as agents: rigid bodies, elastic tubes, soft bodies, driven tools.
//!
//! In: step lengths and what an agent sees of the others. Out: states, as snapshots.
//! Never here: a clock, a thread, a file, the GPU. Theory: `docs/theory/rod.md`, `docs/theory/soft.md`.

pub mod conformance;
#[cfg(test)]
mod harness;
pub mod rigid;
pub mod rod;
pub mod soft;
pub mod synthetic;
pub mod tool;
