//! The limit of a sequence of refined runs, and an estimate of the remaining error.
//!
//! In: the same run, each time at half the step and half the spacing. Out: the finest and an estimate of its error from the rate at which
//! the differences fall. Never here: the run itself.

use super::path::{Path, farthest_m};

/// The finest result computed.
#[derive(Debug, Clone, PartialEq)]
pub struct Converged {
    /// The path of each point.
    pub paths: Vec<Path>,
    /// How often step and spacing were halved for it.
    pub level: u32,
    /// Estimated remaining error, metres.
    pub error_m: f64,
}

/// Slowest ratio of consecutive differences in the estimate; slower counts as no convergence …
const SLOWEST: f64 = 0.9;
/// … and the fastest, the fourth order; a faster ratio is clamped to it.
const FASTEST: f64 = 1.0 / 16.0;

/// Refines until the estimated error is at most `wanted_m`, or `levels` times. `play` gives the paths of a level, and `None` if it was
/// stopped or the run failed.
pub fn converge(levels: u32, wanted_m: f64, play: &mut dyn FnMut(u32) -> Option<Vec<Path>>) -> Option<Converged> {
    let mut paths = play(0)?;
    let mut before: Option<f64> = None;
    let mut best: Option<Converged> = None;
    for level in 1..=levels {
        let Some(finer) = play(level) else { break };
        let apart_m = farthest_m(&paths, &finer);
        let rate = before.map_or(0.5, |before| (apart_m / before).clamp(FASTEST, SLOWEST));
        let error_m = if apart_m > 0.0 { apart_m * rate / (1.0 - rate) } else { 0.0 };
        (before, paths) = (Some(apart_m), finer);
        best = Some(Converged { paths: paths.clone(), level, error_m });
        if error_m <= wanted_m {
            break;
        }
    }
    best
}
