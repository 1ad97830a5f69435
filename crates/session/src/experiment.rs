//! A scene drawn at prescribed resolutions, to identify how its frame times respond.
//!
//! In: a session and the means of drawing; or a [`Design`] for a caller that draws the frames itself. Out: the objects in view, the
//! polygons and the time of every frame.
//! The controller does not learn from these frames. Never here: the meaning of the numbers ([`metachron_lod::tune`]
//! says).
//! The design: steps over the whole range, then a pseudo-random binary sequence around its middle, so that both the line and the delay can
//! be separated from a drift of the scene.

use super::error::SessionError;
use super::headless::{Drawing, PictureFormat, one_frame};
use super::session::Session;
use metachron_lod::control::{Law, PictureControl, Policy};
use metachron_lod::tune::Observed;
use metachron_render::{Size, Style};
use std::time::Duration;

/// An experiment on a scene.
pub struct Experiment {
    /// Frames, ≥ 60.
    pub frames: u64,
    /// Size of the picture in pixels.
    pub size: Size,
    /// The means of drawing.
    pub drawing: Drawing,
}

/// Result of an experiment.
pub struct ExperimentResult {
    /// Its frames, without the warm-up's.
    pub observed: Vec<Observed>,
    /// The adapter that drew; `None` where costs were declared.
    pub adapter: Option<String>,
    /// Whether it was stopped before its end.
    pub interrupted: bool,
}

/// Warm-up frames, not recorded.
const WARM_UP: u64 = 6;
/// Levels of the steps, as fractions of the range from the finest to the coarsest ln ε̂, and frames per level.
const STEPS: [f64; 7] = [1.0, 0.5, 0.0, 0.75, 0.25, 0.6, 0.4];
const STEP_FRAMES: u64 = 6;
/// Levels of the binary sequence.
const BINARY: [f64; 2] = [0.35, 0.65];
/// Taps of its shift register: x⁷ + x⁶ + 1, a period of 127 frames.
const TAPS: u32 = 0b110_0000;

/// Draws `session` at the resolutions of the design. `go_on` receives the share that is done; if it returns `false` the experiment ends.
///
/// # Errors
/// [`SessionError::Draw`] where the adapter fails.
pub fn experiment(
    mut session: Session,
    mut plan: Experiment,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<ExperimentResult, SessionError> {
    session.begin();
    let period = session.period();
    let mut design = Design::begin(session.control(), plan.frames);
    let (mut due, mut interrupted) = (Duration::ZERO, false);
    while design.done() < 1.0 && !interrupted {
        session.wait_until(due);
        design.choose(session.control());
        let record = one_frame(
            &mut session,
            PictureFormat { size: plan.size, style: Style::default() },
            &mut plan.drawing,
            true,
        )?;
        design.note(&mut session, 1e-3 * record.frame_ms);
        interrupted = !go_on(design.done());
        due = (due + period).max(session.now());
    }
    let finished = design.done() >= 1.0;
    let adapter = plan.drawing.adapter();
    Ok(ExperimentResult { observed: design.observed, adapter, interrupted: interrupted && !finished })
}

/// The experiment, frame by frame.
pub struct Design {
    frames: u64,
    frame: u64,
    register: u32,
    /// The recorded frames so far, without the warm-up's.
    pub observed: Vec<Observed>,
}

impl Design {
    /// An experiment of `frames` frames after the warm-up; `control` switches to the law whose range it covers.
    pub fn begin(control: &mut PictureControl, frames: u64) -> Self {
        control.set_policy(Policy::Feedback);
        control.set_law(Law::CORRECTED);
        // one line is fitted through all frames: they have as many pixels
        let (_, most) = control.render_scale_range();
        control.set_render_scale((most, most));
        Self { frames, frame: 0, register: 1, observed: Vec::with_capacity(frames as usize) }
    }

    /// Sets `control` to the resolution of the next frame.
    pub fn choose(&mut self, control: &mut PictureControl) {
        if let Some(share) = level(self.frame, &mut self.register) {
            control.seek(share);
        }
    }

    /// Records the frame that was drawn, and its work.
    pub fn note(&mut self, session: &mut Session, work_s: f64) {
        if self.frame >= WARM_UP {
            let polygons = session.control().last_plan().polygons;
            self.observed.push(Observed { views: session.views().to_vec(), polygons, work_s });
        }
        self.frame += 1;
    }

    /// The share that is done, 0 … 1.
    pub fn done(&self) -> f64 {
        self.frame as f64 / (WARM_UP + self.frames) as f64
    }
}

/// Position in the range at which frame `frame` is drawn; `None`: as the last one.
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
