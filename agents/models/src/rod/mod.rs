//! The tube: a staggered Cosserat rod. Theory: `docs/theory/rod.md`.
//!
//! In: a [`TubeSpec`]. Out: a [`Tube`], an agent. Never here: other agents' states, beyond their effects on this one.
//!
//! Unknowns of a step are velocities in *slots*: node k at 2k, segment k (its spin) at 2k + 1.
//! One substep builds and factors A = M + h (c M + D) + h² K (`system`, `band`), solves for the free velocities v* and
//! moves along them (`step`).
//! Contacts are not part of it: in a cluster the tube offers this matrix, with its factor, as a member (`member`).

mod anchor_springs;
mod archive;
mod banded_ldl;
mod block;
mod check;
mod discretization;
mod energy_limiter;
mod energy_momentum;
mod explicit;
mod history;
mod member;
mod method;
mod pressure;
mod publish;
mod remesh;
mod residual;
mod rest;
mod rest_curve;
mod rotation;
mod second_order;
mod spec;
mod state;
mod step;
mod stress;
mod sym3;
mod system;
#[cfg(test)]
mod tests;
mod tube;
mod wall;
mod work_size;
mod xpbd;

pub use check::TubeError;
pub use discretization::{SEGMENTS_MAX, SEGMENTS_MIN};
pub use pressure::PressureKey;
pub use spec::{Attachment, Integrator, LIMITS, Material, Peristalsis, Section, TubeSpec, WallModel};
pub use tube::{STRETCH_WARN, Tube, pressed_radius_m};

/// The most substeps a scene may request per step: past it a step no longer runs in real time.
pub const SUBSTEPS_MAX: u32 = 1000;
