//! Substeps of second order: BDF2 and the energy-momentum rule, used where nothing external makes velocities jump.
//!
//! In: a state and the changes before it. Out: the next state, or a request for smaller substeps: where
//! the iteration does not converge, the substep is one of implicit Euler.
//! Never here: implicit Euler itself ([`super::step`]). Theory: docs/theory/rod.md, eq. 43–48.

use super::energy_momentum::fill_mean;
use super::rotation::{cayley, exp, unit};
use super::spec::Integrator;
use super::state::{RodMaterial, RodState};
use super::step::{Divergence, Stepper, TURN_MAX_RAD, Trial, Verdict};
use super::system::{Iterate, SubstepProblem, assemble, fill_matrix, hold_ends};

/// Newton iterations of BDF2 (least, most): with a single one it damps like implicit Euler, and an unconverged one never comes to rest.
const BDF2_ITERATIONS: (u32, u32) = (2, 6);
/// Converged where the change's kinetic energy is this share of the energies involved: speeds to 1e-4.
const BDF2_SLACK: f64 = 1e-8;
/// The most Newton iterations of the energy-momentum rule: one that needs more has stalled, and halving the substep is cheaper.
const MEAN_ITERATIONS: u32 = 12;
/// Converged where the change's kinetic energy is this share of the energies involved: speeds to 1e-7.
/// The remainder is energy, and a tube whose damping cannot dissipate it never rests.
const MEAN_SLACK: f64 = 1e-14;

impl Stepper {
    /// One trial substep of second order (eq. 43–48).
    pub(super) fn attempt_second_order(
        &mut self,
        now: &RodState,
        problem: &SubstepProblem<'_>,
        trial: Trial,
    ) -> Result<Verdict, Divergence> {
        let converged = match problem.integrator {
            Integrator::EnergyMomentum => self.solve_energy_momentum(now, problem),
            _ => self.solve_bdf2(now, problem),
        };
        let rise = self.energy_rise(now, problem);
        let converged = converged && rise <= self.past.reserve_j() && self.next.is_finite();
        if trial.bounds_turns && !(converged && self.farthest_turn(now) <= TURN_MAX_RAD) {
            return Ok(Verdict::TooFar);
        }
        if converged {
            self.past.spend(rise);
            return Ok(Verdict::Good);
        }
        self.attempt_euler(now, problem, trial)
    }

    /// Backward differences (eq. 43): implicit Euler of another length from another state; returns whether the iteration converged.
    fn solve_bdf2(&mut self, now: &RodState, problem: &SubstepProblem<'_>) -> bool {
        let mut start = std::mem::take(&mut self.ahead);
        let h = self.past.start(now, &mut start, problem.h);
        let problem = SubstepProblem { h, ..*problem };
        self.predict(now, &start, h, problem.h);
        let mut converged = false;
        for done in 1..=BDF2_ITERATIONS.1 {
            self.next.strain(problem.material, problem.division);
            let iterate = Iterate { start: &start, at: &self.next, first: false };
            assemble(&problem, &iterate, &mut self.rows, &mut self.rhs);
            if self.factor.factor(&self.rows).is_err() {
                break;
            }
            self.factor.solve(&mut self.rhs);
            let at_work = now.kinetic_j + now.elastic_j + self.next.elastic_j;
            converged = done >= BDF2_ITERATIONS.0 && self.change_j(&problem) <= BDF2_SLACK * at_work;
            self.update_iterate(&start, h);
            if converged {
                break;
            }
        }
        self.next.strain(problem.material, problem.division);
        self.ahead = start;
        converged
    }

    /// The first iterate: velocities extrapolated from the past, and the positions they reach from `start`.
    fn predict(&mut self, now: &RodState, start: &RodState, h: f64, whole: f64) {
        let Self { next, past, .. } = self;
        let count = now.q.len();
        next.resize(count);
        for slot in 0..now.u.len() {
            next.u[slot] = now.u[slot] + past.expected(slot, whole);
        }
        for k in 0..=count {
            next.x[k] = start.x[k] + next.u[2 * k] * h;
        }
        for k in 0..count {
            next.q[k] = unit(exp(next.u[2 * k + 1] * h) * start.q[k]);
        }
    }

    /// Adds the change of velocities just solved, and moves accordingly (eq. 20).
    fn update_iterate(&mut self, start: &RodState, h: f64) {
        let Self { next, rhs, .. } = self;
        next.u.iter_mut().zip(&*rhs).for_each(|(u, change)| *u += *change);
        for (k, x) in next.x.iter_mut().enumerate() {
            *x = start.x[k] + next.u[2 * k] * h;
        }
        for (k, q) in next.q.iter_mut().enumerate() {
            *q = unit(exp(rhs[2 * k + 1] * h) * *q);
        }
    }

