//! Errors that end a run early. Each is shown once, by the command line or the window.

use crate::compositor::GpuError;
use crate::runtime;

/// Reason why a scene could not be played, or not to its end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// A model rejected its object.
    #[error("object \"{name}\": {reason}")]
    Build {
        /// The object's name.
        name: String,
        /// The model's message.
        reason: String,
    },
    /// The agents could not be started.
    #[error(transparent)]
    Run(#[from] runtime::RunError),
    /// The adapter failed.
    #[error("drawing failed")]
    Draw(#[source] GpuError),
    /// The picture could not be written.
    #[error(transparent)]
    Picture(GpuError),
}
