//! What is in a scene: objects, materials, ties and choices, as code or another crate describes them.
//!
//! In: values of a builder. Out: a scene whose every value is checked. Never here: models, agents, a running world.

pub mod appearance;
pub mod builder;
pub mod couplings;
pub mod placement;
pub mod scene;
#[cfg(feature = "scenery")]
pub mod scenery;
pub mod sensor;
pub mod spec;
pub mod target;

pub use metachron_core::kinds;
