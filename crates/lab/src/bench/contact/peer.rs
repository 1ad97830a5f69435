//! The costs of another engine in the scenes of `bench contact`, as its script wrote them.
//!
//! In: a row of a file that `python/peers/contact.py` writes. Out: the same with names. Never here: files, our own measurements.

use crate::bench::rig::peers::{PeerRow, Peers};
use serde::Deserialize;

/// A run of another engine.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PeerRun {
    /// Which test, as the rows of `bench contact` name it.
    pub(super) test: String,
    pub(super) bodies: usize,
    pub(super) steps: usize,
    /// CPU milliseconds of a step.
    pub(super) ms_p50: f64,
    pub(super) ms_p99: f64,
    pub(super) ms_most: f64,
    /// CPU time of all steps, seconds.
    pub(super) cpu_s: f64,
    /// The deepest overlap before and within the last half second, metres.
    pub(super) landing_m: f64,
    pub(super) rest_m: f64,
    /// How far bodies went in the last half second, the mean and the most, metres.
    pub(super) drift_mean_m: f64,
    pub(super) drift_most_m: f64,
    /// By how much the highest body sank, metres.
    pub(super) sank_m: f64,
    /// The most energy above its least so far, J.
    pub(super) made_j: f64,
}

impl PeerRow for PeerRun {
    const FORM: &'static str = "{\"engine\": …, \"machine\": …, \"rows\": [{\"test\": …, \"bodies\": …, \"steps\": …, \"ms_p50\": …, …}]}, as python/peers/contact.py writes it";

    fn test(&self) -> &str {
        &self.test
    }

    fn numbers(&self) -> [(&'static str, f64); 2] {
        [("ms_p50", self.ms_p50), ("cpu_s", self.cpu_s)]
    }
}

impl Peers<PeerRun> {
    /// The run of a test.
    pub(super) fn of(&self, test: &str) -> Option<&PeerRun> {
        self.rows.iter().find(|row| row.test == test)
    }
}
