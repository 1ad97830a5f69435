//! One step of the tube: linearly implicit Euler, divided into substeps where one is not enough.
//!
//! In: a state, a span, attachments. Out: the state exactly that span later. Never here: other agents, resolution.
//! Theory: docs/theory/rod.md, eq. 11–20 and 26–28.

use super::anchor_springs::NodeSpring;
use super::banded_ldl::{Factor, Row};
use super::discretization::Discretization;
use super::energy_limiter;
use super::history::History;
use super::rotation::{exp, unit};
use super::spec::Integrator;
use super::state::{RodMaterial, RodState};
use super::system::{Iterate, SubstepProblem, assemble};
use super::xpbd::Projector;
use glam::DVec3;

/// A substep turns no segment further, radians: the linear move stretches by φ²/2, 3 % here.
pub const TURN_MAX_RAD: f64 = 0.25;
/// A substep is halved at most ten times, into 1024: the last five only for rising energy, not for fast turning.
const HALVINGS: u32 = 10;
/// Substeps of fewer ticks than this may turn further than [`TURN_MAX_RAD`]: fast turning divides a step into 32 substeps at most.
const TURN_TICKS: u64 = 1 << (HALVINGS - 5);
/// Newton iterations of a substep whose energy rose, beyond the first: each squares the remaining error of the linear move.
const ITERATIONS_MORE: u32 = 2;
/// A rise of energy below this share of the energies involved is rounding.
const ENERGY_SLACK: f64 = 1e-9;
/// Strains below this are rounding (positions of 1 m over segments of 1 cm: 1e-14), whatever their energy.
const STRAIN_SLACK: f64 = 1e-10;

/// Constants of a step.
pub struct Setting<'a> {
    /// The material.
    pub material: &'a RodMaterial,
    /// The division.
    pub division: &'a Discretization,
    /// Attachments.
    pub springs: &'a [NodeSpring],
    /// The span of the step, seconds.
    pub dt: f64,
    /// The least number of substeps.
    pub substeps: u32,
    /// Time integrator.
    pub integrator: Integrator,
    /// The longest substep that the integrator allows while nothing is stretched, seconds (eq. 38, 39).
    pub longest_s: f64,
}

/// The state stopped being finite: where it failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Divergence {
    /// The slot whose pivot failed; `None` where the state itself did.
    pub slot: Option<usize>,
}

/// Working storage for the linear system and the next state; nothing is allocated once the sizes settle.
#[derive(Debug, Clone, Default)]
pub struct Stepper {
    pub(super) rows: Vec<Row>,
    pub(super) factor: Factor,
    pub(super) rhs: Vec<DVec3>,
    pub(super) next: RodState,
    /// Changes of the previous substep, and an extrapolated start state for rules that need one.
    pub(super) past: History,
    pub(super) ahead: RodState,
    pub(super) projector: Projector,
}

/// The conditions that may end a trial substep without a next state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Trial {
    /// Whether no segment may turn further than [`TURN_MAX_RAD`].
    pub bounds_turns: bool,
    /// Whether a smaller substep may take its place.
    pub may_divide: bool,
}

/// The result of a trial substep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The next state is accepted.
    Good,
    /// A segment turned too far, or energy rose: smaller substeps are needed.
    TooFar,
}

impl Stepper {
    /// Advances `now`, whose strains are up to date, by the span; returns the number of substeps.
    ///
    /// # Errors
    /// [`Divergence`] where the next state is not finite; `now` is then the last state that was.
    pub fn step(&mut self, now: &mut RodState, setting: &Setting<'_>) -> Result<u32, Divergence> {
        self.take_sections(now);
        let ticks = u64::from(setting.substeps) << HALVINGS;
        let tick = setting.dt / ticks as f64;
        let (mut elapsed, mut size, mut taken) = (0, 1_u64 << HALVINGS, 0);
        while elapsed < ticks {
            let h = tick * size as f64;
            let problem = SubstepProblem {
                material: setting.material,
                division: setting.division,
                springs: setting.springs,
                h,
                integrator: setting.integrator,
            };
            let stretched = h * now.stretch > setting.longest_s && size > 1;
            let trial = Trial { bounds_turns: size > TURN_TICKS, may_divide: size > 1 };
            if stretched || self.attempt(now, &problem, trial)? == Verdict::TooFar {
                size /= 2;
                continue;
            }
            std::mem::swap(now, &mut self.next);
            if matches!(setting.integrator, Integrator::Bdf2 | Integrator::EnergyMomentum) {
                self.past.record(&self.next, now, h);
            }
            (elapsed, taken) = (elapsed + size, taken + 1);
            // double again, where that ends on the grid of the longer substep
            if size < 1 << HALVINGS && elapsed.is_multiple_of(2 * size) {
                size *= 2;
            }
        }
        Ok(taken)
    }

