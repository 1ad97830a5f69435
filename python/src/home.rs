//! The process that a world or an adapter belongs to: a child that was forked off it has the memory of both, and none of their threads.
//!
//! In: nothing. Out: whether a call is made at home, else the error that says what to do. Never here: a fork.

use pyo3::PyResult;
use pyo3::exceptions::PyRuntimeError;

/// A process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Home(u32);

impl Home {
    /// The present one.
    pub fn here() -> Self {
        Self(std::process::id())
    }

    /// Whether it is the present one.
    pub fn is_here(self) -> bool {
        self == Self::here()
    }

    /// An error in a child: a child that waits there for threads of the parent waits for ever.
    pub fn check(self, what: &str) -> PyResult<()> {
        if self.is_here() {
            return Ok(());
        }
        let message = format!(
            "{what} has no threads in a process that was forked off the one that made it: let the child make its own, \
             or start children by \"spawn\""
        );
        Err(PyRuntimeError::new_err(message))
    }
}
