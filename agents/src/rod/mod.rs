//! The tube: a staggered Cosserat rod. Theory: `docs/theory/rod.md`.
//!
//! In: a [`TubeSpec`]. Out: a [`Tube`], an agent. Never here: other agents' states, beyond their effects on this one.
//!
//! Unknowns of a step are velocities in *slots*: node k at 2k, segment k (its spin) at 2k + 1.
//! One substep builds and factors A = M + h (c M + D) + h² K (`system`, `band`), solves for the free velocities v* and
//! moves along them (`step`).
//! **Interface to contacts:** between solve and move. `band::Factor::solve` turns an impulse in slots into the velocity it
//! causes, Δv = A⁻¹ Jᵀ λ, in one O(N) sweep; `band::Factor::inverse_blocks` gives the blocks of A⁻¹ that make
//! W = J A⁻¹ Jᵀ (1/kg) of any single contact, in one O(N) sweep. Contacts correct the velocity after the solve;
//! the energy that a push-out adds is external work and enters the energy check of the substep.

mod band;
mod block;
mod calm;
mod check;
mod company;
mod config;
mod conserve;
mod contact;
mod division;
mod doubling;
mod extent;
mod footing;
mod holds;
mod horizon;
mod inertia;
mod light;
mod meet;
mod method;
mod past;
mod project;
mod publish;
mod receive;
mod remesh;
mod residual;
mod rest;
mod sided;
mod skeleton;
mod smooth;
mod spec;
mod step;
mod sym3;
mod system;
#[cfg(test)]
mod tests;
mod tube;
mod turn;

pub use check::TubeError;
pub use division::{SEGMENTS_MAX, SEGMENTS_MIN};
pub use inertia::CurveInertia;
pub use method::Integrator;
pub use spec::{Attachment, Material, Peristalsis, Section, TubeSpec};
pub use tube::{STRETCH_WARN, Tube, pressed_radius_m};

/// The most substeps a scene may request per step: past it a step no longer runs in real time.
pub const SUBSTEPS_MAX: u32 = 1000;