    /// Lets the states that a step leads to bend as `now` does: sections change between steps.
    pub(super) fn take_sections(&mut self, now: &RodState) {
        self.next.softening.clone_from(&now.softening);
        self.ahead.softening.clone_from(&now.softening);
    }

    /// Discards all data by node and segment: the tube was divided anew.
    pub fn forget(&mut self) {
        self.factor.forget();
        self.past.forget();
    }

    /// The factor of the last substep of the centre line; without slots where the division has changed since.
    pub fn factor(&self) -> &Factor {
        &self.factor
    }

    /// One trial substep, from `now` into `next`.
    fn attempt(&mut self, now: &RodState, problem: &SubstepProblem<'_>, trial: Trial) -> Result<Verdict, Divergence> {
        match problem.integrator {
            Integrator::SymplecticEuler => self.step_symplectic_euler(now, problem).map(|()| Verdict::Good),
            Integrator::Xpbd => self.step_xpbd(now, problem).map(|()| Verdict::Good),
            Integrator::ImplicitEuler => self.attempt_euler(now, problem, trial),
            Integrator::Bdf2 | Integrator::EnergyMomentum => self.attempt_second_order(now, problem, trial),
        }
    }

    /// The same by implicit Euler (eq. 11–20).
    pub(super) fn attempt_euler(
        &mut self,
        now: &RodState,
        problem: &SubstepProblem<'_>,
        trial: Trial,
    ) -> Result<Verdict, Divergence> {
        if let Err(divergence) = self.solve(now, problem, true) {
            return if trial.may_divide { Ok(Verdict::TooFar) } else { Err(divergence) };
        }
        if trial.bounds_turns && self.fastest_spin() * problem.h > TURN_MAX_RAD {
            return Ok(Verdict::TooFar);
        }
        let rise = self.follow(now, problem);
        let finite = self.next.is_finite();
        if trial.may_divide && (rise > 0.0 || !finite) {
            return Ok(Verdict::TooFar);
        }
        if rise > 0.0 {
            energy_limiter::remove(rise, &mut self.next, problem.material, problem.division);
        }
        if finite && self.next.is_finite() { Ok(Verdict::Good) } else { Err(Divergence { slot: None }) }
    }

    /// Moves along the solution of the first system in `rhs`, and along those about where that leads while the energy rises. The rise that is
    /// left, J.
    pub(super) fn follow(&mut self, now: &RodState, problem: &SubstepProblem<'_>) -> f64 {
        self.advance(now, problem, true);
        let mut rise_j = self.energy_rise(now, problem);
        for _ in 0..ITERATIONS_MORE {
            // a state far out may have no next iterate: then the best so far is judged
            if rise_j <= 0.0 || !self.next.is_finite() || self.solve(now, problem, false).is_err() {
                break;
            }
            self.advance(now, problem, false);
            rise_j = self.energy_rise(now, problem);
        }
        rise_j
    }

    /// Moves by the velocities `v` that a cluster has made of the free ones: its impulses A (v − free) act on the tube. The rise of the energy
    /// beyond their work, J.
    pub(super) fn follow_cluster(
        &mut self,
        now: &RodState,
        problem: &SubstepProblem<'_>,
        [v, free]: [&[DVec3]; 2],
        is_free: bool,
    ) -> f64 {
        self.rhs.clear();
        self.rhs.extend_from_slice(v);
        if is_free {
            return self.follow(now, problem);
        }
        self.advance(now, problem, true);
        let work = |row: usize| product(&self.rows, row, |at| v[at] - free[at]).dot(v[row]);
        self.energy_rise(now, problem) - (0..v.len()).map(work).sum::<f64>()
    }

