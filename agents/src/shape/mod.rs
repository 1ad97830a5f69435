//! Shapes without physics: solids, skeleton curves, meshes and their levels.

mod convert;
pub(crate) mod field;
mod mesh_field;
mod near;
mod solid;

pub use convert::ShapeError;
pub(crate) use near::near_segments;
pub use solid::{Obstacle, Solid};

#[cfg(test)]
mod field_tests;
