//! Where files that a model names are.
//!
//! In: a path as a model writes it. Out: the path as the scene writes it, the text of what is included. Never here: what that means.

use crate::ImportError;
use crate::xml::Element;
use std::path::{Component, Path, PathBuf};

/// The folder of a model's file, and that of the scene which it becomes: scenes name meshes relative to their own.
#[derive(Debug, Clone, Copy)]
pub struct Folders<'a> {
    /// The folder of the model.
    pub model: &'a Path,
    /// The folder of the scene.
    pub scene: &'a Path,
}

impl<'a> From<&'a Path> for Folders<'a> {
    fn from(folder: &'a Path) -> Self {
        Self { model: folder, scene: folder }
    }
}

/// Mesh files that a scene can name.
const MESHES: [&str; 3] = ["glb", "obj", "stl"];

/// Whether scenes read meshes of a file's kind.
pub(crate) fn is_readable(name: &str) -> bool {
    let extension = Path::new(name).extension().and_then(|e| e.to_str()).map(str::to_lowercase);
    extension.is_some_and(|e| MESHES.contains(&e.as_str()))
}

impl Folders<'_> {
    /// The path in the scene of a file that `element` names.
    ///
    /// # Errors
    /// Where there is no such file.
    pub(crate) fn mesh(&self, element: &Element, name: &str) -> Result<String, ImportError> {
        let found = self.candidates(name).into_iter().find(|path| path.is_file());
        let found = found.ok_or_else(|| {
            element.wrong(format!("names `{name}`, and there is no such file; expected it beside the model"))
        })?;
        self.in_scene(&found).ok_or_else(|| {
            element.wrong(format!("names `{name}`, which cannot be reached from the folder of the scene"))
        })
    }

    /// A file that `element` includes, which is beside the model.
    ///
    /// # Errors
    /// Where there is none that can be read.
    pub(crate) fn included(&self, element: &Element, name: &str) -> Result<IncludedFile, ImportError> {
        read_text(&self.model.join(name))
            .map_err(|why| element.wrong(format!("names `{name}`, which cannot be read beside the model: {why}")))
    }

    /// Where the file may be: `package://NAME/REST` is in a folder NAME at or around the model, other paths are beside it.
    fn candidates(&self, name: &str) -> Vec<PathBuf> {
        let Some(path) = name.strip_prefix("package://") else {
            return vec![self.model.join(name.strip_prefix("file://").unwrap_or(name))];
        };
        let rest = path.split_once('/').map_or(path, |(_, rest)| rest);
        let model = absolute(self.model).unwrap_or_else(|| self.model.to_path_buf());
        model.ancestors().flat_map(|folder| [folder.join(path), folder.join(rest)]).collect()
    }

    /// A file's path from the folder of the scene, with `/` between its parts.
    fn in_scene(&self, file: &Path) -> Option<String> {
        let (file, scene) = (plain(file)?, plain(self.scene)?);
        let common = file.iter().zip(&scene).take_while(|(a, b)| a == b).count();
        // on another drive
        if common == 0 {
            return None;
        }
        let up = std::iter::repeat_n("..".to_owned(), scene.len() - common);
        Some(up.chain(file[common..].iter().cloned()).collect::<Vec<_>>().join("/"))
    }
}

/// The text of a file that a model includes.
#[derive(Debug)]
pub(crate) struct IncludedFile {
    /// The same for all names that the file has.
    pub(crate) path: PathBuf,
    pub(crate) text: String,
}

/// Longest file that a model includes, bytes: as of scenes.
const INCLUDED_BYTES_MAX: u64 = 16 << 20;

fn read_text(path: &Path) -> Result<IncludedFile, String> {
    let file = std::fs::metadata(path).map_err(|why| why.to_string())?;
    if !file.is_file() {
        return Err("it is no plain file".to_owned());
    }
    if file.len() > INCLUDED_BYTES_MAX {
        return Err(format!("it has {} bytes, more than {INCLUDED_BYTES_MAX}", file.len()));
    }
    let text = std::fs::read_to_string(path).map_err(|why| why.to_string())?;
    let path = path.canonicalize().map_err(|why| why.to_string())?;
    Ok(IncludedFile { path, text })
}

/// A path from the root; the empty one, which the folder of a bare file name is, is the folder of the program.
fn absolute(path: &Path) -> Option<PathBuf> {
    std::path::absolute(Path::new(".").join(path)).ok()
}

/// The parts of a path from the root, without `.` and `..`.
fn plain(path: &Path) -> Option<Vec<String>> {
    let mut parts = Vec::new();
    for part in absolute(path)?.components() {
        match part {
            Component::ParentDir => drop(parts.pop()),
            Component::CurDir => {}
            part => parts.push(part.as_os_str().to_str()?.to_owned()),
        }
    }
    Some(parts)
}
