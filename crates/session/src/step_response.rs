//! Measures the step response of the frame loop: the picture is pushed away from its target, and the frames after it are recorded.
//!
//! In: a session, a law, the polygons left by each push. Out: time and work of the frames after every push, the median over its
//! repetitions. Never here: their prediction ([`metachron_lod::tune`] does that).

use super::error::SessionError;
use super::headless::{Drawing, PictureFormat, one_frame};
use super::session::Session;
use metachron_lod::control::{Law, Policy};
use metachron_render::{Size, Style};

/// Pushes to be made.
pub struct Pushes {
    /// The law that restores the picture.
    pub law: Law,
    /// Polygons left by each push, > 0.
    pub polygons: Vec<f64>,
    /// Repetitions of each push, ≥ 1; the median over noisy frames is more reliable than one of them.
    pub times: usize,
    /// Time to settle before a push, and time of observation after it, seconds, > 0.
    pub watch_s: f64,
    /// Size of the picture in pixels.
    pub size: Size,
    /// The means of drawing.
    pub drawing: Drawing,
}

/// A frame after a push: seconds since the push, and its work in seconds.
pub type After = (f64, f64);

/// Applies `pushes` to `session`: the frames after each, in their order. `go_on` receives the share that is done; if it returns `false` the
/// result is empty.
///
/// # Errors
/// [`SessionError::Draw`] where the adapter fails.
pub fn push(
    mut session: Session,
    mut pushes: Pushes,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Vec<Vec<After>>, SessionError> {
    session.control().set_policy(Policy::Feedback);
    session.control().set_law(pushes.law);
    session.begin();
    let (wanted, times) = (std::mem::take(&mut pushes.polygons), pushes.times.max(1));
    let mut medians = Vec::with_capacity(wanted.len());
    for (at, polygons) in wanted.iter().enumerate() {
        let mut runs = Vec::with_capacity(times);
        for time in 0..times {
            if !go_on((at * times + time) as f64 / (wanted.len() * times) as f64) {
                return Ok(Vec::new());
            }
            watch(&mut session, &mut pushes)?;
            let held = session.control().last_plan().polygons;
            session.control().coarsen(held / polygons);
            runs.push(watch(&mut session, &mut pushes)?);
        }
        medians.push(median(&runs));
    }
    Ok(medians)
}

/// The frames of one period of observation.
fn watch(session: &mut Session, pushes: &mut Pushes) -> Result<Vec<After>, SessionError> {
    let start = session.now();
    let mut due = start;
    let mut frames = Vec::new();
    while (session.now() - start).as_secs_f64() < pushes.watch_s {
        session.wait_until(due);
        let record = one_frame(
            session,
            PictureFormat { size: pushes.size, style: Style::default() },
            &mut pushes.drawing,
            false,
        )?;
        frames.push(((session.now() - start).as_secs_f64(), 1e-3 * record.frame_ms));
        due = (due + session.period()).max(session.now());
    }
    Ok(frames)
}

/// The median of several runs frame by frame, up to the length of the shortest.
#[must_use]
pub fn median(runs: &[Vec<After>]) -> Vec<After> {
    let shortest = runs.iter().map(Vec::len).min().unwrap_or(0);
    let middle = |values: &mut Vec<f64>| {
        values.sort_unstable_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let of = |at: usize| {
        let mut times: Vec<f64> = runs.iter().map(|run| run[at].0).collect();
        let mut works: Vec<f64> = runs.iter().map(|run| run[at].1).collect();
        (middle(&mut times), middle(&mut works))
    };
    (0..shortest).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_taken_frame_by_frame() {
        let runs =
            [vec![(1.0, 5.0), (2.0, 1.0)], vec![(1.0, 7.0), (2.0, 9.0), (3.0, 1.0)], vec![(1.5, 6.0), (2.5, 2.0)]];
        assert_eq!(median(&runs), [(1.0, 6.0), (2.0, 2.0)]);
        assert!(median(&[]).is_empty());
    }
}
