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
}

impl ExportError {
    /// For `map_err` of a call that concerns `path`.
    pub(super) fn at(path: &Path) -> impl Fn(std::io::Error) -> Self {
        move |error| Self::File { path: path.to_owned(), error }
    }
}
