//! What the camera sees, and how large: bounds, portals, visibility, rays.
//!
//! In: a camera, shapes in their places. Out: what may be seen, its size and speed on the screen. Never here: triangles, the GPU.

mod bounds_tree;
pub mod level;
pub mod pick;
mod portals;
pub mod view;
pub mod visibility;
