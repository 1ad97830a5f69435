//! What can go wrong with an export: the file, and why.

use std::path::{Path, PathBuf};

/// A file that could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A file or folder that cannot be made or written.
    #[error("{} cannot be written: {source}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A folder for a series that already holds one, which would be mixed with the new one.
    #[error("the folder {} already holds a series (series.pvd); name another, or remove it", path.display())]
    Taken {
        /// The folder.
        path: PathBuf,
    },
}

impl ExportError {
    /// For `map_err` of a call that concerns `path`.
    pub(super) fn at(path: &Path) -> impl Fn(std::io::Error) -> Self {
        move |source| Self::File { path: path.to_owned(), source }
    }
}
