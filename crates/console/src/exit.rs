//! Exit codes of every command.

use std::process::ExitCode;

/// How a command ends: the exit codes that scripts can rely on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// Success.
    Ok,
    /// The run failed.
    Failed,
    /// The input or the usage was wrong.
    BadInput,
    /// A goal given with `--fail-on` was missed.
    GoalMissed,
    /// Ctrl-C; the results so far have been written.
    Interrupted,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(match exit {
            Exit::Ok => 0,
            Exit::Failed => 1,
            Exit::BadInput => 2,
            Exit::GoalMissed => 4,
            Exit::Interrupted => 130,
        })
    }
}
