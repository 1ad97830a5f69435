//! The costs of another engine in the same tests, as its script wrote them.
//!
//! In: a JSON file (a script of `python/peers` writes one). Out: its rows. Never here: our own measurements, which numbers a row has.

use anyhow::Context;
use metachron_console::output::BadInput;
use serde::Deserialize;
use std::io::Read;
use std::path::Path;

/// Longest file, bytes.
const BYTES_MAX: u64 = 1 << 20;

/// A run of another engine.
pub(crate) trait PeerRow: serde::de::DeserializeOwned {
    /// The form of the file, for messages.
    const FORM: &'static str;

    /// Which test, as the rows of the benchmark name it.
    fn test(&self) -> &str;

    /// Numbers that must be above zero, by their keys.
    fn numbers(&self) -> [(&'static str, f64); 2];
}

/// The runs of another engine.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Peers<R> {
    /// The engine and its version.
    pub(crate) engine: String,
    /// The processor that it ran on.
    pub(crate) machine: String,
    pub(crate) rows: Vec<R>,
}

impl<R: PeerRow> Peers<R> {
    /// Reads a file whose rows are for tests of these names.
    ///
    /// # Errors
    /// A sentence that names the file, the place in it, and the value that was expected there.
    pub(crate) fn read(path: &Path, tests: &[&str]) -> anyhow::Result<Self> {
        let shown = path.display();
        let file = std::fs::File::open(path).map_err(|error| BadInput(format!("{shown} cannot be read: {error}")))?;
        let mut text = String::new();
        let read = file.take(BYTES_MAX + 1).read_to_string(&mut text);
        read.map_err(|error| BadInput(format!("{shown} is not text: {error}; expected {}", R::FORM)))?;
        if text.len() as u64 > BYTES_MAX {
            return Err(BadInput(format!("{shown} is longer than {BYTES_MAX} bytes; expected {}", R::FORM)).into());
        }
        let peers: Self =
            serde_json::from_str(&text).map_err(|error| BadInput(format!("{shown}: {error}; expected {}", R::FORM)))?;
        peers.check(tests).map_err(|wrong| BadInput(format!("{shown}: {wrong}"))).context("the peers' file")?;
        Ok(peers)
    }

    fn check(&self, tests: &[&str]) -> Result<(), String> {
        for (at, row) in self.rows.iter().enumerate() {
            if !tests.contains(&row.test()) {
                return Err(format!("rows[{at}].test is \"{}\"; expected one of: {}", row.test(), tests.join(", ")));
            }
            for (key, value) in row.numbers() {
                if value <= 0.0 {
                    return Err(format!("rows[{at}].{key} is {value}; expected a number above 0"));
                }
            }
        }
        Ok(())
    }
}
