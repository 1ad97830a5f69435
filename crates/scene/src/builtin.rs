//! Scenes that a program carries, by name.
//!
//! In: a program's texts, once ([`provide`]). Out: sources by name. Never here: the texts themselves.

use super::Source;
use std::sync::OnceLock;

/// A scene built into the program.
#[derive(Debug, Clone, Copy)]
pub struct BuiltIn {
    /// Its name on the command line.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// A file that built-in scenes refer to.
#[derive(Debug, Clone, Copy)]
pub struct BuiltInFile {
    /// Its name, as scenes write it.
    pub name: &'static str,
    /// Its bytes.
    pub bytes: &'static [u8],
}

/// Scenes and files of the program.
#[derive(Debug, Clone, Copy)]
struct Provided {
    scenes: &'static [BuiltIn],
    files: &'static [BuiltInFile],
}

static PROVIDED: OnceLock<Provided> = OnceLock::new();

/// Makes the program's own scenes known by name, and the files that they refer to. The first call counts.
pub fn provide(scenes: &'static [BuiltIn], files: &'static [BuiltInFile]) {
    let _ = PROVIDED.set(Provided { scenes, files }); // a second call would say the same
}

/// Every built-in scene, in the program's order; none before [`provide`].
#[must_use]
pub fn all() -> &'static [BuiltIn] {
    PROVIDED.get().map_or(&[], |provided| provided.scenes)
}

/// The built-in scene of this name.
#[must_use]
pub fn find(name: &str) -> Option<&'static BuiltIn> {
    all().iter().find(|scene| scene.name == name)
}

/// The embedded file of this name.
pub(super) fn sibling(name: &str) -> Option<&'static [u8]> {
    PROVIDED.get()?.files.iter().find(|file| file.name == name).map(|file| file.bytes)
}

impl BuiltIn {
    /// The scene as a source.
    ///
    /// # Errors
    /// As [`Source::open`]; tests of the built-in scenes rule it out.
    pub fn source(&self) -> Result<Source, crate::SceneError> {
        Source::open(self.name)
    }
}
