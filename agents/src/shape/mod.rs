//! Shapes without physics: solids, skeleton curves, meshes and their levels.

mod solid;

pub use solid::{Obstacle, Solid};