    /// Builds and solves the system about the iterate; leaves the change of velocities in `rhs` (eq. 11).
    pub(super) fn solve(
        &mut self,
        now: &RodState,
        problem: &SubstepProblem<'_>,
        first: bool,
    ) -> Result<(), Divergence> {
        let at = if first { now } else { &self.next };
        assemble(problem, &Iterate { start: now, at, first }, &mut self.rows, &mut self.rhs);
        self.factor_and_solve()
    }

    /// Factors and solves the assembled system.
    pub(super) fn factor_and_solve(&mut self) -> Result<(), Divergence> {
        self.factor.factor(&self.rows).map_err(|slot| Divergence { slot: Some(slot) })?;
        self.factor.solve(&mut self.rhs);
        Ok(())
    }

    /// The fastest spin in `rhs`, rad/s.
    fn fastest_spin(&self) -> f64 {
        self.rhs.iter().skip(1).step_by(2).map(|w| w.length_squared()).fold(0.0, f64::max).sqrt()
    }

    /// Moves along the solved velocities: x_n + h v, exp(h Δω) q (eq. 20); strains the new state.
    pub(super) fn advance(&mut self, now: &RodState, problem: &SubstepProblem<'_>, first: bool) {
        let Self { next, rhs, .. } = self;
        let (h, count) = (problem.h, now.q.len());
        next.resize(count);
        for k in 0..=count {
            let v = if first { rhs[2 * k] } else { next.u[2 * k] + rhs[2 * k] };
            next.u[2 * k] = v;
            next.x[k] = now.x[k] + v * h;
        }
        for k in 0..count {
            let turn = rhs[2 * k + 1];
            let (spin, from) = if first { (turn, now.q[k]) } else { (next.u[2 * k + 1] + turn, next.q[k]) };
            next.u[2 * k + 1] = spin;
            next.q[k] = unit(exp(turn * h) * from);
        }
        next.strain(problem.material, problem.division);
    }

    /// Energy of `next` beyond that of `now`, less rounding, J (eq. 27).
    pub(super) fn energy_rise(&self, now: &RodState, problem: &SubstepProblem<'_>) -> f64 {
        let (before, after) = (energy(now, problem.springs), energy(&self.next, problem.springs));
        let lifted = (self.next.gravity_j - now.gravity_j).abs();
        let at_work = self.next.kinetic_j + self.next.elastic_j + now.elastic_j + lifted;
        // the sums themselves round at their own size, and positions at theirs
        let sums = f64::EPSILON * 64.0 * (before.abs() + after.abs() + now.gravity_j.abs());
        let rounding = sums + STRAIN_SLACK * STRAIN_SLACK * problem.material.ea * problem.division.total_m();
        after - before - ENERGY_SLACK * at_work - rounding
    }
}

/// A row of A x.
fn product(rows: &[Row], row: usize, x: impl Fn(usize) -> DVec3) -> DVec3 {
    let before = |back: usize| row.checked_sub(back);
    let own = rows[row].diag * x(row);
    let lower = before(1).map_or(DVec3::ZERO, |at| rows[row].near * x(at))
        + before(2).map_or(DVec3::ZERO, |at| rows[row].far * x(at));
    let after = |on: usize| rows.get(row + on);
    let upper = after(1).map_or(DVec3::ZERO, |next| next.near.transpose() * x(row + 1))
        + after(2).map_or(DVec3::ZERO, |next| next.far * x(row + 2));
    own + lower + upper
}

/// The sum of kinetic, elastic and gravitational energy and that of the attachments, J (eq. 10).
pub fn energy(state: &RodState, springs: &[NodeSpring]) -> f64 {
    let held: f64 = springs.iter().map(|s| s.energy_j(state.x[s.node])).sum();
    state.kinetic_j + state.elastic_j + state.gravity_j + held
}
