//! Files that commands write.
//!
//! In: a path, bytes, files that are read. Out: a file, or why it is not to be written. Never here: what is in it.

use super::output::BadInput;
use anyhow::Context;
use metachron_world::{OutputFile, is_same_file};
use std::path::Path;

/// Writes a file, in place of one that is there once it is whole.
pub fn write_file(path: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> anyhow::Result<()> {
    let path = path.as_ref();
    OutputFile::write(path, bytes).with_context(|| format!("{} cannot be written", path.display()))
}

/// Refuses a path in a folder that does not exist, or of a folder.
pub fn check_place(path: &Path) -> anyhow::Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    if folder.is_some_and(|f| !f.is_dir()) {
        return Err(BadInput(format!("the folder of {} does not exist", path.display())).into());
    }
    if path.is_dir() {
        return Err(BadInput(format!("{} is a folder; expected a file", path.display())).into());
    }
    Ok(())
}

/// Refuses a path that is already taken, and those that [`check_place`] refuses.
pub fn check_output_path(path: &Path, flag: &str, force: bool) -> anyhow::Result<()> {
    check_place(path)?;
    if path.exists() && !force {
        let why = format!("{} exists already; --force overwrites it, {flag} FILE names another file", path.display());
        return Err(BadInput(why).into());
    }
    Ok(())
}

/// Refuses an output that is one of the files `read`, by a link too; `reader` is what is read from them.
pub fn check_unread<'a>(
    flag: &str,
    path: &Path,
    reader: &str,
    read: impl IntoIterator<Item = &'a Path>,
) -> anyhow::Result<()> {
    let Some(same) = read.into_iter().find(|read| is_same_file(path, read)) else { return Ok(()) };
    let (path, same) = (path.display(), same.display());
    Err(BadInput(format!("{flag} {path} would overwrite {same}, which {reader} is read from; name another file"))
        .into())
}
