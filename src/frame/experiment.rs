//! A scene drawn at resolutions that a design chooses, to see how its frames answer.
//!
//! In: a session, what draws. Out: what was in view, the polygons and the time of every frame. The controller learns nothing
//! meanwhile. Never here: what the numbers mean ([`crate::tune`] says).
//! The design: steps over the whole range, then a pseudo-random binary sequence around its middle, so that both the line and the
//! delay can be told apart from a drift of the scene.

use super::error::SessionError;
use super::headless::{Drawing, one_frame};
use super::session::Session;
use crate::compositor::{Size, Style};
use crate::control::{Law, Policy};
use crate::tune::Observed;
use std::time::Duration;

/// An experiment on a scene.
pub struct Experiment {
    /// Frames, ≥ 60.
    pub frames: u64,
    /// Size of the picture in pixels.
    pub size: Size,
    /// What draws it.
    pub drawing: Drawing,
}

/// What an experiment has shown.
pub struct Experimented {
    /// Its frames, without those of the warm-up.
    pub observed: Vec<Observed>,
    /// The adapter that drew; `None` where costs were declared.
    pub adapter: Option<String>,
    /// Whether it was stopped before its end.
    pub interrupted: bool,
}

/// Frames that only warm up.
const WARM_UP: u64 = 6;
/// Levels of the steps, as shares of the way from the finest to the coarsest ln ε̂, and frames on each.
const STEPS: [f64; 7] = [1.0, 0.5, 0.0, 0.75, 0.25, 0.6, 0.4];
const STEP_FRAMES: u64 = 6;
/// Levels of the binary sequence.
const BINARY: [f64; 2] = [0.35, 0.65];
/// Taps of the shift register behind it: x⁷ + x⁶ + 1, 127 frames before it comes again.
const TAPS: u32 = 0b110_0000;

/// Draws `session` at the resolutions of the design. `go_on` is told of the share that is done; on its `false` the experiment ends.
///
/// # Errors
/// [`SessionError::Draw`] where the adapter fails.
pub fn experiment(
    mut session: Session,
    mut plan: Experiment,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Experimented, SessionError> {
    session.control().set_policy(Policy::Feedback);
    session.control().set_law(Law::CORRECTED);
    let period = session.period();
    let (mut observed, mut interrupted, mut register) = (Vec::with_capacity(plan.frames as usize), false, 1_u32);
    let mut due = Duration::ZERO;
    for frame in 0..WARM_UP + plan.frames {
        session.wait_until(due);
        if interrupted {
            break;
        }
        if let Some(share) = level(frame, &mut register) {
            session.control().seek(share);
        }
        let record = one_frame(&mut session, (plan.size, Style::default()), &mut plan.drawing, true)?;
        if frame >= WARM_UP {
            let polygons = session.control().last_plan().polygons;
            observed.push(Observed { views: session.views().to_vec(), polygons, work_s: 1e-3 * record.frame_ms });
        }
        interrupted = !go_on(frame as f64 / (WARM_UP + plan.frames) as f64);
        due = (due + period).max(session.now());
    }
    let adapter = match &plan.drawing {
        Drawing::Every(gpu) | Drawing::Last(gpu) => Some(gpu.gpu().describe()),
        Drawing::Nothing => None,
    };
    Ok(Experimented { observed, adapter, interrupted })
}

/// Where in the range frame `frame` is drawn; `None`: where the last one was.
fn level(frame: u64, register: &mut u32) -> Option<f64> {
    let at = frame.checked_sub(WARM_UP)?;
    if at < STEPS.len() as u64 * STEP_FRAMES {
        return at.is_multiple_of(STEP_FRAMES).then(|| STEPS[(at / STEP_FRAMES) as usize]);
    }
    let bit = (*register & TAPS).count_ones() & 1;
    *register = ((*register << 1) | bit) & 0x7f;
    Some(BINARY[(*register & 1) as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_design_goes_over_the_range_and_then_takes_both_levels_alike() {
        let mut register = 1;
        let levels: Vec<_> = (0..WARM_UP + 42 + 127).map(|frame| level(frame, &mut register)).collect();
        assert!(levels[..6].iter().all(Option::is_none));
        assert_eq!(levels[6], Some(1.0));
        assert_eq!(levels[6 + 12], Some(0.0));
        let high = levels[48..].iter().filter(|l| **l == Some(BINARY[1])).count();
        assert_eq!((high, levels[48..].len()), (64, 127), "a sequence of the greatest length has one more of the one");
    }
}
