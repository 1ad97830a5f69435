//! Results of other engines in the same benchmarks, measured once and stored as a table.
//!
//! Out: points with engine, version and variant. Measured on two cores of a shared virtual AMD EPYC, no GPU, CPU seconds;
//! rest shapes against the reference of the same law (docs/accuracy.md). Never here: our own rows.

use serde::Deserialize;
use serde::de::DeserializeOwned;

/// The machine on which they were measured.
pub(super) const MACHINE: &str = "two cores of a virtual AMD EPYC";

const TABLE: &str = include_str!("peers.csv");

/// A run of another engine.
#[derive(Debug, Clone, Deserialize)]
pub(in super::super) struct Peer {
    benchmark: String,
    /// Which case of the benchmark.
    pub(in super::super) case: String,
    /// Engine and version.
    pub(in super::super) peer: String,
    pub(in super::super) segments: f64,
    dt_ms: f64,
    /// CPU milliseconds a simulated second.
    pub(super) cpu_ms_per_s: f64,
    /// In the benchmark's own unit.
    pub(super) error: f64,
}

impl Peer {
    /// CPU microseconds a step.
    pub(in super::super) fn us_per_step(&self) -> f64 {
        self.cpu_ms_per_s * self.dt_ms
    }
}

/// The runs of a benchmark.
pub(in super::super) fn of(benchmark: &str) -> Vec<Peer> {
    stored::<Peer>(TABLE).into_iter().filter(|peer| peer.benchmark == benchmark).collect()
}

/// The rows of a stored table.
pub(in super::super) fn stored<R: DeserializeOwned>(table: &str) -> Vec<R> {
    csv::Reader::from_reader(table.as_bytes()).into_deserialize().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_of_the_table_is_a_point() {
        let known = of("cantilever").len() + of("swing").len();
        assert_eq!(known, TABLE.lines().count() - 1);
        assert!(of("swing").iter().all(|peer| peer.cpu_ms_per_s > 0.0 && peer.error > 0.0));
    }
}
