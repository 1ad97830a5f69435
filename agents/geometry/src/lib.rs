//! Shapes without physics: solids, meshes and their levels, and the contact points between collision shapes.
//!
//! In: solids, curves and meshes in their poses. Out: gaps and contact points, signed distances, closest points, triangles.
//! Never here: motion, forces, agents, a file, the GPU. Theory: `docs/theory/contact.md`, eq. 1–12.
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

pub mod narrow_phase;
mod solids;
mod space;
mod surfaces;

pub use narrow_phase::{StaticSolid, StaticSolidError, TouchKey, TouchKind};
pub use solids::collision_shape::{
    CollisionShape, ContactSide, Place, PlacedShape, ShapeKind, ShapePose, SolidShape, SurfaceShape, Touch,
};
pub use solids::contact_traits::{CollisionGroups, CombineRule, ContactTraits, FRICTION, RESTITUTION};
pub use solids::parry_shapes::{ShapeError, Triangles, hull_triangles, mesh_triangles};
pub use solids::solid::{COMPOUND_PARTS_MAX, CompoundPart, Obstacle, Solid};
pub use solids::{
    capsule_chain, collision_shape, contact_traits, mesh_distance, parry_shapes, signed_distance, solid, tool,
};
pub use space::aabb::Aabb;
pub use space::cells::{Cell, Cells, CellsError, Exposure, Portal, Region, Side};
pub use space::closest_points::{near_segments, near_triangle};
pub use space::spatial_hash::{BoxGrid, Grid};
pub use space::{aabb, cells, closest_points, spatial_hash};
pub use surfaces::cage::{Cage, CageCell, Carried, Halving, HangingNode, cage_counts};
pub use surfaces::hull_corners::hull_corners;
pub use surfaces::mesh::{compound_mesh, creased_mesh, hull_mesh, painted_mesh};
pub use surfaces::primitive::{Primitive, PrimitiveMesh, PrimitiveVertex, Rounding};
pub use surfaces::subdivision::subdivided;
pub use surfaces::tetrahedra::{Tetrahedra, TetrahedraFault, lone_faces};
pub use surfaces::topology::{Branch, OpenEdge, branch, is_closed, open_edge, opposed, pieces, welded};
pub use surfaces::{cage, hull_corners, mesh, patch, primitive, subdivision, tetrahedra, topology};

pub use solids::tool::{ToolPart, ToolShape};
