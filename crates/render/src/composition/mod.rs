//! What of a scene is drawn, as flat arrays that a renderer uploads unchanged.
//!
//! In: poses and levels. Out: a picture of instances, curves, skins, forces and light. Never here: the GPU, the choice of a level.

pub mod compose;
pub mod environment;
pub mod forces;
mod instances;
pub mod light_volume;
pub mod lod_transition;
pub mod mesh_corner;
pub mod picture;
pub mod skin;
pub mod tessellation;
pub mod texturing;
