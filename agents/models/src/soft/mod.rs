//! Soft bodies: sheets, solids and ropes as finite elements in double precision. Theory: `docs/theory/soft.md`.
//!
//! In: a [`SoftSpec`]. Out: a [`SoftBody`], an agent. Never here: other agents' states, beyond those that touch or pull this one.
//!
//! Unknowns of a step are the velocities of the vertices, a slot each. One substep builds and factors A = M + h c M + h² K
//! (`elements`, `system`), solves for the free velocities, applies contacts through A⁻¹ (`contact`), and moves (`step`).

mod anchor_springs;
mod bar;
mod bending;
mod body;
mod company;
mod contact;
mod fe_mesh;
mod footing;
mod foretold;
mod grid;
mod hexahedron;
mod inertia;
mod initial_overlap;
mod member;
mod membrane;
mod publish;
mod spec;
mod step;
mod step_doubling;
mod system;
#[cfg(test)]
mod tests;

pub use body::SoftBody;
pub use grid::Side;
pub use inertia::SoftInertia;
pub use spec::{SoftError, SoftMatter, SoftShape, SoftSpec, VERTICES_MAX};
