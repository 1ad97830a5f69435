//! One step of the tube: linearly implicit Euler, divided into substeps where one is not enough.
//!
//! In: a state, a span, attachments and pulls. Out: the state exactly that span later. Never here: other agents, resolution.
//! Theory: docs/theory/rod.md, eq. 11–20 and 26–28.

use super::anchor_springs::{NodeSpring, Tie};
use super::apply_impulses::{DisplacementLimit, FactoredSystem};
use super::banded_ldl::InverseBlocks;
use super::banded_ldl::{Factor, Row};
use super::company::Company;
use super::contact::{Solved, TubeContacts, respond};
use super::discretization::Discretization;
use super::energy_limiter;
use super::footing::Footing;
use super::history::History;
use super::horizon::Horizon;
use super::method::Integrator;
use super::rotation::{exp, unit};
use super::state::{DividedRod, RodMaterial, RodState};
use super::substep::Substep;
use super::system::{Iterate, SubstepProblem, assemble};
use super::xpbd::Projector;
use glam::{DMat3, DVec3};
use metachron_contact::Presses;
use metachron_core::Lies;

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
    pub matter: &'a RodMaterial,
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
    /// Contact impulses of the last substep.
    pub(super) presses: Presses,
    pub(super) factor: Factor,
    pub(super) rhs: Vec<DVec3>,
    pub(super) next: RodState,
    /// Changes of the previous substep, and an extrapolated start state for rules that need one.
    pub(super) past: History,
    pub(super) ahead: RodState,
    pub(super) projector: Projector,
    /// Contacts of the skin.
    pub contacts: TubeContacts,
    /// Nearby peers.
    pub company: Company,
    /// The predicted next step, for slower owners.
    pub(super) horizon: Horizon,
    /// Supports of the tube, for others that need them.
    pub(super) footing: Footing,
    /// Work that contact does in the trial substep, J.
    pushed_j: f64,
    /// The length of the last substep, seconds.
    pub(super) span_s: f64,
    /// Systems factored in the step for accepted substeps, iterations included: its work.
    pub(super) solves: u32,
}

/// What may end a trial substep without a next state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Trial {
    /// Whether no segment may turn further than [`TURN_MAX_RAD`].
    pub bounds_turns: bool,
    /// Whether a smaller substep may take its place.
    pub may_divide: bool,
}

