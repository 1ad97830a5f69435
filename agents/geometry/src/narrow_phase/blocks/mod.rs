//! Contacts of blocks: the distance of two convex parts, and where they rest on each other.
//!
//! In: convex parts and triangles. Out: their contacts. Never here: strands, skins.

pub mod convex_convex;
pub mod epa;
pub mod gjk;
pub mod mesh_convex;
