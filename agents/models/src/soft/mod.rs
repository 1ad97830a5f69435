//! Soft bodies: sheets, solids and ropes as finite elements in double precision. Theory: `docs/theory/soft.md`.
//!
//! In: a [`SoftSpec`]. Out: a [`SoftBody`], an agent. Never here: other agents' states, contact.
//!
//! Unknowns of a step are the velocities of the vertices, a slot each. One substep builds and factors A = M + h c M + h² K
//! (`fe_mesh`, `system`), solves for the velocities, and moves (`step`); in a cluster the body offers this matrix as a member (`member`).

mod anchor_springs;
mod bar;
mod bending;
mod body;
mod carrier;
mod fe_mesh;
mod gradients;
mod grid;
mod hexahedron;
mod lattice;
mod member;
mod membrane;
mod publish;
mod remesh;
mod skin;
mod spec;
mod step;
mod step_doubling;
mod system;
#[cfg(test)]
mod tests;

pub use body::SoftBody;
pub use grid::Side;
pub use spec::{NodeSpacing, SoftError, SoftMatter, SoftShape, SoftSpec, VERTICES_MAX};
