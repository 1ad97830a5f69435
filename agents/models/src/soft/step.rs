//! The system of a soft body's step: linearly implicit Euler.
//!
//! In: a state. Out: the velocities a step later. Never here: snapshots, contacts. Theory: docs/theory/soft.md.

use super::body::SoftBody;
use super::system::Purpose;
use glam::{DMat3, DVec3};
use metachron_core::StepError;

/// No edge may turn or stretch in a substep by more than this share of its length: past it the linear forces are far off.
pub(super) const EDGE_CHANGE_MAX: f64 = 0.3;
/// The largest coordinate or speed accepted, metres or m/s: its square would soon overflow.
pub(super) const REACH_MAX: f64 = 1e9;

impl SoftBody {
    /// Solves for the velocities at the end of a substep of `h` seconds (eq. 1–4).
    pub(super) fn predict(&mut self, h: f64, purpose: Purpose) -> Result<(), &'static str> {
        self.assemble(h);
        self.solve_for_velocities(h, purpose)
    }

    /// The same of a system that is assembled.
    pub(super) fn solve_for_velocities(&mut self, h: f64, purpose: Purpose) -> Result<(), &'static str> {
        let Self { system, mesh, velocities, free, impulses, .. } = self;
        impulses.clear();
        let momenta = velocities.iter().zip(&mesh.mass_kg).map(|(v, mass)| *v * *mass);
        impulses.extend(momenta.zip(&system.forces).map(|(momentum, force)| momentum + *force * h));
        free.clone_from(velocities);
        system.solve(impulses, free, purpose)
    }

    /// Assembles the system of a substep of `h` seconds at the present positions.
    pub(super) fn assemble(&mut self, h: f64) {
        let Self { system, mesh, positions, spec, .. } = self;
        system.begin(h * (h + spec.material.damping_s));
        mesh.add(positions, system);
        let inertia = 1.0 + h * spec.material.damping_per_s;
        for (vertex, &mass) in mesh.mass_kg.iter().enumerate() {
            system.weigh(vertex, DMat3::from_diagonal(DVec3::splat(mass * inertia)));
            system.push(vertex as u32, spec.gravity * mass);
        }
    }

    pub(super) fn diverged(&self, what: &str, dt_s: f64) -> StepError {
        StepError::Diverged { model: self.spec.shape.model(), dt_s, what: what.to_owned() }
    }
}
