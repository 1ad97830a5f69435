//! The checks of a contact problem, so that the solve meets only finite numbers and places that exist.
//!
//! In: a problem. Out: nothing, or its fault. Never here: whether matrices are positive definite (their factor tells).

use super::error::ProblemError;
use super::joint::{Hold, JointRow, Pressed};
use super::problem::{Block, Contact, Member, Problem};
use super::side::{Side, SidePart, SideTerm};
use glam::{DMat3, DVec3};

/// By how much a frame may miss being orthonormal, and a diagonal block being symmetric against its largest entry.
const SLACK: f64 = 1e-6;

/// Whether a problem can be solved.
///
/// # Errors
/// The first fault of a problem, with its place.
pub(crate) fn validate(problem: &Problem<'_>) -> Result<(), ProblemError> {
    let h_s = problem.h_s;
    if !(h_s.is_finite() && h_s > 0.0) {
        return Err(ProblemError::Step { h_s });
    }
    for (place, member) in problem.members.iter().enumerate() {
        named(member_fault(member), |reason| ProblemError::Member { member: place, reason })?;
    }
    for (place, contact) in problem.contacts.iter().enumerate() {
        let fault = contact_fault(contact).or_else(|| sides_fault(&contact.sides, problem.members));
        named(fault, |reason| ProblemError::Contact { contact: place, reason })?;
    }
    for (place, row) in problem.rows.iter().enumerate() {
        let sides = || sides_fault(&row.sides, problem.members);
        let fault = row_fault(row).or_else(|| pressed_fault(row, problem.contacts.len())).or_else(sides);
        named(fault, |reason| ProblemError::Row { row: place, reason })?;
    }
    Ok(())
}

fn named(fault: Option<&'static str>, error: impl Fn(&'static str) -> ProblemError) -> Result<(), ProblemError> {
    fault.map_or(Ok(()), |reason| Err(error(reason)))
}

/// The fault of the first check that does not hold.
fn first_fault<const N: usize>(checks: [(bool, &'static str); N]) -> Option<&'static str> {
    checks.into_iter().find(|(holds, _)| !holds).map(|(_, fault)| fault)
}

fn member_fault(member: &Member<'_>) -> Option<&'static str> {
    let Member { blocks, free, unanswered, share, .. } = *member;
    let is_even = |m: &DMat3| {
        let size = m.to_cols_array().iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        !(*m - m.transpose()).to_cols_array().iter().any(|d| d.abs() > SLACK * size)
    };
    let lies_within = |b: &Block| b.row < free.len() && b.column <= b.row;
    let counts = unanswered.is_empty() || unanswered.len() == free.len();
    first_fault([
        (share.is_finite() && share > 0.0, "its share must be finite and above zero"),
        (free.iter().all(|v| v.is_finite()), "a free velocity is not finite"),
        (counts, "what its free velocities leave unanswered must be one momentum for each of them, or none"),
        (unanswered.iter().all(|r| r.is_finite()), "what a free velocity leaves unanswered is not finite"),
        (blocks.iter().all(lies_within), "a block lies outside the lower half of its matrix"),
        (blocks.iter().all(|b| b.value.is_finite()), "a block is not finite"),
        (blocks.iter().all(|b| b.row != b.column || is_even(&b.value)), "a diagonal block is not symmetric"),
    ])
}

fn contact_fault(contact: &Contact) -> Option<&'static str> {
    let Contact { gap_m, overlap_m, friction, parting_m_s, owed_slip_m, warm_n_s, load_n_s, .. } = *contact;
    let frame = contact.frame();
    let off = frame.transpose() * frame - DMat3::IDENTITY;
    let is_frame = frame.is_finite() && !off.to_cols_array().iter().any(|d| d.abs() > SLACK);
    let of_last = owed_slip_m.is_finite() && warm_n_s.is_finite() && load_n_s.is_finite();
    first_fault([
        (is_frame, "normal and tangents are not orthonormal"),
        ((gap_m + overlap_m).is_finite(), "its gap is not finite"),
        (friction.is_finite() && friction >= 0.0, "its friction must be finite and not below zero"),
        (parting_m_s >= 0.0 && parting_m_s.is_finite(), "the speed at which it parts must be at least 0"),
        (contact.surface_m_s.is_finite(), "its approach or the velocity of its surface is not finite"),
        (of_last, "its slip owed or its impulse of the last step is not finite"),
    ])
}

fn row_fault(row: &JointRow) -> Option<&'static str> {
    let JointRow { target_m_s, warm_n_s, owed_slip_m, compliance_per_kg, .. } = *row;
    let (axis, is_bounded) = match row.hold {
        Hold::All { limit_n_s } => (DVec3::X, limit_n_s >= 0.0),
        Hold::Across { axis, limit_n_s } => (axis, limit_n_s >= 0.0),
        Hold::Along { axis, low_n_s, high_n_s } => (axis, low_n_s <= 0.0 && high_n_s >= 0.0),
    };
    let is_finite = target_m_s.is_finite() && warm_n_s.is_finite() && owed_slip_m.is_finite();
    let gives_way = compliance_per_kg.is_none_or(|r| r.is_finite() && r > 0.0);
    first_fault([
        (is_finite, "its target, its slip owed or its impulse of the last step is not finite"),
        (gives_way, "its compliance must be finite and above zero"),
        ((axis.length() - 1.0).abs() <= SLACK, "its axis is not of length 1"),
        (is_bounded, "zero must lie within the bounds of its impulse"),
    ])
}

fn pressed_fault(row: &JointRow, contacts: usize) -> Option<&'static str> {
    let Pressed { contact, reach_m } = row.pressed?;
    let is_along = matches!(row.hold, Hold::Along { .. });
    first_fault([
        (contact < contacts, "it is pressed by a contact that there is not"),
        (is_along, "only a row along an axis can be bounded by what presses a contact"),
        (reach_m >= 0.0 && reach_m.is_finite(), "its reach must be finite and not below zero"),
    ])
}

fn sides_fault(sides: &[Side; 2], members: &[Member<'_>]) -> Option<&'static str> {
    if sides.iter().all(|side| side.terms().is_empty()) {
        return Some("neither side moves");
    }
    sides.iter().flat_map(Side::parts).find_map(|SidePart { member, terms }| {
        let Some(member) = members.get(member) else { return Some("a side names a member that there is not") };
        let all = |holds: fn(&SideTerm, usize) -> bool| terms.iter().all(|term| holds(term, member.free.len()));
        first_fault([
            (all(|term, size| term.block < size), "a side names a block that its member has not"),
            (all(|term, _| term.map.is_finite()), "a map of a side is not finite"),
        ])
    })
}
