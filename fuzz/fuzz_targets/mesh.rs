//! Any bytes as a mesh file, the first of which chooses its kind: a body of it, or an error that can be shown.
#![no_main]

use libfuzzer_sys::fuzz_target;
use metachron::scene::{Source, load};
use std::path::PathBuf;
use std::sync::LazyLock;

/// The kinds of files, and what a scene makes of each: fixed solids, whose parts need no convex hulls, bodies of closed surfaces or tetrahedra, sheets of open ones.
const KINDS: [&str; 6] = ["stl", "obj", "glb", "msh", "vtk", "vtu"];
const MODELS: [&str; 3] = [
    "model = \"rigid\"\nshape = \"mesh\"\nfixed = true",
    "model = \"solid\"\nshape = \"mesh\"\neps_m = 0.1",
    "model = \"sheet\"\nthickness_m = 0.001",
];

/// A folder in memory where there is one, of this process alone: a scene's meshes are files beside it.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let shared = PathBuf::from("/dev/shm");
    let parent = if shared.is_dir() { shared } else { std::env::temp_dir() };
    let folder = parent.join(format!("metachron-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for meshes");
    for kind in KINDS {
        for (number, model) in MODELS.iter().enumerate() {
            let more = if number == 0 { "" } else { "young_pa = 1e4\ndensity_kg_m3 = 1000.0" };
            let text = format!("format = 1\n[[object]]\nname = \"it\"\n{model}\nfile = \"it.{kind}\"\n{more}\n");
            std::fs::write(folder.join(format!("{kind}{number}.toml")), text).expect("a scene");
        }
    }
    folder
});

fuzz_target!(|bytes: &[u8]| {
    let Some((&first, bytes)) = bytes.split_first() else { return };
    let (kind, model) = (KINDS[usize::from(first) % KINDS.len()], usize::from(first) / KINDS.len() % MODELS.len());
    std::fs::write(FOLDER.join(format!("it.{kind}")), bytes).expect("a mesh");
    let source = Source::open(&FOLDER.join(format!("{kind}{model}.toml")).to_string_lossy()).expect("a scene");
    if let Err(error) = load(&source, &[]) {
        assert!(!error.to_string().is_empty());
    }
});
