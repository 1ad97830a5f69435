//! metachron: a real-time physics engine in which every object keeps its own time and the frame never waits.
//!
//! In: a scene, built in code or read from a file. Out: a [`world::World`] that runs, read from any thread.
//! Never here: code of its own. This crate re-exports the others; the map of them is `docs/ARCHITECTURE.md`.

#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "scene")]
pub mod scenes;

pub use metachron_contact as contact;
pub use metachron_core as core;
pub use metachron_geometry as geometry;
#[cfg(feature = "lab")]
pub use metachron_lab as lab;
pub use metachron_models as models;
#[cfg(feature = "render")]
pub use metachron_render as render;
pub use metachron_runtime as runtime;
#[cfg(feature = "scene")]
pub use metachron_scene as scene;
#[cfg(feature = "scene")]
pub use metachron_session as session;
#[cfg(feature = "viewer")]
pub use metachron_viewer as viewer;
pub use metachron_world as world;

/// What a program that builds and runs a scene needs.
pub mod prelude {
    pub use metachron_core::{AgentId, Anchor, Body, Resolution, ResolutionRange, SimSpan, SimTime, Snapshot};
    pub use metachron_geometry::Solid;
    pub use metachron_world::{Object, Scene, World, WorldError, kinds::ExecutorKind};
}
