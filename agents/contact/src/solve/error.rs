//! Why a contact problem is refused: what is wrong, and where.
//!
//! In: nothing. Out: one enum of errors. Never here: the checks themselves (`validate.rs`).

use std::error::Error;
use std::fmt;

/// Why a problem was refused. The solver keeps its state; the next problem may be solved with it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ProblemError {
    /// The step was zero, negative or not finite.
    Step {
        /// The step given, seconds.
        h_s: f64,
    },
    /// A member has a block outside its matrix, a share that is not above zero, or a number that is not finite.
    Member {
        /// Its place in the problem.
        member: usize,
        /// What about it.
        reason: &'static str,
    },
    /// The matrix of a member has no Cholesky factor.
    NotPositiveDefinite {
        /// Its place in the problem.
        member: usize,
        /// A block of it where the factor ended.
        block: usize,
    },
    /// A side has more blocks than it can hold.
    LongSide {
        /// How many were given.
        terms: usize,
    },
    /// A contact's data are not those of a contact.
    Contact {
        /// Its place in the problem.
        contact: usize,
        /// What about it.
        reason: &'static str,
    },
    /// The data of a joint's row are not those of one.
    Row {
        /// Its place in the problem.
        row: usize,
        /// What about it.
        reason: &'static str,
    },
}

impl fmt::Display for ProblemError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Step { h_s } => write!(f, "the step is {h_s} s; it must be finite and above zero"),
            Self::Member { member, reason } => write!(f, "member {member}: {reason}"),
            Self::NotPositiveDefinite { member, block } => {
                write!(f, "member {member}: its matrix is not positive definite at block {block}")
            }
            Self::LongSide { terms } => write!(f, "a side of {terms} blocks; {} is the most", super::SIDE_TERMS_MAX),
            Self::Contact { contact, reason } => write!(f, "contact {contact}: {reason}"),
            Self::Row { row, reason } => write!(f, "row {row}: {reason}"),
        }
    }
}

impl Error for ProblemError {}
