//! The tube: a staggered Cosserat rod. Theory: `docs/theory/rod.md`.
//!
//! In: a [`TubeSpec`]. Out: a [`Tube`], an agent. Never here: other agents' states, beyond their effects on this one.
//!
//! Unknowns of a step are velocities in *slots*: node k at 2k, segment k (its spin) at 2k + 1.
//! One substep builds and factors A = M + h (c M + D) + h² K (`system`, `band`), solves for the free velocities v* and
//! moves along them (`step`).
//! **Where contacts act:** between solve and move. `banded_ldl::Factor::solve` answers an impulse in slots with the velocity it
//! causes, Δv = A⁻¹ Jᵀ λ, in one O(N) sweep; `banded_ldl::Factor::inverse_blocks` gives the blocks of A⁻¹ that make
//! W = J A⁻¹ Jᵀ (1/kg) of any single contact, in one O(N) sweep. Contacts correct the velocity after the solve;
//! the energy that a push-out adds is external work and enters the energy check of the substep.

mod anchor_springs;
mod apply_impulses;
mod banded_ldl;
mod begin_step;
mod block;
mod check;
mod company;
mod contact;
mod discretization;
mod energy_limiter;
mod energy_momentum;
mod explicit;
mod footing;
mod history;
mod horizon;
mod inertia;
mod member;
mod method;
mod publish;
mod remesh;
mod residual;
mod rest;
mod rest_curve;
mod rotation;
mod second_order;
mod sided;
mod spec;
mod state;
mod step;
mod step_doubling;
mod substep;
mod sym3;
mod system;
#[cfg(test)]
mod tests;
mod tube;
mod work_size;
mod xpbd;

pub use check::TubeError;
pub use discretization::{SEGMENTS_MAX, SEGMENTS_MIN};
pub use inertia::CurveInertia;
pub use method::Integrator;
pub use spec::{Attachment, Material, Peristalsis, Section, TubeSpec};
pub use tube::{STRETCH_WARN, Tube, pressed_radius_m};

/// The most substeps a scene may request per step: past it a step no longer runs in real time.
pub const SUBSTEPS_MAX: u32 = 1000;
