//! Shapes without physics: solids, skeleton curves, meshes and their levels, and the contact points between collision shapes.
//!
//! In: solids, curves and meshes in their poses. Out: gaps and contact points, signed distances, closest points, triangles,
//! progressive meshes. Never here: motion, forces, agents, a file, the GPU. Theory: `docs/theory/contact.md`, eq. 1–12.
//!
//! ```
//! use glam::{DQuat, DVec3};
//! use metachron_geometry::narrow_phase::{NarrowPhaseScratch, gap};
//! use metachron_geometry::{CollisionShape, PlacedShape, ShapeKind, ShapePose, Solid, SolidShape};
//!
//! let kind = |solid| ShapeKind::Solid(SolidShape::new(solid, DVec3::ZERO).unwrap());
//! let [ball, block] = [Solid::Ball { radius_m: 0.5 }, Solid::Box { half_extents_m: DVec3::ONE }]
//!     .map(|solid| CollisionShape::new(kind(solid), 0.5));
//! let at = |form, x: f64| {
//!     let view = ShapePose::Solid { position: DVec3::X * x, rotation: DQuat::IDENTITY };
//!     PlacedShape { form, view }
//! };
//! let (normal, gap_m) = gap(&at(&ball, 1.75), &at(&block, 0.0), 1.0, &mut NarrowPhaseScratch::default()).unwrap();
//! assert!((gap_m - 0.25).abs() < 1e-6); // 1.75 m less half the box and the radius
//! assert!((normal - DVec3::X).length() < 1e-6); // from the box towards the ball
//! ```

pub mod aabb;
pub mod cage;
pub mod capsule_chain;
pub mod cells;
pub mod closest_points;
pub mod collision_shape;
pub mod contact_traits;
pub mod foliage;
pub mod furniture;
pub mod generate;
pub mod geodesic;
pub mod hull_corners;
pub mod mesh;
pub mod mesh_distance;
pub mod model;
pub mod motion;
pub mod narrow_phase;
pub mod parry_shapes;
pub mod patch;
pub mod primitive;
pub mod progressive_mesh;
pub mod render_curve;
pub mod signed_distance;
pub mod solid;
pub mod spatial_hash;
pub mod subdivision;
pub mod tetrahedra;
pub mod texture;
pub mod tool;
pub mod topology;

pub use aabb::Aabb;
pub use cage::{Cage, CageCell, Carried, cage_counts};
pub use cells::{Cell, Cells, CellsError, Exposure, Portal, Region, Side};
pub use closest_points::{near_segments, near_triangle};
pub use collision_shape::{
    CollisionShape, ContactSide, Place, PlacedShape, ShapeKind, ShapePose, SolidShape, SurfaceShape, Touch,
};
pub use contact_traits::{CollisionGroups, CombineRule, ContactTraits};
pub use foliage::{Foliage, FoliageCut, PieceKind, Stroke, TreeSpec, tree};
pub use generate::{Generator, generate, generate_surface};
pub use geodesic::geodesic_edges;
pub use hull_corners::hull_corners;
pub use mesh::{compound_mesh, creased_mesh, hull_mesh, painted_mesh};
pub use model::{Extent, Model, Placement, proxy};
pub use motion::Motion;
pub use narrow_phase::{StaticSolid, StaticSolidError, TouchKey, TouchKind};
pub use parry_shapes::ShapeError;
pub use parry_shapes::{Triangles, hull_triangles, mesh_triangles};
pub use primitive::{Primitive, PrimitiveMesh, PrimitiveVertex, Rounding};
pub use progressive_mesh::{Cut, ProgressiveMesh, ProgressiveMeshError};
pub use render_curve::{INTERVALS_MAX, Skeleton, SkinFrame, hermite, hermite_slope, intervals};
pub use solid::{COMPOUND_PARTS_MAX, CompoundPart, Obstacle, Solid};
pub use spatial_hash::{BoxGrid, Grid};
pub use subdivision::subdivided;
pub use tetrahedra::{Tetrahedra, TetrahedraFault, lone_faces};
pub use texture::{Pattern, Texture, Wrap};
pub use topology::is_closed;
pub use topology::{Branch, OpenEdge, branch, open_edge, opposed, pieces, welded};

pub use tool::{ToolPart, ToolShape};

#[cfg(test)]
mod signed_distance_tests;
