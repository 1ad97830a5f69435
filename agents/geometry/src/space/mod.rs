//! What is near what: boxes, grids, closest points, the rooms of a building.
//!
//! In: points, segments, boxes. Out: which of them are near, and where nearest. Never here: shapes of bodies.

pub mod aabb;
pub mod cells;
pub mod closest_points;
pub mod spatial_hash;
