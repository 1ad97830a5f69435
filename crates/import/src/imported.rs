//! The outcome of an import: a scene, its meshes, parts of the model that have no place in one, or why there is none.
//!
//! In: the results of the other modules. Out: plain data. Never here: how they are found.

/// A model as a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The text of the scene file.
    pub toml: String,
    /// The parts of the model that are not in it: first all that changes the motion, each in the order of the file.
    pub left_out: Vec<LeftOut>,
    /// The bodies of one robot that start inside each other, and pass through each other for that.
    pub overlaps: Vec<Overlap>,
    /// The files that the scene names and that are not there yet.
    pub files: Vec<MeshFile>,
}

/// A mesh that a scene needs beside it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MeshFile {
    /// Relative to the folder of the scene, with `/` between its parts.
    pub path: String,
    /// Its contents.
    pub bytes: Vec<u8>,
}

/// Two objects of a scene that start inside each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Overlap {
    /// The name of one.
    pub a: String,
    /// That of the other.
    pub b: String,
    /// Depth at the deepest point, metres.
    pub depth_m: f64,
}

/// A part of a model that a scene has no place for, or that is in it otherwise than in the model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LeftOut {
    /// The included file that it is in, as the model names it; `None` for the model's own.
    pub file: Option<String>,
    /// Line of that file, from 1.
    pub line: u32,
    /// Which element, such as ``joint `elbow`, dynamics``.
    pub element: String,
    /// The reason.
    pub what: String,
    /// Whether the scene moves otherwise than the model for that.
    pub changes_motion: bool,
}

impl LeftOut {
    /// The same, which changes no motion.
    pub(crate) fn harmless(self) -> Self {
        Self { changes_motion: false, ..self }
    }
}

impl std::fmt::Display for LeftOut {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}: {}", spot(self.file.as_deref(), self.line), self.element, self.what)
    }
}

/// A line, and the file that it is in where that is not the model's own.
fn spot(file: Option<&str>, line: u32) -> String {
    file.map_or_else(|| format!("line {line}"), |file| format!("line {line} of `{file}`"))
}

/// Why a model cannot be a scene.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {element}: {reason}", spot(file.as_deref(), *line))]
pub struct ImportError {
    /// The included file that it is in, as the model names it; `None` for the model's own.
    pub file: Option<String>,
    /// Line of that file, from 1.
    pub line: u32,
    /// Which element, such as ``link `arm`, inertial``.
    pub element: String,
    /// The fault, and the expected value.
    pub reason: String,
}