    /// Mean forces that conserve energy and momentum between two halves of the damping (eq. 45–49); returns whether the iteration
    /// converged.
    ///
    /// Damping of the mean velocity would not act on motion that changes sign in every substep.
    fn solve_energy_momentum(&mut self, now: &RodState, problem: &SubstepProblem<'_>) -> bool {
        let decay = libm::exp(-0.5 * problem.h * problem.material.damping);
        let undamped = RodMaterial { damping: 0.0, ..*problem.material };
        let mut start = std::mem::take(&mut self.ahead);
        start.copy_from(now);
        start.u.iter_mut().for_each(|u| *u *= decay);
        let converged = self.solve_undamped(&start, &SubstepProblem { material: &undamped, ..*problem });
        self.ahead = start;
        self.next.u.iter_mut().for_each(|u| *u *= decay);
        self.next.strain(problem.material, problem.division);
        converged
    }

    fn solve_undamped(&mut self, now: &RodState, problem: &SubstepProblem<'_>) -> bool {
        let half = 0.5 * problem.h;
        let tangent = SubstepProblem { h: half, ..*problem };
        self.predict_mean(now, problem.h);
        for _ in 0..MEAN_ITERATIONS {
            self.next.strain(problem.material, problem.division);
            fill_matrix(&tangent, &self.next, &mut self.rows, &mut self.rhs);
            fill_mean(&tangent, now, &self.next, &mut self.rows, &mut self.rhs);
            hold_ends(problem.material, &mut self.rows, &mut self.rhs);
            if self.factor.factor(&self.rows).is_err() {
                return false;
            }
            self.factor.solve(&mut self.rhs);
            let change_j = self.change_j(problem);
            self.update_mean_iterate(now, half);
            if change_j <= MEAN_SLACK * (now.kinetic_j + now.elastic_j + self.next.elastic_j) {
                return true;
            }
            if !change_j.is_finite() {
                return false;
            }
        }
        false
    }

    /// The first iterate of the energy-momentum rule.
    fn predict_mean(&mut self, now: &RodState, h: f64) {
        let Self { next, past, .. } = self;
        let count = now.q.len();
        next.resize(count);
        for k in 0..=count {
            next.u[2 * k] = now.u[2 * k] + past.expected(2 * k, h);
            next.x[k] = now.x[k] + (now.u[2 * k] + next.u[2 * k]) * (0.5 * h);
        }
        for k in 0..count {
            let slot = 2 * k + 1;
            next.q[k] = unit(exp((now.u[slot] + past.expected(slot, h) * 0.5) * h) * now.q[k]);
        }
        self.turn_mean(now, 0.5 * h);
    }

    /// Adds the change of velocities just solved, and moves by the mean of old and new.
    fn update_mean_iterate(&mut self, now: &RodState, half: f64) {
        let Self { next, rhs, .. } = self;
        for k in 0..next.x.len() {
            next.u[2 * k] += rhs[2 * k];
            next.x[k] = now.x[k] + (now.u[2 * k] + next.u[2 * k]) * half;
        }
        for (k, q) in next.q.iter_mut().enumerate() {
            *q = unit(exp(rhs[2 * k + 1] * half) * *q);
        }
        self.turn_mean(now, half);
    }

    /// The spins whose mean, in the segments' own axes, gives the turn made (eq. 46).
    fn turn_mean(&mut self, now: &RodState, half: f64) {
        let Self { next, .. } = self;
        for (k, q) in next.q.iter().enumerate() {
            let turn = *q * now.q[k].conjugate();
            next.u[2 * k + 1] = cayley(turn) / half - turn * now.u[2 * k + 1];
        }
    }

    /// The kinetic energy of the change of velocities in `rhs`, J, with lumped masses.
    fn change_j(&self, problem: &SubstepProblem<'_>) -> f64 {
        let material = problem.material;
        let part = |(k, l): (usize, &f64)| {
            let (a, w, b) = (self.rhs[2 * k], self.rhs[2 * k + 1], self.rhs[2 * k + 2]);
            let nodes = material.mu * 0.25 * (a.length_squared() + b.length_squared());
            l * (nodes + material.rotary * 0.5 * w.length_squared())
        };
        problem.division.length.iter().enumerate().map(part).sum()
    }

    /// The largest turn of a segment from `now` to the next state, radians.
    fn farthest_turn(&self, now: &RodState) -> f64 {
        let share = |(a, b): (&glam::DQuat, &glam::DQuat)| {
            let turn = *b * a.conjugate();
            turn.x * turn.x + turn.y * turn.y + turn.z * turn.z
        };
        2.0 * libm::asin(now.q.iter().zip(&self.next.q).map(share).fold(0.0, f64::max).sqrt().min(1.0))
    }
}
