//! A scene pushed away from its target, to see how its own frames come back.
//!
//! In: a session, a law, how many polygons each push leaves. Out: time and work of the frames after every push, the median over its
//! repetitions. Never here: what was predicted of them ([`crate::tune`] does that).

use super::error::SessionError;
use super::headless::{Drawing, one_frame};
use super::session::Session;
use crate::compositor::{Size, Style};
use crate::control::{Law, Policy};

/// Pushes to be made.
pub struct Pushes {
    /// The law that brings the picture back.
    pub law: Law,
    /// Polygons that each push leaves, > 0.
    pub polygons: Vec<f64>,
    /// How often each is made, ≥ 1; the median of noisy frames says more than one of them.
    pub times: usize,
    /// For how long it may come to rest before a push, and for how long it is watched afterwards, seconds, > 0.
    pub watch_s: f64,
    /// Size of the picture in pixels.
    pub size: Size,
    /// What draws it.
    pub drawing: Drawing,
}

/// A frame after a push: seconds since it, and its work in seconds.
pub type After = (f64, f64);

/// Makes `pushes` on `session`: the frames after each, in their order. `go_on` is told of the share that is done; on its `false` there
/// are none.
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

/// The frames of one watch.
fn watch(session: &mut Session, pushes: &mut Pushes) -> Result<Vec<After>, SessionError> {
    let start = session.now();
    let mut due = start;
    let mut frames = Vec::new();
    while (session.now() - start).as_secs_f64() < pushes.watch_s {
        session.wait_until(due);
        let record = one_frame(session, (pushes.size, Style::default()), &mut pushes.drawing, false)?;
        frames.push(((session.now() - start).as_secs_f64(), 1e-3 * record.frame_ms));
        due = (due + session.period()).max(session.now());
    }
    Ok(frames)
}

/// The median of several runs frame by frame, as far as the shortest goes.
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
