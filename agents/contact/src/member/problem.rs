//! The problem of some contacts and rows among participants: solved, with the participants that have a place in it as its members.
//!
//! In: contacts and rows whose sides are participants, the velocities that these have without them. Out: the answer, by the solver. Never here: which
//! contacts and rows there are.

use crate::member::guarded::Lent;
use crate::member::participant::Progress;
use crate::member::{GuardedMember, Participant};
use crate::solve::{Contact, JointRow, Member, Problem, ProblemError, Report, Response, Solver, StepForm};
use glam::DVec3;
use metachron_core::{ParallelFor, StepError, recycled};

/// Sweeps by which a member without a factor answers known impulses; each at least halves the rest for an M-matrix.
const SWEEPS_MAX: usize = 400;
/// A member of more blocks that lends no factor gets none: the problem is solved by conjugate gradients.
const FACTORED_BLOCKS_MAX: usize = 200;

/// The participants that are members of a problem, and storage for these.
#[derive(Default)]
pub(crate) struct ProblemMembers {
    /// The participant of each member.
    pub places: Vec<usize>,
    members: Vec<Member<'static>>,
    lent: Vec<Option<Lent<'static>>>,
}

/// Where a problem takes velocities or momentum of a participant from.
pub(crate) type Velocities = fn(&Progress) -> &[DVec3];

/// A problem among the participants that have a place in it: some contacts and rows, bodies at some velocities.
pub(crate) struct Posed<'a, 'p> {
    pub all: &'a [Participant<'p>],
    pub progress: &'a [Progress],
    pub contacts: &'a mut [Contact],
    pub rows: &'a mut [JointRow],
    pub h_s: f64,
    pub threads: &'a dyn ParallelFor,
    /// The velocities of a participant without the impulses sought, and the momentum that they leave open.
    pub free: Velocities,
    pub open: Velocities,
}

impl Posed<'_, '_> {
    /// Solves it, with storage for its members.
    pub fn solve(self, solver: &mut Solver, members: &mut ProblemMembers) -> Result<Report, StepError> {
        let Self { all, progress, contacts, rows, h_s, threads, free, open } = self;
        let ProblemMembers { places, members, lent } = members;
        let (mut list, mut lenders) = (recycled(std::mem::take(members)), recycled(std::mem::take(lent)));
        let taking = || places.iter().map(|at| (&all[*at], &progress[*at]));
        lenders.extend(taking().map(|(one, _)| one.member.lent()));
        list.extend(taking().zip(&lenders).map(|((one, state), lender)| Member {
            blocks: one.member.system().blocks,
            response: lender.as_ref().map(|lender| lender as &dyn Response),
            free: free(state),
            unanswered: open(state),
            now: &state.v_before,
            share: f64::from(state.part),
        }));
        move_sides(contacts, rows, |member| progress[member].place);
        let has_factor = |member: &Member<'_>| member.response.is_some() || member.free.len() <= FACTORED_BLOCKS_MAX;
        solver.settings.form = if list.iter().all(has_factor) { StepForm::Direct } else { StepForm::Iterative };
        let problem = Problem { h_s, members: &list, contacts, rows, threads };
        let outcome = solver.solve(&problem).map(|solution| solution.report);
        (*members, *lent) = (recycled(list), recycled(lenders));
        move_sides(contacts, rows, |place| places.get(place).copied());
        outcome.map_err(|error| {
            blame(&error, all, places);
            refused(&error, h_s)
        })
    }
}

/// Counts the members of all sides anew.
fn move_sides(contacts: &mut [Contact], rows: &mut [JointRow], to: impl Fn(usize) -> Option<usize>) {
    let contacts = contacts.iter_mut().flat_map(|contact| &mut contact.sides);
    contacts.chain(rows.iter_mut().flat_map(|row| &mut row.sides)).for_each(|side| side.move_members(&to));
}

/// Blames the participant whose matrix or velocities are none, of the members at these `places`.
fn blame(error: &ProblemError, all: &[Participant<'_>], places: &[usize]) {
    let (ProblemError::Member { member, .. } | ProblemError::NotPositiveDefinite { member, .. }) = *error else {
        return;
    };
    let blamed = places.get(member).and_then(|place| all.get(*place));
    blamed.into_iter().for_each(|one| one.member.reject(error.to_string()));
}

fn refused(error: &ProblemError, dt_s: f64) -> StepError {
    StepError::Diverged { model: "cluster", dt_s, what: error.to_string() }
}

/// Replaces impulses on the blocks of a member by the velocities that they make: A⁻¹ of them.
pub(crate) fn respond(member: &GuardedMember<'_>, impulses: &mut [DVec3], residual: &mut Vec<DVec3>) {
    if let Some(lent) = member.lent() {
        return lent.respond(impulses);
    }
    // block Gauss–Seidel: exact after one sweep where no blocks are coupled, as of rigid bodies
    impulses.clone_into(residual);
    impulses.fill(DVec3::ZERO);
    let blocks = member.system().blocks;
    for _ in 0..SWEEPS_MAX {
        let mut change = 0.0_f64;
        for at in 0..impulses.len() {
            let mut right = residual[at];
            let mut own = glam::DMat3::ZERO;
            for block in blocks {
                if block.row == at && block.column == at {
                    own += block.value;
                } else if block.row == at {
                    right -= block.value * impulses[block.column];
                } else if block.column == at {
                    right -= block.value.transpose() * impulses[block.row];
                }
            }
            let value = own.inverse() * right;
            change = change.max((value - impulses[at]).length() / value.length().max(f64::MIN_POSITIVE));
            impulses[at] = value;
        }
        if change <= f64::EPSILON {
            break;
        }
    }
}
