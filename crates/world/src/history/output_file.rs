//! Files that are written: whole or not at all, or growing under their names.
//!
//! In: a path, bytes. Out: a file with them, in place of one that was there, whose bytes stay as they are wherever else they have a name.
//! Never here: what the bytes mean, which files may be replaced.

use super::recording::RecordError;
use std::fs::{self, File, OpenOptions};
use std::io::{Error, ErrorKind, Result, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::process;

/// Links that may follow each other to a file, as Linux has it.
const LINKS_MAX: usize = 40;

/// A file that is being written.
///
/// It is made beside the place that its path leads to, as `metachron-PROCESS-NUMBER.partial` in the same folder, and takes that place by a
/// rename: one that is there keeps its permissions, and stays as it was where the new one is dropped or its process ends before that. A link is
/// followed, and leads to the new file. Pipes and devices take bytes as they come, and so does a file that this process has open already and that is
/// named by that (`/dev/stdout`), at its end. Nothing is buffered.
#[derive(Debug)]
pub struct OutputFile {
    file: File,
    beside: Option<Beside>,
}

/// The names of a file that is not in its place yet.
#[derive(Debug)]
struct Beside {
    partial: PathBuf,
    target: PathBuf,
}

impl OutputFile {
    /// Begins a file that takes its place when it is complete ([`OutputFile::complete`]).
    ///
    /// # Errors
    /// A folder in which no file can be made, a file that may not be written, a folder at the path.
    pub fn whole(path: impl AsRef<Path>) -> Result<Self> {
        let (path, target) = (path.as_ref(), destination(path.as_ref()));
        let there = match fs::metadata(path) {
            Ok(about) => {
                // a file that may not be written is not replaced either
                let file = OpenOptions::new().append(true).open(path)?;
                if !about.is_file() || is_of_process(&target) {
                    return Ok(Self { file, beside: None });
                }
                Some(about.permissions())
            }
            Err(error) if error.kind() == ErrorKind::NotFound => None,
            Err(error) => return Err(error),
        };
        let partials = (0..).map(|number: u32| format!("metachron-{}-{number}.partial", process::id()));
        let made = partials.map(|name| target.with_file_name(name)).find_map(|partial| {
            match OpenOptions::new().write(true).create_new(true).open(&partial) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => None,
                made => Some(made.map(|file| (file, partial))),
            }
        });
        let of_folder = |error: Error| {
            let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            let why = format!(
                "a file is made anew before it takes its place, and its folder {} takes none",
                folder.display()
            );
            Error::new(error.kind(), format!("{why}: {error}"))
        };
        let (file, partial) = made.ok_or(ErrorKind::AlreadyExists)?.map_err(of_folder)?;
        let it = Self { file, beside: Some(Beside { partial, target }) };
        there.map_or(Ok(()), |permissions| it.file.set_permissions(permissions))?;
        Ok(it)
    }

    /// Begins a file that is in its place at once, so that it can be read while it grows and has all that was written where its process ends.
    ///
    /// # Errors
    /// The errors of [`OutputFile::whole`].
    pub fn growing(path: impl AsRef<Path>) -> Result<Self> {
        let mut it = Self::whole(path)?;
        it.take_place()?;
        Ok(it)
    }

    /// Ends a file: it is on the disk, then in its place.
    ///
    /// # Errors
    /// A disk that does not take it: what was in its place is there still.
    pub fn complete(mut self) -> Result<()> {
        // pipes and devices hold nothing back
        self.beside.as_ref().map_or(Ok(()), |_| self.file.sync_all())?;
        self.take_place()
    }

    /// Writes a whole file.
    ///
    /// # Errors
    /// The errors of [`OutputFile::whole`] and [`OutputFile::complete`].
    pub fn write(path: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> Result<()> {
        let mut file = Self::whole(path)?;
        file.write_all(bytes.as_ref())?;
        file.complete()
    }

    fn take_place(&mut self) -> Result<()> {
        let Some(Beside { partial, target }) = &self.beside else { return Ok(()) };
        fs::rename(partial, target)?;
        self.beside = None;
        Ok(())
    }
}

impl Drop for OutputFile {
    fn drop(&mut self) {
        if let Some(Beside { partial, .. }) = &self.beside {
            // a second failure, of a folder that can no longer be written, is of no use to the caller
            let _ = fs::remove_file(partial);
        }
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        self.file.flush()
    }
}

impl Seek for OutputFile {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        self.file.seek(to)
    }
}

/// Where the links of a path lead, also to a file that is not there.
fn destination(path: &Path) -> PathBuf {
    let next = |at: &PathBuf| {
        let link = fs::read_link(at).ok().filter(|_| !is_of_process(at))?;
        Some(at.parent().unwrap_or(Path::new("")).join(link))
    };
    std::iter::successors(Some(path.to_owned()), next).take(LINKS_MAX + 1).last().unwrap_or_default()
}

/// Whether a path names what a process has open, by its number: a link that leads nowhere else.
fn is_of_process(path: &Path) -> bool {
    ["/proc", "/dev/fd"].iter().any(|folder| path.starts_with(folder))
}

/// Whether two paths lead to one file, existing or not, however they are written and by links of both kinds. Folders, pipes and devices are none.
#[must_use]
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    place(a).is_some_and(|a| place(b) == Some(a))
}

/// A file on a disk: its numbers, or where it would be.
#[derive(PartialEq)]
enum Place {
    #[cfg(unix)]
    Numbers([u64; 2]),
    Path(PathBuf),
}

fn place(path: &Path) -> Option<Place> {
    let (given, path) = (path, destination(path));
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match fs::metadata(given) {
        Ok(about) if !about.is_file() => None,
        #[cfg(unix)]
        Ok(about) => {
            use std::os::unix::fs::MetadataExt;
            Some(Place::Numbers([about.dev(), about.ino()]))
        }
        _ => Some(Place::Path(folder.canonicalize().ok()?.join(path.file_name()?))),
    }
}

/// A new file for a recording, which grows: where it takes no more, the error of a recording says which file that is.
#[derive(Debug)]
pub struct RecordingFile {
    path: PathBuf,
    file: OutputFile,
}

impl RecordingFile {
    /// Makes the file at `path` anew.
    ///
    /// # Errors
    /// [`RecordError::File`].
    pub fn create(path: impl Into<PathBuf>) -> std::result::Result<Self, RecordError> {
        let path = path.into();
        match OutputFile::growing(&path) {
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
