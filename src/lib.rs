//! metachron: a real-time physics engine in which every object keeps its own time and the frame never waits.
//!
//! The map of the code is `docs/ARCHITECTURE.md`. The modules below do not import each other; `frame` and `cli` join them.

pub mod cli;
pub mod compositor;
pub mod control;
pub mod fit;
pub mod frame;
pub mod runtime;
pub mod scene;
pub mod tune;
pub mod world;
