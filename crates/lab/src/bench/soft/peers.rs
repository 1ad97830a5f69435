//! What another engine takes for the same cubes, as its script wrote it.
//!
//! In: a JSON file (`python/peers/soft.py` writes one). Out: its rows. Never here: our own measurements.

use anyhow::Context;
use metachron_console::output::BadInput;
use serde::Deserialize;
use std::io::Read;
use std::path::Path;

/// Longest file, bytes.
const BYTES_MAX: u64 = 1 << 20;
/// The form of the file, for messages.
const FORM: &str = "{\"engine\": …, \"machine\": …, \"rows\": [{\"test\": …, \"nodes\": …, \"ms_a_step\": …, \"sag_m\": …}]}, as python/peers/soft.py writes it";

/// The runs of another engine.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Peers {
    /// The engine and its version.
    pub(super) engine: String,
    /// The processor that it ran on.
    pub(super) machine: String,
    rows: Vec<PeerRow>,
}

/// A run of another engine.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PeerRow {
    /// Which test, as the rows of `bench soft` name it.
    test: String,
    /// How many nodes it had.
    nodes: usize,
    /// CPU milliseconds a step, the median.
    pub(super) ms_a_step: f64,
    /// How far the top sinks, metres.
    pub(super) sag_m: f64,
}

impl Peers {
    /// Reads a file whose rows are for tests of these names.
    ///
    /// # Errors
    /// A sentence that names the file, the place in it, and what was expected there.
    pub(super) fn read(path: &Path, tests: &[&str]) -> anyhow::Result<Self> {
        let shown = path.display();
        let file = std::fs::File::open(path).map_err(|error| BadInput(format!("{shown} cannot be read: {error}")))?;
        let mut text = String::new();
        let read = file.take(BYTES_MAX + 1).read_to_string(&mut text);
        read.map_err(|error| BadInput(format!("{shown} is not text: {error}; expected {FORM}")))?;
        if text.len() as u64 > BYTES_MAX {
            return Err(BadInput(format!("{shown} is longer than {BYTES_MAX} bytes; expected {FORM}")).into());
        }
        let peers: Self =
            serde_json::from_str(&text).map_err(|error| BadInput(format!("{shown}: {error}; expected {FORM}")))?;
        peers.check(tests).map_err(|wrong| BadInput(format!("{shown}: {wrong}"))).context("the peers' file")?;
        Ok(peers)
    }

    fn check(&self, tests: &[&str]) -> Result<(), String> {
        for (at, row) in self.rows.iter().enumerate() {
            if !tests.contains(&row.test.as_str()) {
                return Err(format!("rows[{at}].test is \"{}\"; expected one of: {}", row.test, tests.join(", ")));
            }
            for (key, value) in [("ms_a_step", row.ms_a_step), ("sag_m", row.sag_m)] {
                if value <= 0.0 {
                    return Err(format!("rows[{at}].{key} is {value}; expected a number above 0"));
                }
            }
        }
        Ok(())
    }

    /// The run of a test with so many nodes.
    pub(super) fn of(&self, test: &str, nodes: usize) -> Option<&PeerRow> {
        self.rows.iter().find(|row| row.test == test && row.nodes == nodes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Peers, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("peers.json");
        std::fs::write(&path, text).unwrap();
        Peers::read(&path, &["cube", "sheet"]).map_err(|error| format!("{error:#}"))
    }

    #[test]
    fn rows_are_found_by_test_and_number_of_nodes() {
        let row =
            |nodes: u32| format!(r#"{{"test": "cube", "nodes": {nodes}, "ms_a_step": {nodes}e-3, "sag_m": 4e-3}}"#);
        let text = format!(r#"{{"engine": "E 1", "machine": "M", "rows": [{}, {}]}}"#, row(343), row(729));
        let peers = read(&text).unwrap();
        assert_eq!(peers.of("cube", 729).map(|row| row.ms_a_step), Some(0.729));
        assert_eq!((peers.of("cube", 730), peers.of("sheet", 729)), (None, None));
    }

    #[test]
    fn a_wrong_file_is_refused_by_its_place_and_what_was_expected() {
        let row = |test: &str, ms: &str| {
            format!(r#"{{"engine": "E", "machine": "M", "rows": [{{"test": "{test}", "nodes": 8, {ms} "sag_m": 1}}]}}"#)
        };
        for (text, words) in [
            ("", &["peers.json", "line 1", "\"rows\""][..]),
            ("[1]", &["line 1", "\"ms_a_step\""]),
            (&row("cube", ""), &["missing field `ms_a_step`", "line 1"]),
            (&row("cube", r#""ms": 3,"#), &["unknown field `ms`"]),
            (&row("cube", r#""ms_a_step": "3","#), &["invalid type: string", "f64"]),
            (&row("cube", r#""ms_a_step": -3,"#), &["rows[0].ms_a_step is -3", "above 0"]),
            (&row("ball", r#""ms_a_step": 3,"#), &["rows[0].test is \"ball\"", "cube, sheet"]),
        ] {
            let said = read(text).unwrap_err();
            words.iter().for_each(|word| assert!(said.contains(word), "{word} is not in {said}"));
        }
        let missing = Peers::read(Path::new("no/such/peers.json"), &[]).unwrap_err();
        assert!(missing.to_string().contains("no/such/peers.json cannot be read"), "{missing}");
    }
}
