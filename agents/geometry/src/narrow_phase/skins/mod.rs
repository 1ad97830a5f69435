//! Contacts of soft bodies' skins: their features by place, and what each of them meets.
//!
//! In: the vertices, edges and triangles of a skin. Out: their contacts. Never here: contacts of two blocks or strands.

pub mod skin_tree;
pub mod surface;
pub mod voronoi_regions;
