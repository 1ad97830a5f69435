//! The checks of a contact problem, so that the solve meets only finite numbers and places that exist.
//!
//! In: a problem. Out: nothing, or what is wrong. Never here: whether matrices are positive definite (their factor tells).

use super::error::ProblemError;
use super::joint::{Hold, JointRow};
use super::problem::{Block, Contact, Member, Problem};
use super::side::Side;
use glam::{DMat3, DVec3};

/// By how much a frame may miss being orthonormal, and a diagonal block being symmetric against its largest entry.
const SLACK: f64 = 1e-6;

/// Whether a problem can be solved.
///
/// # Errors
/// What is wrong first, with its place.
pub(super) fn validate(problem: &Problem<'_>) -> Result<(), ProblemError> {
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

fn member_fault(member: &Member<'_>) -> Option<&'static str> {
    let size = member.free.len();
    if !(member.share.is_finite() && member.share > 0.0) {
        return Some("its share must be finite and above zero");
    }
    if !member.free.iter().all(|v| v.is_finite()) {
        return Some("a free velocity is not finite");
    }
    if !(member.unanswered.is_empty() || member.unanswered.len() == size) {
        return Some("what its free velocities leave unanswered must be one momentum for each of them, or none");
    }
    if !member.unanswered.iter().all(|r| r.is_finite()) {
        return Some("what a free velocity leaves unanswered is not finite");
    }
    if member.blocks.iter().any(|b| b.row >= size || b.column > b.row) {
        return Some("a block lies outside the lower half of its matrix");
    }
    if !member.blocks.iter().all(|b| b.value.is_finite()) {
        return Some("a block is not finite");
    }
    let lopsided = |m: &DMat3| {
        let size = m.to_cols_array().iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        (*m - m.transpose()).to_cols_array().iter().any(|d| d.abs() > SLACK * size)
    };
    let diagonal = |b: &&Block| b.row == b.column;
    member.blocks.iter().filter(diagonal).any(|b| lopsided(&b.value)).then_some("a diagonal block is not symmetric")
}

fn contact_fault(contact: &Contact) -> Option<&'static str> {
    let frame = contact.frame();
    let off = frame.transpose() * frame - DMat3::IDENTITY;
    if !frame.is_finite() || off.to_cols_array().iter().any(|d| d.abs() > SLACK) {
        return Some("normal and tangents are not orthonormal");
    }
    if !(contact.gap_m + contact.overlap_m).is_finite() {
        return Some("its gap is not finite");
    }
    if !(contact.friction.is_finite() && contact.friction >= 0.0) {
        return Some("its friction must be finite and not below zero");
    }
    if !(contact.parting_m_s >= 0.0 && contact.parting_m_s.is_finite()) {
        return Some("the speed at which it parts must be at least 0");
    }
    if !contact.surface_m_s.is_finite() {
        return Some("its approach or the velocity of its surface is not finite");
    }
    let vectors = contact.owed_slip_m.is_finite() && contact.warm_n_s.is_finite() && contact.load_n_s.is_finite();
    (!vectors).then_some("its slip owed or its impulse of the last step is not finite")
}

fn row_fault(row: &JointRow) -> Option<&'static str> {
    if !(row.target_m_s.is_finite() && row.warm_n_s.is_finite() && row.owed_slip_m.is_finite()) {
        return Some("its target, its slip owed or its impulse of the last step is not finite");
    }
    if row.compliance_per_kg.is_some_and(|r| !(r.is_finite() && r > 0.0)) {
        return Some("its compliance must be finite and above zero");
    }
    let (axis, bounded) = match row.hold {
        Hold::All { limit_n_s } => (DVec3::X, limit_n_s >= 0.0),
        Hold::Across { axis, limit_n_s } => (axis, limit_n_s >= 0.0),
        Hold::Along { axis, low_n_s, high_n_s } => (axis, low_n_s <= 0.0 && high_n_s >= 0.0),
    };
    let off = (axis.length() - 1.0).abs();
    if off > SLACK || off.is_nan() {
        return Some("its axis is not of length 1");
    }
    (!bounded).then_some("zero must lie within the bounds of its impulse")
}

fn pressed_fault(row: &JointRow, contacts: usize) -> Option<&'static str> {
    let pressed = row.pressed?;
    if pressed.contact >= contacts {
        return Some("it is pressed by a contact that there is not");
    }
    if !matches!(row.hold, Hold::Along { .. }) {
        return Some("only a row along an axis can be bounded by what presses a contact");
    }
    (!(pressed.reach_m >= 0.0 && pressed.reach_m.is_finite())).then_some("its reach must be finite and not below zero")
}

fn sides_fault(sides: &[Side; 2], members: &[Member<'_>]) -> Option<&'static str> {
    if sides.iter().all(|side| side.terms().is_empty()) {
        return Some("neither side moves");
    }
    sides.iter().filter(|side| !side.terms().is_empty()).find_map(|side| {
        let Some(member) = members.get(side.member) else { return Some("a side names a member that there is not") };
        if side.terms().iter().any(|term| term.block >= member.free.len()) {
            return Some("a side names a block that its member has not");
        }
        (!side.terms().iter().all(|term| term.map.is_finite())).then_some("a map of a side is not finite")
    })
}
