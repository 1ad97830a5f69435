//! Shapes without physics: solids, skeleton curves, meshes and their levels.

mod convert;
mod curve;
mod edges;
pub(crate) mod field;
mod foliage;
mod furniture;
mod generate;
mod geodesic;
mod grid;
mod mesh;
mod mesh_field;
mod model;
mod near;
pub mod patch;
mod primitive;
mod solid;
pub(crate) mod strand;
mod texture;
mod tom;
mod tool;

pub use convert::ShapeError;
pub(crate) use convert::{Triangles, bounds, hull_triangles, mesh_triangles};
pub use curve::{INTERVALS_MAX, Skeleton, SkinFrame, hermite, hermite_slope, intervals};
pub(crate) use edges::is_closed;
pub use edges::{Branch, branch};
pub use foliage::{Foliage, Prefix, Rung, Stroke, TreeSpec, tree};
pub use generate::{Generator, generate};
pub use geodesic::geodesic_edges;
pub(crate) use grid::Grid;
pub use mesh::{creased_mesh, hull_mesh, painted_mesh};
pub use model::{Extent, Model, Placement, proxy};
pub(crate) use near::{near_segments, near_triangle};
pub use primitive::{Primitive, PrimitiveMesh, PrimitiveVertex, Rounding};
pub use solid::{Obstacle, Solid};
pub use texture::{Pattern, Texture, Wrap};
pub use tom::{Cut, Tom, TomError};
pub use tool::{ToolPart, ToolShape};

/// Exit normals of a solid with a cosine below this are incompatible: a body that starts inside would be torn apart along them.
pub(crate) const PARTED: f64 = 0.5;

#[cfg(test)]
mod field_tests;
