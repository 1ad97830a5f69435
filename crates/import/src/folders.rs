//! Where files that a model names are.
//!
//! In: a path as a model writes it. Out: the path as the scene writes it, the text of an included file. Never here: its
//! meaning, files that are opened (the caller's [`ReadFile`] does).

use crate::imported::ImportError;
use crate::xml::Element;
use metachron_geometry::Triangles;
use std::path::{Component, Path, PathBuf};

/// Gives the bytes of the file at a path, or why there are none: [`std::fs::read`], or one that reads an archive.
pub type ReadFile<'a> = &'a dyn Fn(&Path) -> std::io::Result<Vec<u8>>;

/// Gives the triangles of an STL, OBJ or .glb file, or the fault of the file; none of a file of points.
pub type ReadSurface<'a> = &'a dyn Fn(&[u8]) -> Result<Triangles, String>;

/// The folder of a model's file, and that of the scene which it becomes: scenes name meshes relative to their own.
#[derive(Clone, Copy)]
pub struct Folders<'a> {
    /// The folder of the model.
    pub model: &'a Path,
    /// The folder of the scene.
    pub scene: &'a Path,
    /// Reads files that the model includes, and meshes that scenes cannot name; `None` refuses a model in several
    /// files.
    pub read: Option<ReadFile<'a>>,
    /// Reads the meshes that are mirrored, stretched or weigh; `None` lists them as left out.
    pub surface: Option<ReadSurface<'a>>,
}

impl std::fmt::Debug for Folders<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Folders").field("model", &self.model).field("scene", &self.scene).finish_non_exhaustive()
    }
}

/// One folder for both, of a model in one file.
impl<'a> From<&'a Path> for Folders<'a> {
    fn from(folder: &'a Path) -> Self {
        Self { model: folder, scene: folder, read: None, surface: None }
    }
}

/// The ending of a file's name, after its last point, in small letters.
pub(crate) fn extension(name: &str) -> String {
    Path::new(name).extension().and_then(|e| e.to_str()).map(str::to_lowercase).unwrap_or_default()
}

impl Folders<'_> {
    /// A file that `element` names.
    ///
    /// # Errors
    /// Where there is no such file.
    pub(crate) fn find(&self, element: &Element, name: &str) -> Result<PathBuf, ImportError> {
        let found = self.candidates(name).into_iter().find(|path| path.is_file());
        found.ok_or_else(|| {
            element.wrong(format!("names `{name}`, and there is no such file; expected it beside the model"))
        })
    }

    /// The path in the scene of a file that `element` names.
    ///
    /// # Errors
    /// Where it has none.
    pub(crate) fn in_scene(&self, element: &Element, name: &str, found: &Path) -> Result<String, ImportError> {
        self.relative(found).ok_or_else(|| {
            element.wrong(format!("names `{name}`, which cannot be reached from the folder of the scene"))
        })
    }

    /// A file that `element` includes, which is beside the model.
    ///
    /// # Errors
    /// Where there is none that can be read.
    pub(crate) fn included(&self, element: &Element, name: &str) -> Result<IncludedFile, ImportError> {
        let Some(read) = self.read else {
            let reason = format!("names `{name}`, and no included file is read here; expected a model in one file");
            return Err(element.wrong(reason));
        };
        let path = self.model.join(name);
        let utf8 = |bytes| String::from_utf8(bytes).map_err(std::io::Error::other);
        let text = read(&path)
            .and_then(utf8)
            .map_err(|why| element.wrong(format!("names `{name}`, which cannot be read beside the model: {why}")))?;
        Ok(IncludedFile { path: plain(&path).unwrap_or(path), text })
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
    pub(crate) fn relative(&self, file: &Path) -> Option<String> {
        let (file, scene) = (plain(file)?, plain(self.scene)?);
        let common = file.iter().zip(&scene).take_while(|(a, b)| a == b).count();
        // on another drive
        if common == 0 {
            return None;
        }
        let up = std::iter::repeat_n(Some(".."), scene.iter().count() - common);
        let parts: Option<Vec<&str>> = up.chain(file.iter().skip(common).map(|part| part.to_str())).collect();
        Some(parts?.join("/"))
    }
}

/// The text of a file that a model includes.
#[derive(Debug)]
pub(crate) struct IncludedFile {
    /// The same however a model writes it.
    pub(crate) path: PathBuf,
    pub(crate) text: String,
}

/// A path from the root; the empty one, which the folder of a bare file name is, is the folder of the program.
fn absolute(path: &Path) -> Option<PathBuf> {
    std::path::absolute(Path::new(".").join(path)).ok()
}

/// A path from the root, without `.` and `..`.
pub(crate) fn plain(path: &Path) -> Option<PathBuf> {
    let mut plain = PathBuf::new();
    for part in absolute(path)?.components() {
        match part {
            Component::ParentDir => drop(plain.pop()),
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    Some(plain)
}
