//! The solve of one contact problem: set-up, the primal-dual way, the convex way behind it, the guard.
//!
//! In: a problem, with the impulses of the last step in it. Out: impulses, velocities and a report. Never here: search for contacts,
//! keys, steps of members. Theory: `docs/theory/clusters.md`.

use super::cone::Form;
use super::convex::{self, Passes, Stores};
use super::error::ProblemError;
use super::iterate::{Iterate, Kept, State};
use super::newton::{self, Aim};
use super::passivity;
use super::problem::{Member, Problem};
use super::system::StepForm;
use super::validate::validate;
use crate::push_out::PUSH_OUT_SHARE;
use glam::DVec3;
use metachron_core::{Archive, ArchiveError};
use std::ops::Range;

/// What a solve aims at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The miss of a law at which a solve is done, m/s, > 0 (eq. 9). Larger lets piles drift; below 10⁻⁹ rounding is met.
    pub tolerance_m_s: f64,
    /// How deep contacts rest, metres, > 0: their compliance follows from it. Smaller takes more steps.
    pub depth_m: f64,
    /// The most passes of the convex way, ≥ 1. One leaves what slides floating by μ |u_t| h.
    pub passes: usize,
    /// Leaves the primal-dual way out, for comparison.
    pub convex_only: bool,
    /// How the equations of a step are solved.
    pub form: StepForm,
    /// The velocity by which what velocities leave unanswered in the iterative form may change a block by itself, m/s, > 0 (eq. 17). By
    /// factors momentum is balanced to rounding.
    pub still_m_s: f64,
}

/// How deep contacts rest where nothing else is said, metres.
pub const DEPTH_DEFAULT_M: f64 = 20e-6;

impl Default for Settings {
    fn default() -> Self {
        let (form, depth_m) = (StepForm::Direct, DEPTH_DEFAULT_M);
        Self { tolerance_m_s: 5e-6, depth_m, passes: 60, convex_only: false, form, still_m_s: 5e-8 }
    }
}

/// How an answer was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Way {
    /// The impulses of the last step still hold: no Newton step was needed.
    #[default]
    Kept,
    /// By primal-dual Newton.
    PrimalDual,
    /// By convex passes.
    Convex,
}

/// What a solve took, and how good its answer is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Report {
    /// The way that the answer comes from.
    pub way: Way,
    /// Factors of the coupled matrix, those of ways that gave up included; none in the iterative form.
    pub factors: usize,
    /// Products of conjugate gradients with a matrix of the members' size, all for scales, steps and responses; none in the direct form.
    pub products: usize,
    /// Convex passes that were finished.
    pub passes: usize,
    /// The largest miss of a law by the answer given, m/s (eq. 9).
    pub residual_m_s: f64,
    /// The most work that the answer does but for push-out, J (eq. 12); above zero by rounding only.
    pub work_j: f64,
    /// What all impulses were multiplied by to be passive; 1 but for answers that are far off.
    pub ray: f64,
    /// Whether no way came to its end: the answer is that of a softer contact or of fewer passes.
    pub cut: bool,
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
    /// What the solve took.
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
    settings: Settings,
    pub(super) iterate: Iterate,
    warm: Vec<DVec3>,
    compliances: Vec<f64>,
    stores: Stores,
    kept: Kept,
    pub(super) solution: Solution,
    /// Storage of [`Self::held_compliance`] and [`Self::resistance`], and what the latter found.
    pub(super) held: [Vec<DVec3>; 3],
    pub(super) resisted: Vec<DVec3>,
}

impl Solver {
    /// Writes or reads what the next solve needs of those before: orders of elimination. Impulses are remembered by who gave them.
    pub(crate) fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.iterate.system.archive(archive)
    }

    /// Solves the equations of steps by this form from now on.
    pub fn set_form(&mut self, form: StepForm) {
        self.settings.form = form;
    }

    /// Lets contacts rest `depth_m` metres deep from now on, > 0.
    pub fn set_depth_m(&mut self, depth_m: f64) {
        self.settings.depth_m = depth_m;
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
            let products = self.iterate.system.products();
            Report { products, cut: !self.iterate.answered(), ..Report::resting() }
        };
        self.hand_out(problem);
        Ok(&self.solution)
    }

    /// The answer of the last solve.
    #[must_use]
    pub fn solution(&self) -> &Solution {
        &self.solution
    }

    /// How easily both sides of a contact of the last problem give way along its normal, 1/kg, by the compliance of the whole member as far
    /// as samples tell (eq. 6): that of the member `first`, then the other.
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
            let warm = row.law.project(Form::Disc, row.frame.transpose() * warm * row.held).value;
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

    /// The ways in their order, then the guard.
    fn run(&mut self, problem: &Problem<'_>) -> Report {
        let rigid = self.iterate.system.members.rigid.iter().all(|rigid| *rigid);
        let aim = Aim {
            members: problem.members,
            form: if rigid && !self.iterate.follows_pressure() { Form::Cone } else { Form::Disc },
            tolerance_m_s: self.settings.tolerance_m_s,
            yield_m_s: self.settings.yield_m_s(problem.h_s),
            threads: problem.threads,
        };
        let mut report = self.find(&aim);
        let ray = passivity::guard(&mut self.iterate, problem.members, &self.solution.velocities);
        (report.factors, report.products) = (self.iterate.system.factors(), self.iterate.system.products());
        (report.work_j, report.ray) = (ray.work_j, ray.share);
        report.residual_m_s = newton::largest_miss(&self.iterate, Form::Disc);
        report
    }

    /// Impulses in their cones by the first way that finds them.
    fn find(&mut self, aim: &Aim<'_>) -> Report {
        let mut report = Report::resting();
        if !self.settings.convex_only && self.primal_dual(aim) {
            report.way = if self.iterate.steps > 0 { Way::PrimalDual } else { Way::Kept };
        } else {
            let passes = self.convex(aim);
            report = Report { way: Way::Convex, passes: passes.finished, cut: !passes.settled, ..report };
        }
        report.cut |= !self.settle(aim.members) || !self.iterate.answered();
        report
    }

    /// The primal-dual way, in the form that serves these members best, then in the other.
    fn primal_dual(&mut self, aim: &Aim<'_>) -> bool {
        let other = if aim.form == Form::Cone { Form::Disc } else { Form::Cone };
        [aim.form, other].into_iter().any(|form| {
            self.start(aim.members);
            newton::solve(&mut self.iterate, &Aim { form, ..*aim })
        })
    }

    /// The convex way; passes that have not settled are a start from which the primal-dual way may find the rest.
    fn convex(&mut self, aim: &Aim<'_>) -> Passes {
        self.start(aim.members);
        let mut passes = convex::solve(&mut self.iterate, &mut self.stores, aim, self.settings.passes);
        if !passes.settled && passes.finished > 0 && !self.settings.convex_only {
            self.iterate.keep(&mut self.kept);
            passes.settled = newton::solve(&mut self.iterate, &Aim { form: Form::Cone, ..*aim });
            if !passes.settled {
                self.iterate.restore(aim.members, &self.kept);
            }
        }
        passes
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
    /// v_s of eq. 5: what push-out gives back in a step at the depth wanted.
    fn yield_m_s(&self, h_s: f64) -> f64 {
        PUSH_OUT_SHARE * self.depth_m / h_s
    }
}

impl Report {
    fn resting() -> Self {
        Self { ray: 1.0, ..Self::default() }
    }
}
