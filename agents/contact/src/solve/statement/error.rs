//! Why a contact problem is refused: the fault, and its place.
//!
//! In: nothing. Out: one enum of errors. Never here: the checks themselves (`validate.rs`).

use crate::solve::SIDE_TERMS_MAX;

/// Why a problem was refused. The solver keeps its state; the next problem may be solved with it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProblemError {
    /// The step was zero, negative or not finite.
    #[error("the step is {h_s} s; it must be finite and above zero")]
    Step {
        /// The step given, seconds.
        h_s: f64,
    },
    /// A member has a block outside its matrix, a share that is not above zero, or a number that is not finite.
    #[error("member {member}: {reason}")]
    Member {
        /// Its place in the problem.
        member: usize,
        /// Its fault.
        reason: &'static str,
    },
    /// The matrix of a member has no Cholesky factor.
    #[error("member {member}: its matrix is not positive definite at block {block}")]
    NotPositiveDefinite {
        /// Its place in the problem.
        member: usize,
        /// A block of it where the factor ended.
        block: usize,
    },
    /// A side has more blocks than it can hold.
    #[error("a side of {terms} blocks; {SIDE_TERMS_MAX} is the most")]
    LongSide {
        /// How many were given.
        terms: usize,
    },
    /// The data of a contact make no contact.
    #[error("contact {contact}: {reason}")]
    Contact {
        /// Its place in the problem.
        contact: usize,
        /// Its fault.
        reason: &'static str,
    },
    /// The data of a joint's row make no row.
    #[error("row {row}: {reason}")]
    Row {
        /// Its place in the problem.
        row: usize,
        /// Its fault.
        reason: &'static str,
    },
}
