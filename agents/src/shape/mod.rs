//! Shapes without physics: solids, skeleton curves, meshes and their levels.

mod convert;
mod solid;

pub use convert::ShapeError;
pub use solid::{Obstacle, Solid};
