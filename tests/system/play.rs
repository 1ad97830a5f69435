//! Runs the program as a child and reads its report; scenes are written to a folder of their own.

use assert_cmd::Command;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Output;
use tempfile::TempDir;

/// The program, without the variables of a user's shell.
pub fn program() -> std::process::Command {
    cleaned(env!("CARGO_BIN_EXE_metachron"))
}

/// A program, without the variables of a user's shell, except the ones by which an adapter is found.
pub fn cleaned(name: &str) -> std::process::Command {
    let mut command = std::process::Command::new(name);
    command.env_clear();
    for kept in ["PATH", "HOME", "XDG_RUNTIME_DIR", "VK_ICD_FILENAMES", "VK_DRIVER_FILES", "LIBGL_ALWAYS_SOFTWARE"] {
        if let Some(value) = std::env::var_os(kept) {
            command.env(kept, value);
        }
    }
    command
}

/// Runs `metachron` with these arguments to its end.
pub fn metachron(arguments: &[&str]) -> Output {
    Command::from_std(program()).args(arguments).output().unwrap()
}

/// `run SCENE --headless` with these arguments, which must end with code 0; its report.
pub fn report_of(scene: &str, arguments: &[&str]) -> Value {
    let fixed = ["run", scene, "--headless", "--json", "-q"];
    let done = metachron(&[&fixed[..], arguments].concat());
    let said = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(0), "{scene} {arguments:?}: {said}");
    serde_json::from_slice(&done.stdout).expect("nothing but JSON on standard output")
}

/// As [`report_of`], in virtual time.
pub fn lockstep(scene: &str, arguments: &[&str]) -> Value {
    report_of(scene, &[&["--executor", "lockstep"], arguments].concat())
}

/// A folder with a scene in it, gone when it is dropped.
pub struct Folder {
    folder: TempDir,
    scene: PathBuf,
}

impl Folder {
    /// A scene of format 1 with this text after the format's line.
    pub fn with(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("scene.toml");
        std::fs::write(&scene, format!("format = 1\n{text}")).unwrap();
        Self { folder, scene }
    }

    /// The scene's path.
    pub fn scene(&self) -> &str {
        self.scene.to_str().unwrap()
    }

    /// The folder's path.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// A path in the folder.
    pub fn file(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }

    /// The scene's report in virtual time.
    pub fn lockstep(&self, arguments: &[&str]) -> Value {
        lockstep(self.scene(), arguments)
    }
}

/// The entry called `name` among the report's agents.
pub fn agent<'r>(report: &'r Value, name: &str) -> &'r Value {
    let agents = report["agents"].as_array().unwrap();
    agents.iter().find(|a| a["name"] == name).unwrap_or_else(|| panic!("no agent {name} in {report}"))
}

/// The number at a JSON pointer.
pub fn number(value: &Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no number at {pointer} of {value}"))
}

/// Three numbers at a JSON pointer.
pub fn point(value: &Value, pointer: &str) -> [f64; 3] {
    [0, 1, 2].map(|axis| number(value, &format!("{pointer}/{axis}")))
}

/// A file of numbers computed by independent codes.
pub fn reference(name: &str) -> Value {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference").join(name);
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}
