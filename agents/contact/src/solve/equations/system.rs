//! The linear equations of a contact problem, by either form: responses of members, and Newton steps.
//!
//! In: members, rows, and a gain of each row. Out: solutions, with their residuals. Never here: laws of contact, steps of the
//! iteration. Theory: `docs/theory/clusters.md`, eq. 8 and section 6.

use super::coupled::Coupled;
use super::gradients::{Direction, End, Gradients, Operator, Residuals, Stiffness, Task};
use super::members::Members;
use super::rows::Rows;
use super::scale::Scales;
use crate::solve::statement::error::ProblemError;
use crate::solve::statement::problem::{Member, Problem};
use glam::DVec3;
use metachron_core::{Archive, ArchiveError};
use std::ops::Range;

/// How the linear equations of a Newton step are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StepForm {
    /// By a sparse factor of the members' size, to rounding. For thin or rigid bodies, and for stiff solids.
    #[default]
    Direct,
    /// By conjugate gradients without any factor, as exactly as the step is worth. For solids of some hundred nodes and more, where a
    /// factor fills in. Many rigid bodies on each other take it many products.
    Iterative,
}

/// The most that a factor is used again in a step, and the share of a goal at which that ends: friction that does not follow its pressure
/// costs another factor.
const FOLLOWED: End = End { directions: 30, share: 0.1 };

/// ⊕ A/f and ⊕ A/f + Jᵀ G J, and how equations with them are solved.
#[derive(Debug, Clone, Default)]
pub(crate) struct System {
    /// The form in which the next members are taken up.
    pub form: StepForm,
    /// The velocity by which unanswered momentum may change a block by itself, m/s (eq. 17).
    pub still_m_s: f64,
    pub members: Members,
    /// The matrix of coupled blocks of members that lend no factor, and that of all members with contacts, in the direct form.
    own: Coupled,
    coupled: Coupled,
    /// Factors of the latter for the members taken up last.
    pub factors: usize,
    gradients: Gradients,
    residuals: Residuals,
    scales: Scales,
    right: Vec<DVec3>,
    /// Whether the structure of a Newton step is that of the rows.
    is_coupled: bool,
}

impl System {
    /// Writes or reads the orders of factors, which the next problem needs.
    pub fn archive(&mut self, archive: &mut Archive<'_>) -> Result<(), ArchiveError> {
        self.own.archive(archive)?;
        self.coupled.archive(archive)?;
        self.gradients.archive(archive)
    }

    /// Takes up the members.
    ///
    /// # Errors
    /// [`ProblemError::NotPositiveDefinite`].
    pub fn take_members(&mut self, problem: &Problem<'_>, offsets: &[usize]) -> Result<(), ProblemError> {
        let alone = self.members.take(problem, offsets);
        (self.is_coupled, self.factors, self.gradients.products) = (false, 0, 0);
        let Self { members, own, gradients, .. } = self;
        let taken = alone.and_then(|()| match self.form {
            StepForm::Direct => {
                let none = Rows::default();
                own.couple(members, &none, |block| members.coupled[block] && !members.lends[members.owners[block]]);
                own.factor(Stiffness { rows: &none, gains: &[], skews: &[], threads: problem.threads })
            }
            StepForm::Iterative => gradients.take_members(members),
        });
        taken.map_err(|block| {
            let member = self.members.owners[block];
            ProblemError::NotPositiveDefinite { member, block: block - offsets[member] }
        })
    }

