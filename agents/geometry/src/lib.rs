//! Shapes without physics: solids, skeleton curves, meshes and their levels.

pub mod capsule_chain;
pub mod closest_points;
pub mod collision_shape;
pub mod foliage;
pub mod furniture;
pub mod generate;
pub mod geodesic;
pub mod mesh;
pub mod mesh_distance;
pub mod model;
pub mod narrow_phase;
pub mod parry_shapes;
pub mod patch;
pub mod primitive;
pub mod progressive_mesh;
pub mod render_curve;
pub mod signed_distance;
pub mod solid;
pub mod spatial_hash;
pub mod texture;
pub mod tool;
pub mod topology;

pub use closest_points::{near_segments, near_triangle};
pub use collision_shape::{
    CollisionShape, Place, PlacedShape, ShapeKind, ShapePose, SolidShape, SurfaceShape, Touch, height_j_kg,
};
pub use foliage::{Foliage, Prefix, Rung, Stroke, TreeSpec, tree};
pub use generate::{Generator, generate};
pub use geodesic::geodesic_edges;
pub use mesh::{creased_mesh, hull_mesh, painted_mesh};
pub use model::{Extent, Model, Placement, proxy};
pub use parry_shapes::ShapeError;
pub use parry_shapes::{Triangles, bounds, hull_triangles, mesh_triangles};
pub use primitive::{Primitive, PrimitiveMesh, PrimitiveVertex, Rounding};
pub use progressive_mesh::{Cut, ProgressiveMesh, ProgressiveMeshError};
pub use render_curve::{INTERVALS_MAX, Skeleton, SkinFrame, hermite, hermite_slope, intervals};
pub use solid::{Obstacle, Solid};
pub use spatial_hash::Grid;
pub use texture::{Pattern, Texture, Wrap};
pub use topology::is_closed;
pub use topology::{Branch, branch};

pub use tool::{ToolPart, ToolShape};

/// Ways out of a solid whose cosine is below this have none in common: what starts inside would be torn apart on them.
pub const PARTED: f64 = 0.5;

#[cfg(test)]
mod signed_distance_tests;
