//! Failures of an export: the file, and why.

use std::path::{Path, PathBuf};

/// A file that could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A file or folder that cannot be made or written.
    #[error("{} cannot be written: {error}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// A folder for a series that already holds a file of the names that a series has.
    #[error("the series would overwrite {}; name another folder, or remove what is in this one", path.display())]
    Taken {
        /// The file.
        path: PathBuf,
    },
    /// A moment of an animation that is earlier than the one before, as after [`World::restore`](metachron_world::World::restore).
    #[error("{}: an animation goes forward, and a moment at {time_s} s came after one at {last_s} s", path.display())]
    Earlier {
        /// The file.
        path: PathBuf,
        /// The time of the moment.
        time_s: f32,
        /// That of the one before.
        last_s: f32,
    },
    /// An animation that would be too large.
    #[error("{} would have more than {bytes_max} bytes: it ends after {moments} moments, before {time_s} s; write fewer moments, or a shorter run", path.display())]
    TooLong {
        /// The file.
        path: PathBuf,
        /// The most that it may have, about.
        bytes_max: usize,
        /// The moments in it.
        moments: usize,
        /// The time of the first that has no room.
        time_s: f32,
    },
}

impl ExportError {
    /// For `map_err` of a call that concerns `path`.
    pub(super) fn at(path: &Path) -> impl Fn(std::io::Error) -> Self {
        move |error| Self::File { path: path.to_owned(), error }
    }
}
