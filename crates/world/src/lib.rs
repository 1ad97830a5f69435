//! A scene as a world that runs: the resolved scene, its start, its agents and their latest states.
//!
//! In: a [`Scene`] built in code, or read by another crate. Out: a [`World`].
//! Never here: TOML, a file, the GPU, a law of control.

mod assemble;
pub mod contact_laws;
pub mod couplings;
mod initial_overlap;
mod initial_shape;
pub mod kinds;
mod overlap;
mod scene;
mod world;

pub use assemble::{Govern, machine};
pub use initial_overlap::Moved;
pub use overlap::Overlap;
pub use scene::{
    Camera, GROUP_LEVELS_MAX, Gains, Group, Look, Machine, Member, ObjectCost, PaceWish, Probe, Scene, Scenery, Spec,
    Target, View,
};
pub use world::{Object, World, WorldError};
