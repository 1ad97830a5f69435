//! The record of a device over a run.

use serde::Serialize;

/// One device of a run.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct DeviceReport {
    /// The device's name.
    pub device: String,
    /// The name of the object that it leads.
    pub object: String,
    /// How often it was read.
    pub ticks: u64,
    /// Whether the system gave its thread real-time priority. Without that, other programs on the cores make ticks
    /// late.
    pub realtime: bool,
    /// By how much ticks were late, milliseconds.
    pub late_ms: Quantiles,
    /// How long ago the newest state came, when the force followed from it, in steps of that state, or messages of a link where they are longer: the force is
    /// whole up to two.
    pub age_steps: Quantiles,
    /// Ticks with less force or none, because the newest state came more than two of its steps ago: the force fades within 0.1 s.
    pub stale: u64,
    /// The force given, N.
    pub force_mean_n: f64,
    /// The greatest of them, N.
    pub force_max_n: f64,
    /// Energy that the hand was given from any moment on, beyond the energy that it put in, J.
    pub energy_out_j: f64,
    /// The capacity of the energy tank, J: `energy_out_j` is no more.
    pub tank_j: f64,
    /// How often a button was pressed.
    pub presses: u64,
    /// How often the device or the object failed, and the first of these failures.
    pub failures: u64,
    /// The first failure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_failure: Option<String>,
}

/// Median, tail and maximum.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Quantiles {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Maximum.
    pub max: f64,
}
