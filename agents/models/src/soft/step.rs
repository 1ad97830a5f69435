//! One substep of a soft body: linearly implicit Euler.
//!
//! In: a state and the springs on it. Out: the state a substep later. Never here: snapshots, rest. Theory: docs/theory/soft.md.

use super::body::SoftBody;
use super::system::Purpose;
use glam::{DMat3, DVec3};
use metachron_contact::StepContext;
use metachron_core::StepError;

/// No edge may turn or stretch in a substep by more than this share of its length: past it the linear forces are far off.
pub(super) const EDGE_CHANGE_MAX: f64 = 0.3;
/// The largest coordinate or speed accepted, metres or m/s: its square would soon overflow.
pub(super) const REACH_MAX: f64 = 1e9;
/// The most substeps of a step.
pub(super) const SUBSTEPS_MAX: u32 = 16;

impl SoftBody {
    /// Advances by `dt` seconds; returns the number of substeps, and how many more its error estimate took.
    ///
    /// # Errors
    /// [`StepError::Diverged`] where the state stops being finite.
    pub(super) fn advance(&mut self, context: &StepContext<'_>, dt: f64) -> Result<(u32, u32), StepError> {
        self.gather_springs(context);
        let doubled = self.repeat_step(context.me, dt);
        let (mut parts, mut left, mut done) = (1_u32, 1_u32, 0_u32);
        while left > 0 {
            let h = dt / f64::from(parts);
            self.predict(h, Purpose::Own).map_err(|what| self.diverged(what, dt))?;
            if self.mesh.edge_change(|vertex| self.free[vertex as usize], h) > EDGE_CHANGE_MAX && parts < SUBSTEPS_MAX {
                (parts, left) = (2 * parts, 2 * left);
                continue;
            }
            if !self.free.iter().all(|v| v.is_finite() && v.abs().max_element() <= REACH_MAX) {
                return Err(self.diverged("a vertex left the coordinate range", dt));
            }
            self.finish_substep(h);
            (left, done) = (left - 1, done + 1);
        }
        self.estimate_error(dt, done);
        Ok((done, doubled))
    }

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
        let Self { system, mesh, positions, spec, ties, .. } = self;
        system.begin(h * (h + spec.matter.damping_s));
        mesh.add(positions, system);
        let inertia = 1.0 + h * spec.matter.damping_per_s;
        for (vertex, &mass) in mesh.mass_kg.iter().enumerate() {
            system.weigh(vertex, DMat3::from_diagonal(DVec3::splat(mass * inertia)));
            system.push(vertex as u32, spec.gravity * mass);
        }
        ties.iter_mut().for_each(|tie| tie.add(positions, h, system));
    }

    /// Moves with the predicted velocities.
    pub(super) fn finish_substep(&mut self, h: f64) {
        let Self { positions, velocities, free, ties, .. } = self;
        std::mem::swap(velocities, free);
        positions.iter_mut().zip(&*velocities).for_each(|(x, v)| *x += *v * h);
        ties.iter_mut().for_each(|tie| tie.book(velocities, h));
    }

    pub(super) fn diverged(&self, what: &str, dt_s: f64) -> StepError {
        StepError::Diverged { model: self.spec.shape.model(), dt_s, what: what.to_owned() }
    }
}
