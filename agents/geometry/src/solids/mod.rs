//! What shape a body has for contact, and how far a point is from it.
//!
//! In: sizes, hulls, triangles. Out: collision shapes with their traits, signed distances. Never here: contacts of two shapes.

pub mod capsule_chain;
pub mod collision_shape;
pub mod contact_traits;
pub mod mesh_distance;
pub mod parry_shapes;
pub mod signed_distance;
#[cfg(test)]
mod signed_distance_tests;
pub mod solid;
pub mod tool;
