//! The bound of the controller, and, where a target is out of reach, the greatest part of the time of its frames.
//!
//! In: the controller's status, the newest frames. Out: a sentence for report and window. Never here: a choice.

use super::Session;
use crate::outcome::FrameRecord;
use metachron_lod::Bound;
use metachron_lod::control::Status;
use std::fmt::Write;

/// Frames that the parts of a frame's time are the mean of: half a second at 60 Hz.
const FRAMES: usize = 30;

impl Session {
    /// Message if the controller rests on a limit: which one, and where frames are late for it, which part takes how long; `None` if it
    /// does not.
    #[must_use]
    pub fn clamp(&self) -> Option<String> {
        let status = self.control.status();
        let rests = matches!(status, Status::Clamped(_) | Status::Reduced | Status::BetweenLevels | Status::Fixed);
        let mut said = (rests || status == Status::Reserved).then(|| status.to_string())?;
        if matches!(status, Status::Clamped(Bound::Coarsest) | Status::Reserved)
            && let Some(parts) = parts(self.newest_frames(FRAMES))
        {
            said += &parts;
            if !self.is_virtual() {
                // a String takes whatever is written
                let _ = write!(said, "; agents keep {:.1} of {} cores busy", self.busy_cores(), self.cores());
            }
        }
        Some(said)
    }

    /// Cores that agents have kept busy since the start, in the mean.
    fn busy_cores(&self) -> f64 {
        let wall_s = self.now().saturating_sub(self.begun).as_secs_f64();
        let cpu_s = self.agents().iter().map(metachron_runtime::AgentHandle::cpu_s).fold(0.0, |sum, s| sum + s);
        if wall_s > 0.0 { cpu_s / wall_s } else { 0.0 }
    }
}

/// The parts of the time of frames, in the mean: drawing, then finding visible objects and choosing before it, then the
/// rest, which is panels and presenting; `None` without a frame. Finding and choosing for the next frame during the
/// drawing of this one are not counted again.
fn parts(frames: &[FrameRecord]) -> Option<String> {
    let mean = |of: fn(&FrameRecord) -> f64| frames.iter().map(of).sum::<f64>() / frames.len() as f64;
    let [all, draw, choose] = [mean(|row| row.frame_ms), mean(|row| row.draw_ms), mean(|row| row.lag_ms - row.draw_ms)];
    let rest = (all - draw - choose).max(0.0);
    (!frames.is_empty()).then(|| {
        format!(
            ": of {all:.1} ms drawing takes {draw:.1}, finding and choosing {choose:.1}, panels and presenting {rest:.1}"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_of_late_frames_add_up_with_the_next_choice_inside_the_drawing() {
        let row = |frame_ms| FrameRecord {
            frame_ms,
            draw_ms: 30.0,
            lag_ms: 32.0,
            cull_ms: 0.5,
            select_ms: 9.5,
            ..FrameRecord::default()
        };
        assert_eq!(parts(&[]), None);
        let said = parts(&[row(40.0), row(44.0)]).unwrap();
        assert_eq!(said, ": of 42.0 ms drawing takes 30.0, finding and choosing 2.0, panels and presenting 10.0");
    }
}
