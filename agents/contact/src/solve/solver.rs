//! The solve of one contact problem: set-up, levels of which each improves on the last, the guard.
//!
//! In: a problem, with the impulses of the last step in it. Out: impulses, velocities and a report. Never here: search for contacts,
//! keys, steps of members. Theory: `docs/theory/clusters.md`, sections 3 to 5.

use super::equations::system::StepForm;
use super::levels::held::Held;
use super::levels::interior::Interior;
use super::levels::iterate::{Iterate, Kept, State};
use super::levels::newton::{self, Aim, Patience};
use super::levels::passivity;
use super::statement::error::ProblemError;
use super::statement::problem::{Member, Problem};
use super::statement::validate::validate;
use crate::push_out::PUSH_OUT_SHARE;
use glam::DVec3;
use metachron_core::{Archive, ArchiveError, SolveLevel};
use std::ops::Range;

/// The goals and limits of a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The miss of a law at which a solve is done, m/s, > 0 (eq. 9). Larger lets piles drift; below 10⁻⁹ rounding is met.
    pub tolerance_m_s: f64,
    /// How deep contacts rest, metres, > 0: their compliance follows from it. Smaller takes more steps.
    pub depth_m: f64,
    /// How the equations of a step are solved.
    pub form: StepForm,
    /// The velocity by which momentum left unanswered in the iterative form may change a block by itself, m/s, > 0 (eq. 17). By
    /// factors momentum is balanced to rounding.
    pub still_m_s: f64,
    /// The most factors of a solve; `None` for as many as the tolerance takes, as in the iterative form, which makes none. After five from
    /// interior points an answer is safe, and contacts are some hundredths of a millimetre deeper.
    pub factors_max: Option<u32>,
}

/// Below this miss the impulses of the last step nearly hold, m/s, and Newton's method may find the rest.
const NEAR_M_S: f64 = 0.3;
/// Below this miss, m/s, it is tried from interior points, and then at each tenth of the miss at which it failed.
const POLISH_M_S: f64 = 1e-3;
const POLISH_AGAIN: f64 = 0.1;
/// How long it goes on.
const PATIENCE: Patience = Patience { steps: usize::MAX, stale: 4, left: 0.5 };
/// The most steps of a solve without a budget: of 1000 problems at random none took 150.
const STEPS_MAX: usize = 400;

/// How deep contacts rest where nothing else is said, metres.
pub const DEPTH_DEFAULT_M: f64 = 20e-6;

impl Default for Settings {
    fn default() -> Self {
        let (form, depth_m) = (StepForm::Direct, DEPTH_DEFAULT_M);
        Self { tolerance_m_s: 5e-6, depth_m, form, still_m_s: 5e-8, factors_max: None }
    }
}

/// The cost of a solve, and how good its answer is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Report {
    /// How far it went.
    pub level: SolveLevel,
    /// Factors of the coupled matrix; none in the iterative form.
    pub factors: usize,
    /// Products of conjugate gradients with a matrix of the members' size, all for scales, steps and responses; none in the direct form.
    pub products: usize,
    /// The most by which the answer misses laws and momentum, m/s (eq. 9); infinite where numbers overflowed and nothing is given.
    pub miss_m_s: f64,
    /// The most work that the answer does but for push-out, J (eq. 12); above zero by rounding only.
    pub work_j: f64,
    /// The factor that makes all impulses passive; 1 but for answers that are far off.
    pub ray: f64,
}

/// The answer of a solve; rows are counted as the problem gives them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Solution {
    /// The impulse of each contact on side 0, world axes, N·s; side 1 gets its opposite.
    pub contacts_n_s: Vec<DVec3>,
    /// The impulse of each joint's row, likewise.
    pub rows_n_s: Vec<DVec3>,
    /// The velocity of side 0 against side 1 of each contact, its surface included, world axes, m/s.
    pub contacts_m_s: Vec<DVec3>,
    /// The velocity by which each contact gives way for an impulse, 1/kg: R of eq. 5.
    pub compliances_per_kg: Vec<f64>,
    /// The report of the solve.
    pub report: Report,
    velocities: Vec<DVec3>,
    unanswered: Vec<DVec3>,
    pub(super) offsets: Vec<usize>,
}

impl Solution {
    /// The momentum that the velocity of each block of a member does not answer, N·s: with the next impulses it is solved for again. None where
    /// there is no such member.
    #[must_use]
    pub fn unanswered(&self, member: usize) -> &[DVec3] {
        &self.unanswered[self.range(member)]
    }

