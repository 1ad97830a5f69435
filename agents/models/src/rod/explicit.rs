//! Substeps whose matrix has no elastic stiffness: symplectic Euler and XPBD.
//!
//! In: a state and the forces on it. Out: velocities after the forces (symplectic Euler) or after the constraints (XPBD),
//! contact included. External springs are implicit here too, so a stiff user spring does not shorten the step.
//! Never here: whether the step is short enough ([`super::method`]). Theory: docs/theory/rod.md, eq. 40–42.

use super::banded_ldl::Row;
use super::state::{DividedRod, RodMaterial, RodState};
use super::step::{Divergence, Stepper};
use super::sym3::Sym3;
use super::system::{Iterate, SubstepProblem, add_springs, gyrate, hold_ends};
use glam::DVec3;

impl Stepper {
    /// A substep of symplectic Euler: velocities from the forces at the start, positions from those velocities.
    pub(super) fn step_symplectic_euler(
        &mut self,
        now: &RodState,
        problem: &SubstepProblem<'_>,
    ) -> Result<(), Divergence> {
        self.assemble_light(now, problem, false);
        self.factor_and_solve()?;
        self.advance(now, problem, true);
        self.check_finite()
    }

    /// A substep of XPBD: gravity and external springs, then the constraints.
    pub(super) fn step_xpbd(&mut self, now: &RodState, problem: &SubstepProblem<'_>) -> Result<(), Divergence> {
        self.assemble_light(now, problem, true);
        self.factor_and_solve()?;
        let Self { rhs, projector, .. } = self;
        let rod = DividedRod { material: problem.material, division: problem.division };
        projector.project(now, rhs, rod, problem.h);
        self.advance(now, problem, true);
        self.check_finite()
    }

    /// The system of masses and springs alone; `lumped` with lumped node masses and no elastic forces (eq. 40).
    pub(super) fn assemble_light(&mut self, now: &RodState, problem: &SubstepProblem<'_>, lumped: bool) {
        let Self { rows, rhs, .. } = self;
        rows.resize(now.u.len(), Row::ZERO);
        rhs.resize(now.u.len(), DVec3::ZERO);
        fill_masses(problem, now, lumped, rows);
        if lumped {
            fill_weights(problem, now, rhs);
        } else {
            fill_forces(problem, now, rhs);
        }
        let iterate = Iterate { start: now, at: now, first: true };
        add_springs(problem, &iterate, rows, rhs);
        hold_ends(problem.material, rows, rhs);
    }

    fn check_finite(&self) -> Result<(), Divergence> {
        if self.next.is_finite() { Ok(()) } else { Err(Divergence { slot: None }) }
    }
}

/// (1 + h c) M in rows: consistent, or lumped.
fn fill_masses(problem: &SubstepProblem<'_>, at: &RodState, lumped: bool, rows: &mut [Row]) {
    let RodMaterial { mu, rotary, damping, .. } = *problem.material;
    let slow = 1.0 + problem.h * damping;
    let (own, beside) = if lumped { (0.5, 0.0) } else { (1.0 / 3.0, 1.0 / 6.0) };
    rows[0] = Row::ZERO;
    for (k, (&l, t)) in problem.division.length.iter().zip(&at.t).enumerate() {
        let (mass, turn) = (slow * mu * l, slow * rotary * l);
        rows[2 * k].diag += Sym3::identity(own * mass);
        rows[2 * k + 1] = Row { diag: Sym3::identity(turn) + Sym3::outer(*t, turn), ..Row::ZERO };
        rows[2 * k + 2] = Row { diag: Sym3::identity(own * mass), far: Sym3::identity(beside * mass), ..Row::ZERO };
    }
}

/// M v_n + h f(x_n), with consistent mass.
fn fill_forces(problem: &SubstepProblem<'_>, now: &RodState, rhs: &mut [DVec3]) {
    let RodMaterial { mu, rotary, .. } = *problem.material;
    let h = problem.h;
    rhs[0] = now.force[0] * h;
    for (k, (&l, &t)) in problem.division.length.iter().zip(&now.t).enumerate() {
        let (a, b, m) = (now.u[2 * k], now.u[2 * k + 2], mu * l / 6.0);
        rhs[2 * k] += (a * 2.0 + b) * m;
        rhs[2 * k + 1] = spin(now.u[2 * k + 1], t, rotary * l, h) + now.force[2 * k + 1] * h;
        rhs[2 * k + 2] = now.force[2 * k + 2] * h + (b * 2.0 + a) * m;
    }
}

/// M v_n + h · weight, with lumped mass.
fn fill_weights(problem: &SubstepProblem<'_>, now: &RodState, rhs: &mut [DVec3]) {
    let RodMaterial { mu, rotary, gravity, .. } = *problem.material;
    let h = problem.h;
    rhs[0] = DVec3::ZERO;
    for (k, (&l, &t)) in problem.division.length.iter().zip(&now.t).enumerate() {
        let half = 0.5 * mu * l;
        rhs[2 * k] += (now.u[2 * k] + gravity * h) * half;
        rhs[2 * k + 1] = spin(now.u[2 * k + 1], t, rotary * l, h);
        rhs[2 * k + 2] = (now.u[2 * k + 2] + gravity * h) * half;
    }
}

/// The angular momentum of a segment about its own centre, turned by its gyroscopic torque (eq. 19).
fn spin(w: DVec3, t: DVec3, rotary: f64, h: f64) -> DVec3 {
    let w = gyrate(w, t, h);
    (w + t * t.dot(w)) * rotary
}
