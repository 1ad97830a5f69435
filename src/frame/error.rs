//! Errors that end a run early. Each is shown once, by the command line or the window.

use crate::compositor::GpuError;
use crate::world::WorldError;

/// Reason why a scene could not be played, or not to its end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The agents could not be started.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The adapter failed.
    #[error("drawing failed")]
    Draw(#[source] GpuError),
    /// The picture could not be written.
    #[error(transparent)]
    Picture(GpuError),
}
