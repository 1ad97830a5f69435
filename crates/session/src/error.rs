//! Errors that end a run early. Each is shown once, by the command line or the window.

#[cfg(feature = "picture")]
use metachron_render::GpuError;
use metachron_world::{CheckpointError, RecordError, WorldError};
#[cfg(feature = "picture")]
use std::path::PathBuf;

/// Reason why a scene could not be played, or not to its end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The agents could not be started.
    #[error(transparent)]
    World(#[from] WorldError),
    /// A recording could not be repeated.
    #[error("the recording cannot be repeated: {0}")]
    Replay(#[from] CheckpointError),
    /// A replay came to something that the recorded run did not.
    #[error("the replay stopped: {0}")]
    Diverged(String),
    /// The time of a world elsewhere stands, and does not come to the end of the run.
    #[error("the time of the world has stood at {at_s} s for {stood_s:.1} s: its host lets it pass, or a caller")]
    Stands {
        /// Its time, seconds.
        at_s: f64,
        /// For how long, seconds of wall time.
        stood_s: f64,
    },
    /// A recording could not be written to its end.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The scene has no camera of that name.
    #[error("the scene has no camera \"{name}\"; its cameras are [{known}]")]
    NoCamera {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// The adapter failed.
    #[cfg(feature = "picture")]
    #[error("drawing failed")]
    Draw(#[source] GpuError),
    /// The picture could not be written.
    #[cfg(feature = "picture")]
    #[error(transparent)]
    Picture(GpuError),
    /// A picture or the film could not be written.
    #[cfg(feature = "picture")]
    #[error("{} cannot be written: {error}", path.display())]
    File {
        /// The intended path.
        path: PathBuf,
        /// The reason.
        error: std::io::Error,
    },
}
