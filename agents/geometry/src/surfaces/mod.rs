//! Which triangles and cells make up a body: meshes of solids, their edges, their division, cages around them.
//!
//! In: solids and meshes. Out: meshes whose faults are named. Never here: distances, how a mesh is drawn.

pub mod cage;
pub mod hull_corners;
pub mod mesh;
pub mod patch;
pub mod primitive;
pub mod subdivision;
pub mod tetrahedra;
pub mod topology;
