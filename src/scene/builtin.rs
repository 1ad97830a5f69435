//! The scenes built into the program.

use super::Source;

/// A scene built into the program.
#[derive(Debug, Clone, Copy)]
pub struct BuiltIn {
    /// Its name on the command line.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// Every built-in scene; the first is the default.
pub const ALL: [BuiltIn; 17] = [
    BuiltIn { name: "tube", text: include_str!("../../scenes/tube.toml") },
    BuiltIn { name: "pendulum", text: include_str!("../../scenes/pendulum.toml") },
    BuiltIn { name: "yard", text: include_str!("../../scenes/yard.toml") },
    BuiltIn { name: "overload", text: include_str!("../../scenes/overload.toml") },
    BuiltIn { name: "stack", text: include_str!("../../scenes/stack.toml") },
    BuiltIn { name: "chain", text: include_str!("../../scenes/chain.toml") },
    BuiltIn { name: "pile", text: include_str!("../../scenes/pile.toml") },
    BuiltIn { name: "crossing", text: include_str!("../../scenes/crossing.toml") },
    BuiltIn { name: "gripper", text: include_str!("../../scenes/gripper.toml") },
    BuiltIn { name: "mesentery", text: include_str!("../../scenes/mesentery.toml") },
    BuiltIn { name: "organ", text: include_str!("../../scenes/organ.toml") },
    BuiltIn { name: "suture", text: include_str!("../../scenes/suture.toml") },
    BuiltIn { name: "auditorium", text: include_str!("../../scenes/auditorium.toml") },
    BuiltIn { name: "grove", text: include_str!("../../scenes/grove.toml") },
    BuiltIn { name: "domes", text: include_str!("../../scenes/domes.toml") },
    BuiltIn { name: "walkthrough", text: include_str!("../../scenes/walkthrough.toml") },
    BuiltIn { name: "library", text: include_str!("../../scenes/library.toml") },
];

/// Files that built-in scenes refer to.
const FILES: [(&str, &[u8]); 2] = [
    ("crystal.obj", include_bytes!("../../scenes/crystal.obj")),
    ("bracket.obj", include_bytes!("../../scenes/bracket.obj")),
];

/// The built-in scene of this name.
#[must_use]
pub fn find(name: &str) -> Option<&'static BuiltIn> {
    ALL.iter().find(|scene| scene.name == name)
}

/// The embedded file of this name.
pub(super) fn sibling(name: &str) -> Option<&'static [u8]> {
    FILES.iter().find(|(file, _)| *file == name).map(|(_, bytes)| *bytes)
}

impl BuiltIn {
    /// The scene as a source.
    ///
    /// # Errors
    /// As [`Source::open`]; tests of the built-in scenes rule it out.
    pub fn source(&self) -> Result<Source, super::SceneError> {
        Source::open(self.name)
    }
}
