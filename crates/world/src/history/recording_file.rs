//! The file of a recording, whose errors name it.
//!
//! In: a path, bytes. Out: a file with them. Never here: their meaning ([`super::recording`]).

use super::recording::RecordError;
use std::fs::File;
use std::io::{Error, Result, Write};
use std::path::PathBuf;

/// A new file for a recording: where it takes no more, the error of a recording says which file that is.
#[derive(Debug)]
pub struct RecordingFile {
    path: PathBuf,
    file: File,
}

impl RecordingFile {
    /// Makes the file at `path` anew.
    ///
    /// # Errors
    /// [`RecordError::File`].
    pub fn create(path: impl Into<PathBuf>) -> std::result::Result<Self, RecordError> {
        let path = path.into();
        match File::create(&path) {
            Ok(file) => Ok(Self { path, file }),
            Err(error) => Err(RecordError::File { path, error }),
        }
    }

    fn named(&self, error: &Error) -> Error {
        Error::new(error.kind(), format!("{}: {error}", self.path.display()))
    }
}

impl Write for RecordingFile {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.file.write(bytes).map_err(|error| self.named(&error))
    }

    fn flush(&mut self) -> Result<()> {
        self.file.flush().map_err(|error| self.named(&error))
    }
}