    /// The velocity of each block of a member: v̂ + f A⁻¹ Jᵀ λ (eq. 1), by which its places move. None where there is no such member.
    #[must_use]
    pub fn velocities(&self, member: usize) -> &[DVec3] {
        &self.velocities[self.range(member)]
    }

    /// The blocks of a member.
    fn range(&self, member: usize) -> Range<usize> {
        let all = self.velocities.len();
        let at = |place: usize| self.offsets.get(place).copied().unwrap_or(all);
        at(member)..at(member + 1)
    }
}

/// Solves problems one after the other, and keeps structure and storage between them.
#[derive(Debug, Clone, Default)]
pub struct Solver {
    pub(crate) settings: Settings,
    pub(super) iterate: Iterate,
    warm: Vec<DVec3>,
    compliances: Vec<f64>,
    interior: Interior,
    kept: Kept,
    pub(super) solution: Solution,
    pub(super) held: Held,
}

impl Solver {
    /// Writes or reads the orders of elimination, which the next solve takes over. Impulses are remembered by their givers.
    pub(crate) fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.iterate.system.archive(archive)
    }

    /// A solver with its settings.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self { settings, ..Self::default() }
    }

    /// Finds impulses by which all laws hold (eq. 4), or the best that is safe: the report tells which.
    ///
    /// # Errors
    /// [`ProblemError`] where the problem is none; the solver may be used on.
    pub fn solve(&mut self, problem: &Problem<'_>) -> Result<&Solution, ProblemError> {
        validate(problem)?;
        self.set_up(problem)?;
        self.solution.report = if self.iterate.rows.len() > 0 {
            self.run(problem)
        } else {
            self.iterate.respond(problem.members);
            let (products, miss_m_s) = (self.iterate.system.products(), newton::miss_m_s(&mut self.iterate));
            Report { products, miss_m_s, ..Report::resting() }
        };
        self.hand_out(problem);
        Ok(&self.solution)
    }

    /// The answer of the last solve.
    #[must_use]
    pub fn solution(&self) -> &Solution {
        &self.solution
    }

    /// How easily both sides of a contact of the last problem give way along its normal, 1/kg, by the compliance of the
    /// whole member as sampled (eq. 6): that of the member `first`, then the other.
    pub(crate) fn inverse_masses(&self, contact: usize, first: Option<usize>) -> [f64; 2] {
        let Iterate { rows, system, .. } = &self.iterate;
        system.along_normal(rows, contact, first)
    }

    /// Velocities without impulses, matrices, rows, scales, and the last step's impulses with their compliances.
    fn set_up(&mut self, problem: &Problem<'_>) -> Result<(), ProblemError> {
        let Solution { offsets, velocities, .. } = &mut self.solution;
        offsets.clear();
        velocities.clear();
        for member in problem.members {
            offsets.push(velocities.len());
            velocities.extend_from_slice(member.free);
        }
        let Iterate { rows, system, .. } = &mut self.iterate;
        (system.form, system.still_m_s) = (self.settings.form, self.settings.still_m_s);
        system.take_members(problem, offsets)?;
        rows.gather(problem, offsets, velocities);
        system.scale_rows(problem.members, rows);
        let yield_m_s = self.settings.yield_m_s(problem.h_s);
        let of_contacts = problem.contacts.iter().map(|contact| (contact.warm_n_s, contact.load_n_s));
        let given = of_contacts.chain(problem.rows.iter().map(|row| (row.warm_n_s, 0.0)));
        self.warm.clear();
        self.compliances.clear();
        for (k, (warm, load_n_s)) in given.enumerate() {
            if k == problem.contacts.len() {
                rows.press(&self.warm);
            }
            let row = &rows.rows[k];
            let warm = row.law.project(row.frame.transpose() * warm * row.held).value;
            self.warm.push(warm);
            self.compliances.push(row.compliance_under(warm.length().max(load_n_s), yield_m_s));
        }
        self.iterate.reset(self.solution.velocities.len());
        self.iterate.take_unanswered(problem.members);
        Ok(())
    }

    /// Starts from the impulses of the last step.
    fn start(&mut self, members: &[Member<'_>]) {
        self.iterate.state.lambda.clone_from(&self.warm);
        self.iterate.rows.rows.iter_mut().zip(&self.compliances).for_each(|(row, r)| row.compliance = *r);
        self.iterate.guess(members);
        self.iterate.begin(members);
    }

    /// The levels in their order, then the guard.
    fn run(&mut self, problem: &Problem<'_>) -> Report {
        let aim = Aim {
            members: problem.members,
            tolerance_m_s: self.settings.tolerance_m_s,
            yield_m_s: self.settings.yield_m_s(problem.h_s),
            threads: problem.threads,
        };
        let mut report = self.find(&aim);
        let ray = passivity::guard(&mut self.iterate, problem.members, &self.solution.velocities);
        (report.factors, report.products) = (self.iterate.system.factors, self.iterate.system.products());
        (report.work_j, report.ray) = (ray.work_j, ray.share);
        if ray.share < 1.0 {
            report.miss_m_s = newton::miss_m_s(&mut self.iterate);
        }
        report
    }

    /// Impulses in their cones, as near to where all laws hold as the budget goes.
    fn find(&mut self, aim: &Aim<'_>) -> Report {
        self.start(aim.members);
        let level = self.improve(aim);
        let finite = self.settle(aim.members);
        let miss_m_s = if finite { newton::miss_m_s(&mut self.iterate) } else { f64::INFINITY };
        Report { level, miss_m_s, ..Report::resting() }
    }

    /// One loop, each level of which is the start of the next.
    fn improve(&mut self, aim: &Aim<'_>) -> SolveLevel {
        let Self { iterate, interior, kept, settings, .. } = self;
        let most = settings.factors_max.filter(|_| iterate.system.form == StepForm::Direct);
        let last = iterate.steps + most.map_or(STEPS_MAX, |most| most as usize);
        let mut patience = PATIENCE;
        if most.is_some() {
            patience.stale = 1;
        }
        // a miss of velocities that do not answer the impulses yet does not tell how near they are
        let mut try_below_m_s = if iterate.exact { NEAR_M_S } else { f64::INFINITY };
        let mut entered = false;
        loop {
            let (miss_m_s, before) = (newton::miss_m_s(iterate), iterate.steps);
            if miss_m_s < try_below_m_s.max(aim.tolerance_m_s) {
                iterate.keep(kept);
                // Newton's method is of no use unfinished: half of a budget is kept for interior points, which are
                patience.steps = (last - before) / if entered { 1 } else { 2 };
                if newton::solve(iterate, aim, patience) {
                    let near = if iterate.steps == before { SolveLevel::Kept } else { SolveLevel::Near };
                    return if entered { SolveLevel::Polished } else { near };
                }
                iterate.go_back(kept);
                try_below_m_s = POLISH_AGAIN * miss_m_s;
            }
            if !entered {
                interior.begin(iterate);
                (entered, try_below_m_s) = (true, try_below_m_s.min(POLISH_M_S));
            }
            if iterate.steps >= last || !interior.step(iterate, aim) {
                interior.finish(iterate);
                return SolveLevel::Interior;
            }
        }
    }

    /// Impulses into their cones, and the velocities that these make; `false` where numbers have overflowed and there is no answer.
    fn settle(&mut self, members: &[Member<'_>]) -> bool {
        if self.iterate.allow() || !self.iterate.exact {
            self.iterate.respond(members);
        }
        let State { lambda, velocity, .. } = &mut self.iterate.state;
        let finite = lambda.iter().chain(&*velocity).all(|v| v.is_finite());
        if !finite {
            lambda.fill(DVec3::ZERO);
            self.iterate.respond(members);
        }
        finite
    }

    /// Fills the answer in world axes.
    fn hand_out(&mut self, problem: &Problem<'_>) {
        let Self { iterate, solution, .. } = self;
        solution.contacts_n_s.clear();
        solution.rows_n_s.clear();
        solution.contacts_m_s.clear();
        solution.compliances_per_kg.clear();
        for (k, row) in iterate.rows.rows.iter().enumerate() {
            let impulse = row.frame * iterate.state.lambda[k];
            if k >= problem.contacts.len() {
                solution.rows_n_s.push(impulse);
                continue;
            }
            solution.contacts_n_s.push(impulse);
            solution.contacts_m_s.push(row.frame * (iterate.state.velocity[k] - row.bias));
            solution.compliances_per_kg.push(row.compliance);
        }
        solution.unanswered.clone_from(&iterate.state.left);
        solution.velocities.iter_mut().zip(&iterate.state.change).for_each(|(v, change)| *v += *change);
    }
}

impl Settings {
    /// v_s of eq. 5: the velocity of push-out in a step at the depth wanted.
    fn yield_m_s(&self, h_s: f64) -> f64 {
        PUSH_OUT_SHARE * self.depth_m / h_s
    }
}

impl Report {
    fn resting() -> Self {
        Self { ray: 1.0, ..Self::default() }
    }
}
