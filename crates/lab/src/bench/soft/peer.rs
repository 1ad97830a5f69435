//! The costs of another engine in the cubes of `bench soft`, as its script wrote them.
//!
//! In: a row of a file that `python/peers/soft.py` writes. Out: the same with names. Never here: files, our own measurements.

use crate::bench::rig::peers::{PeerRow, Peers};
use serde::Deserialize;

/// A run of another engine.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Cube {
    /// Which test, as the rows of `bench soft` name it.
    test: String,
    /// How many nodes it had.
    nodes: usize,
    /// CPU milliseconds a step, the median.
    pub(super) ms_a_step: f64,
    /// How far the top sinks, metres.
    pub(super) sag_m: f64,
}

impl PeerRow for Cube {
    const FORM: &'static str = "{\"engine\": …, \"machine\": …, \"rows\": [{\"test\": …, \"nodes\": …, \"ms_a_step\": …, \"sag_m\": …}]}, as python/peers/soft.py writes it";

    fn test(&self) -> &str {
        &self.test
    }

    fn numbers(&self) -> [(&'static str, f64); 2] {
        [("ms_a_step", self.ms_a_step), ("sag_m", self.sag_m)]
    }
}

impl Peers<Cube> {
    /// The run of a test with so many nodes.
    pub(super) fn of(&self, test: &str, nodes: usize) -> Option<&Cube> {
        self.rows.iter().find(|row| row.test == test && row.nodes == nodes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn read(text: &str) -> Result<Peers<Cube>, String> {
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
        let missing = Peers::<Cube>::read(Path::new("no/such/peers.json"), &[]).unwrap_err();
        assert!(missing.to_string().contains("no/such/peers.json cannot be read"), "{missing}");
    }
}
