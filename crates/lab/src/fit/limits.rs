//! Explains why a tolerance cannot be met: the best error reached, and its limit.
//!
//! In: the finest settings tried. Out: a sentence. Never here: the search.

use super::length;
use super::task::Task;
use metachron_session::fit::{Converged, Setting};

/// A refinement that lowers the error below this share of itself addresses its limit.
const FALLS: f64 = 0.8;

/// One sentence on the best error reached and its limit, for a tolerance and the least error of all runs, metres.
pub(super) fn explain(task: &mut Task<'_>, answer: &Converged, tolerance_m: f64, best_m: f64) -> String {
    let said = format!(
        "a tolerance of {} cannot be met: the least error reached is {}",
        length(tolerance_m),
        length(best_m + answer.error_m)
    );
    if answer.error_m > 0.5 * tolerance_m {
        let finest = describe(&task.refined(answer.level, true));
        return format!(
            "{said}; the limit is the converged answer, which is known only to {} at {finest}: use finer settings in the scene, or fit a shorter time (`--seconds`) of a motion that does not settle",
            length(answer.error_m)
        );
    }
    let level = answer.level.saturating_sub(1);
    let coarse = task.refined(level, true);
    let fine = task.refined(answer.level, true);
    let shorter: Vec<_> = coarse.iter().zip(&fine).map(|(c, f)| Setting { dt_s: f.dt_s, ..*c }).collect();
    let finer: Vec<_> = coarse.iter().zip(&fine).map(|(c, f)| Setting { pieces: f.pieces, ..*c }).collect();
    let errors = [&coarse, &shorter, &finer]
        .map(|settings| task.attempt(settings, &answer.paths).map_or(f64::INFINITY, |trial| trial.error_m));
    let [before, by_steps, by_pieces] = errors;
    let what = match (by_steps < FALLS * before, by_pieces < FALLS * before) {
        (true, false) => "the time step: use shorter steps",
        (false, true) => "the spatial discretization: use more segments",
        (true, true) => "time step and spatial discretization: refine both",
        (false, false) => "neither time step nor spatial discretization, but contact or chaotic motion",
    };
    format!("{said}; the limit is {what} (finest tried: {})", describe(&fine))
}

/// The finest of all settings, as text.
fn describe(settings: &[Setting]) -> String {
    let dt_s = settings.iter().map(|setting| setting.dt_s).fold(f64::INFINITY, f64::min);
    let pieces = settings.iter().map(|setting| setting.pieces).max().unwrap_or(0);
    let pieces = if pieces > 0 { format!(" and {pieces} segments") } else { String::new() };
    format!("{:.4} ms{pieces}", dt_s * 1e3)
}
