//! Soft bodies: sheets, solids and ropes as finite elements in double precision. Theory: `docs/theory/soft.md`.
//!
//! In: a [`SoftSpec`]. Out: a [`SoftBody`], an agent. Never here: other agents' states, contact.
//!
//! Unknowns of a step are the velocities of the vertices, a slot each. One substep builds and factors A = (1 + h c) M + h (h + b) K
//! (`fe_mesh`, `system`), solves for the velocities, and moves (`step`); in a cluster the body offers this matrix as a member (`member`).

mod archive;
mod bar;
mod bending;
mod body;
mod carrier;
mod deformation;
mod division;
mod fe_mesh;
mod gradients;
mod grid;
mod hexahedron;
mod lattice;
mod material;
mod member;
mod membrane;
mod meshed;
mod publish;
mod remesh;
mod removal;
mod sheet;
mod shell_bending;
mod skin;
mod spec;
mod step;
mod stress;
mod system;
#[cfg(test)]
mod tests;
mod tetrahedron;
mod touched;

pub use body::SoftBody;
pub use grid::Side;
pub use spec::{
    LENGTH, MATERIAL, MaterialLaw, NodeSpacing, RegionMaterial, SEGMENTS, SoftError, SoftMaterial, SoftShape, SoftSpec,
    VERTICES_MAX,
};
