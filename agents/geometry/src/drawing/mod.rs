//! What is only drawn: meshes from formulas, textures, foliage, curves of tubes, meshes of any number of triangles.
//!
//! In: formulas, seeds, meshes. Out: meshes and textures for pictures. Never here: a shape that physics meets.

pub mod foliage;
pub mod furniture;
pub mod generate;
pub mod geodesic;
pub mod model;
pub mod motion;
pub mod progressive_mesh;
pub mod render_curve;
pub mod texture;
