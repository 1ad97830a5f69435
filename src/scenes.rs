//! The scenes built into the program; the first is the default.

use metachron_scene::builtin::{self, BuiltIn, BuiltInFile};

/// Every built-in scene.
pub const ALL: [BuiltIn; 18] = [
    BuiltIn { name: "tube", text: include_str!("../scenes/tube.toml") },
    BuiltIn { name: "pendulum", text: include_str!("../scenes/pendulum.toml") },
    BuiltIn { name: "yard", text: include_str!("../scenes/yard.toml") },
    BuiltIn { name: "overload", text: include_str!("../scenes/overload.toml") },
    BuiltIn { name: "stack", text: include_str!("../scenes/stack.toml") },
    BuiltIn { name: "chain", text: include_str!("../scenes/chain.toml") },
    BuiltIn { name: "pile", text: include_str!("../scenes/pile.toml") },
    BuiltIn { name: "crossing", text: include_str!("../scenes/crossing.toml") },
    BuiltIn { name: "gripper", text: include_str!("../scenes/gripper.toml") },
    BuiltIn { name: "mesentery", text: include_str!("../scenes/mesentery.toml") },
    BuiltIn { name: "organ", text: include_str!("../scenes/organ.toml") },
    BuiltIn { name: "cavity", text: include_str!("../scenes/cavity.toml") },
    BuiltIn { name: "catenary", text: include_str!("../scenes/catenary.toml") },
    BuiltIn { name: "auditorium", text: include_str!("../scenes/auditorium.toml") },
    BuiltIn { name: "grove", text: include_str!("../scenes/grove.toml") },
    BuiltIn { name: "domes", text: include_str!("../scenes/domes.toml") },
    BuiltIn { name: "walkthrough", text: include_str!("../scenes/walkthrough.toml") },
    BuiltIn { name: "library", text: include_str!("../scenes/library.toml") },
];

/// Files that built-in scenes refer to.
const FILES: [BuiltInFile; 2] = [
    BuiltInFile { name: "crystal.obj", bytes: include_bytes!("../scenes/crystal.obj") },
    BuiltInFile { name: "bracket.obj", bytes: include_bytes!("../scenes/bracket.obj") },
];

/// Makes the built-in scenes known to [`metachron_scene::Source::open`].
pub fn provide() {
    builtin::provide(&ALL, &FILES);
}