    /// Solves with ⊕ A/f: the response of members to impulses. Lent factors are those of the members taken up last.
    pub fn respond(&mut self, members: &[Member<'_>], task: &mut Task<'_>) {
        match self.form {
            StepForm::Direct => {
                self.own.solve(task.right, task.x);
                self.members.respond_alone(task.right, task.x);
                task.left.fill(DVec3::ZERO);
            }
            StepForm::Iterative => self.descend(members, task),
        }
        self.lend(members, task);
    }

    /// The impulses that velocities `x` leave of `right` before anything is solved: by a factor, and for members that lend one, none, as
    /// they are solved for at once; else a Newton step takes up the rest together with the contacts.
    pub fn begin(&mut self, members: &[Member<'_>], task: &mut Task<'_>) {
        if self.form == StepForm::Direct {
            return self.respond(members, task);
        }
        let operator = Operator { members: &self.members, contacts: None, still_m_s: self.still_m_s };
        self.gradients.measure(&operator, task);
        self.lend(members, task);
    }

    /// Solves for the members that lend a factor.
    fn lend(&mut self, members: &[Member<'_>], task: &mut Task<'_>) {
        for (range, member) in lending(members) {
            let x = &mut task.x[range.clone()];
            x.copy_from_slice(&task.right[range.clone()]);
            if let Some(response) = member.response {
                response.respond(x);
            }
            x.iter_mut().for_each(|x| *x *= member.share);
            task.left[range].fill(DVec3::ZERO);
        }
    }

    /// Solves with ⊕ A/f by conjugate gradients, for members that lend no factor; the others are left at rest.
    fn descend(&mut self, members: &[Member<'_>], task: &mut Task<'_>) {
        task.right.clone_into(&mut self.right);
        for (range, _) in lending(members) {
            self.right[range.clone()].fill(DVec3::ZERO);
            task.x[range].fill(DVec3::ZERO);
        }
        let operator = Operator { members: &self.members, contacts: None, still_m_s: self.still_m_s };
        let Task { x, left, goal, .. } = task;
        self.gradients.solve(&operator, &mut Task { right: &self.right, x, left, goal: *goal });
    }

    /// Factors ⊕ A/f + Jᵀ G J, or its near part; `false` where rounding leaves it without a factor.
    pub fn factor(&mut self, contacts: Stiffness<'_>) -> bool {
        let Self { members, coupled, gradients, .. } = self;
        let is_first = !std::mem::replace(&mut self.is_coupled, true);
        match self.form {
            StepForm::Direct => {
                self.factors += 1;
                if is_first {
                    coupled.couple(members, contacts.rows, |_| true);
                }
                coupled.factor(contacts).is_ok()
            }
            StepForm::Iterative => {
                if is_first {
                    gradients.couple(members, contacts.rows);
                }
                gradients.precondition(contacts)
            }
        }
    }

    /// Solves with ⊕ A/f + Jᵀ (G + S) J as it was factored.
    pub fn solve(&mut self, contacts: Stiffness<'_>, task: &mut Task<'_>) {
        match self.form {
            StepForm::Direct => {
                self.coupled.solve(task.right, task.x);
                task.left.fill(DVec3::ZERO);
                self.follow(contacts, task);
            }
            StepForm::Iterative => {
                // a goal says how exact a step is worth to be
                let still_m_s = if task.goal > 0.0 { 0.0 } else { self.still_m_s };
                let operator = Operator { members: &self.members, contacts: Some(contacts), still_m_s };
                self.gradients.solve(&operator, task);
            }
        }
    }

    /// Lets the solution by a factor follow the part that is not in it.
    fn follow(&mut self, contacts: Stiffness<'_>, task: &mut Task<'_>) {
        let Self { members, coupled, residuals, .. } = self;
        contacts.add_skew(task.x, task.left);
        task.left.iter_mut().for_each(|left| *left = -*left);
        let operator = Operator { members, contacts: Some(contacts), still_m_s: 0.0 };
        if !contacts.is_skew() || operator.is_done(task, FOLLOWED.share) {
            return;
        }
        residuals.descend(&operator, task, FOLLOWED, |left, Direction { x, image }| {
            coupled.solve(left, x);
            image.copy_from_slice(left);
            contacts.add_skew(x, image);
            true
        });
    }

    /// Products of conjugate gradients for the members taken up last.
    pub fn products(&self) -> usize {
        self.gradients.products
    }

    /// How easily each side of a row gives way along the first axis of its frame, 1/kg: that of the member `first`, and all others.
    pub fn along_normal(&self, rows: &Rows, row: usize, first: Option<usize>) -> [f64; 2] {
        self.scales.along_normal(&self.members, rows.terms(row), first)
    }

    /// The scale of each row (eq. 6).
    pub fn scale_rows(&mut self, members: &[Member<'_>], rows: &mut Rows) {
        let mut scales = std::mem::take(&mut self.scales);
        scales.set(self, members, rows);
        self.scales = scales;
    }
}

/// The members that lend a factor, each with its blocks.
fn lending<'a, 'b>(members: &'a [Member<'b>]) -> impl Iterator<Item = (Range<usize>, &'a Member<'b>)> {
    let blocks = members.iter().scan(0, |start, member| {
        let range = *start..*start + member.free.len();
        *start = range.end;
        Some((range, member))
    });
    blocks.filter(|(_, member)| member.response.is_some())
}