/// A tube's response to impulses, as it is published.
pub struct PublishedResponse<'a> {
    /// The factor of the predicted step, or else of the last one.
    pub factor: &'a Factor,
    /// The length of the last substep, seconds.
    pub span_s: f64,
    /// Its supports, and the factor that includes them.
    pub supported: Lies<'a, Factor>,
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
    pub fn step(&mut self, now: &mut RodState, setting: &Setting<'_>, ties: &mut [Tie]) -> Result<u32, Divergence> {
        let ticks = u64::from(setting.substeps) << HALVINGS;
        let tick = setting.dt / ticks as f64;
        let (mut elapsed, mut size, mut taken) = (0, 1_u64 << HALVINGS, 0);
        while elapsed < ticks {
            let substep = Substep { start_s: tick * elapsed as f64, span_s: tick * size as f64 };
            self.company.aim(ties, &now.x, substep);
            let problem = SubstepProblem {
                matter: setting.matter,
                division: setting.division,
                springs: setting.springs,
                ties,
                h: substep.span_s,
                until: tick * (elapsed + size) as f64,
                integrator: setting.integrator,
            };
            let stretched = substep.span_s * now.stretch > setting.longest_s && size > 1;
            let solves = self.solves;
            let trial = Trial { bounds_turns: size > TURN_TICKS, may_divide: size > 1 };
            if stretched || self.attempt(now, &problem, trial)? == Verdict::TooFar {
                (self.solves, size) = (solves, size / 2);
                continue;
            }
            self.accept(now, ties, substep);
            self.remember(now, setting.integrator, ties.is_empty(), substep.span_s);
            (elapsed, taken) = (elapsed + size, taken + 1);
            // double again, where that ends on the grid of the longer substep
            if size < 1 << HALVINGS && elapsed.is_multiple_of(2 * size) {
                size *= 2;
            }
        }
        Ok(taken)
    }

    /// Applies to `now` what others gave: v += A⁻¹ dJ, x += A⁻¹ (t dJ − dS); no node is displaced by more than `way_m`. `ties` are
    /// those of the step before.
    ///
    /// # Errors
    /// [`Divergence`] where the system cannot be factored; `now` is then untouched.
    pub fn receive(
        &mut self,
        now: &mut RodState,
        setting: &Setting<'_>,
        ties: &mut [Tie],
        way_m: f64,
    ) -> Result<(), Divergence> {
        if self.company.received().is_empty() {
            return Ok(());
        }
        self.prepare(now, setting)?;
        let Self { company, factor, footing, contacts, .. } = self;
        let push = company.received().push();
        let lies = Some(&*footing).filter(|footing| footing.stance.bears(push));
        let factor = lies.and_then(Footing::factor).unwrap_or(factor);
        let feet = lies.map_or(&[][..], |footing| footing.stance.on_others());
        let system = FactoredSystem { factor, ties, feet };
        let rod = DividedRod { matter: setting.matter, division: setting.division };
        company.received().apply(now, system, rod, DisplacementLimit { walls: contacts, way_m });
        Ok(())
    }

    /// Factors the system of a substep about `now` where there is no factor of this division yet.
    ///
    /// # Errors
    /// [`Divergence`] where it cannot be factored.
    pub fn prepare(&mut self, now: &RodState, setting: &Setting<'_>) -> Result<(), Divergence> {
        if self.factor.slots() == now.u.len() {
            return Ok(());
        }
        let Setting { matter, division, springs, dt, substeps, integrator, .. } = *setting;
        let h = dt / f64::from(substeps);
        let problem = SubstepProblem { matter, division, springs, ties: &[], h, until: h, integrator };
        match integrator {
            Integrator::SymplecticEuler | Integrator::Xpbd => {
                self.assemble_light(now, &problem, integrator == Integrator::Xpbd);
            }
            _ => assemble(&problem, &Iterate { start: now, at: now, first: true }, &mut self.rows, &mut self.rhs),
        }
        self.factor.factor(&self.rows).map_err(|slot| {
            self.factor.forget();
            Divergence { slot: Some(slot) }
        })
    }

    /// Discards all data by node and segment: the tube was divided anew.
    pub fn forget(&mut self) {
        self.factor.forget();
        self.horizon.forget();
        self.footing.stance.forget();
        self.presses.forget();
        self.contacts.forget();
        self.past.forget();
    }

    /// The factor of the last substep; without slots where the division has changed since.
    pub fn factor(&self) -> &Factor {
        &self.factor
    }

    /// The length of that substep, seconds; zero before the first.
    pub fn span_s(&self) -> f64 {
        self.span_s
    }

    /// The tube's response to impulses, as others are to expect it.
    pub fn published_response(&self) -> PublishedResponse<'_> {
        let Self { footing, horizon, factor, span_s, .. } = self;
        let supported = horizon.standing().or(footing.factor()).map(|standing| (footing.stance.feet(), standing));
        PublishedResponse {
            factor: horizon.factor().unwrap_or(factor),
            span_s: *span_s,
            supported: supported.filter(|(feet, _)| !feet.is_empty()),
        }
    }

    /// Finds the supports of the tube after its last substep, where others need them (`watched`).
    pub fn find_supports(&mut self, held: [bool; 2], watched: bool) {
        let Self { footing, rows, contacts, company, .. } = self;
        if watched { footing.stand(rows, (contacts, company.mates_mut()), held) } else { footing.stance.forget() }
    }

    /// Computes the effective inverse mass of the strongest contact with each touched peer, by the factor of the last substep.
    pub fn update_inverse_masses(&mut self, held: [bool; 2]) {
        let Self { factor, company, .. } = self;
        company.mates_mut().weigh(factor.slots(), |impulses| respond(factor, held, impulses));
    }

    /// The contact-space inverse mass W = J A⁻¹ Jᵀ of a point a share `w` along a segment, 1/kg, in the last
    /// substep (eq. 18); `None` where the segments have changed since, or no step was taken.
    pub fn inverse_mass(&self, segment: usize, w: f64, matter: &RodMaterial, slots: usize) -> Option<DMat3> {
        if self.factor.slots() != slots {
            return None;
        }
        let last = 2 * segment + 3 == slots;
        let (start, end) = (matter.held[0] && segment == 0, matter.held[1] && last);
        // a held node does not move: the identity stands in its row of the matrix, which is no mobility
        let (v, w) = (if start { 0.0 } else { 1.0 - w }, if end { 0.0 } else { w });
        let mut blocks = InverseBlocks::default();
        self.factor.inverse_blocks(&mut blocks);
        let (a, b) = (blocks.diag[2 * segment].full(), blocks.diag[2 * segment + 2].full());
        let across = blocks.far[2 * segment];
        Some(a * (v * v) + (across + across.transpose()) * (v * w) + b * (w * w))
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
        self.advance(now, problem, true);
        let mut rise = self.energy_rise(now, problem);
        for _ in 0..ITERATIONS_MORE {
            // a state far out may have no next iterate: then the best so far is judged
            if rise <= 0.0 || !self.next.is_finite() || self.solve(now, problem, false).is_err() {
                break;
            }
            self.advance(now, problem, false);
            rise = self.energy_rise(now, problem);
        }
        let finite = self.next.is_finite();
        if trial.may_divide && (rise > 0.0 || !finite) {
            return Ok(Verdict::TooFar);
        }
        if rise > 0.0 {
            energy_limiter::remove(rise, &mut self.next, problem.matter, problem.division);
        }
        if finite && self.next.is_finite() { Ok(Verdict::Good) } else { Err(Divergence { slot: None }) }
    }

    /// Builds and solves the system about the iterate, contact included; leaves the change of velocities in `rhs` (eq. 11).
    fn solve(&mut self, now: &RodState, problem: &SubstepProblem<'_>, first: bool) -> Result<(), Divergence> {
        let at = if first { now } else { &self.next };
        assemble(problem, &Iterate { start: now, at, first }, &mut self.rows, &mut self.rhs);
        self.factor_and_solve()?;
        self.solve_contacts(now, problem, first);
        Ok(())
    }

    /// Factors and solves the assembled system, with the received impulses that act through the substep.
    pub(super) fn factor_and_solve(&mut self) -> Result<(), Divergence> {
        self.rhs.iter_mut().zip(self.company.fresh()).for_each(|(r, fresh)| *r += *fresh);
        self.solves += 1;
        self.factor.factor(&self.rows).map_err(|slot| Divergence { slot: Some(slot) })?;
        self.factor.solve(&mut self.rhs);
        Ok(())
    }

    /// Corrects the velocities just solved so that the skin stays apart (docs/theory/contact.md, eq. 5).
    pub(super) fn solve_contacts(&mut self, now: &RodState, problem: &SubstepProblem<'_>, first: bool) {
        let Self { rhs, next, rows, factor, contacts, company, pushed_j, .. } = self;
        let solved = Solved { matter: problem.matter, division: problem.division, rows, factor, h: problem.h, first };
        // contact is a law of whole velocities, not of their change in an iteration
        let known = if first { &[][..] } else { &next.u[..] };
        rhs.iter_mut().zip(known).for_each(|(change, u)| *change += *u);
        *pushed_j = contacts.act(&now.x, rhs, &solved, company);
        rhs.iter_mut().zip(known).for_each(|(change, u)| *change -= *u);
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
        next.strain(problem.matter, problem.division);
    }

    /// Energy of `next` beyond that of `now` and the work of pulls, contact and received impulses, less rounding, J (eq. 27).
    pub(super) fn energy_rise(&self, now: &RodState, problem: &SubstepProblem<'_>) -> f64 {
        let (before, after) = (energy(now, problem.springs), energy(&self.next, problem.springs));
        // energy that friction removes must not be added elsewhere
        let (mut work, mut effort) = (self.pushed_j.max(0.0), self.pushed_j.abs());
        let fresh: f64 = self.company.fresh().iter().zip(&self.next.u).map(|(fresh, u)| fresh.dot(*u)).sum();
        work += fresh;
        effort += fresh.abs();
        for tie in problem.ties {
            let (a, b) = (tie.segment, tie.segment + 1);
            let x = tie.mix(self.next.x[a], self.next.x[b]);
            let v = tie.mix(self.next.u[2 * a], self.next.u[2 * b]);
            let done = tie.force(x, v, problem.until).dot(x - tie.mix(now.x[a], now.x[b]));
            work += done;
            effort += done.abs();
        }
        let lifted = (self.next.gravity_j - now.gravity_j).abs();
        let at_work = self.next.kinetic_j + self.next.elastic_j + now.elastic_j + lifted + effort;
        // the sums themselves round at their own size, and positions at theirs
        let sums = f64::EPSILON * 64.0 * (before.abs() + after.abs() + now.gravity_j.abs());
        let rounding = sums + STRAIN_SLACK * STRAIN_SLACK * problem.matter.ea * problem.division.total_m();
        after - before - work - ENERGY_SLACK * at_work - rounding
    }

    /// Stores what rules of second order need of the substep that ended at `now`, where nothing made velocities jump.
    fn remember(&mut self, now: &RodState, integrator: Integrator, untied: bool, h: f64) {
        if !matches!(integrator, Integrator::Bdf2 | Integrator::EnergyMomentum) {
            return;
        }
        if untied && self.company.is_empty() && !self.contacts.is_touching() {
            self.past.record(&self.next, now, h);
        } else {
            self.past.forget();
        }
    }

    /// Makes `next` the state and books the impulses of pulls and contacts.
    fn accept(&mut self, now: &mut RodState, ties: &mut [Tie], substep: Substep) {
        let Substep { start_s: start, span_s: h } = substep;
        std::mem::swap(now, &mut self.next);
        self.span_s = h;
        self.company.received().spend();
        for tie in &mut *ties {
            let (a, b) = (tie.segment, tie.segment + 1);
            // constraints act after the tie: its impulse belongs to the velocity before them
            let later = tie.mix(self.projector.gain(2 * a), self.projector.gain(2 * b));
            let (x, v) = (tie.mix(now.x[a], now.x[b]) - later * h, tie.mix(now.u[2 * a], now.u[2 * b]) - later);
            tie.record(x, v, substep);
        }
        if self.company.is_watched() {
            self.presses.note(self.contacts.impulses(), now.u.len(), h);
        } else {
            self.presses.forget();
        }
        self.company.accept(self.contacts.impulses(), ties, (now.u.len(), start, h));
    }
}

/// The sum of kinetic, elastic and gravitational energy and that of the attachments, J (eq. 10).
pub fn energy(state: &RodState, springs: &[NodeSpring]) -> f64 {
    let held: f64 = springs.iter().map(|s| s.energy_j(state.x[s.node])).sum();
    state.kinetic_j + state.elastic_j + state.gravity_j + held
}
