//! How long showing a picture takes where nobody tells: what of the time between two pictures was neither work nor waited for.
//!
//! In: the work of a picture, and when the next one started. Out: a time. Never here: a clock.
//!
//! A picture that starts late was kept from starting by the one before, so that all of the time since that one began was spent, and
//! what was not work was spent on showing it. One that starts on time says only that showing took no longer than what was left.

use std::time::Duration;

/// Late starts that are remembered; their median counts, so that a hiccup of the system does not.
const REMEMBERED: usize = 9;

/// What is left of the estimate after a picture on time: a tenth less in three seconds at 30 Hz, and the next late start mends it.
const FADING: f64 = 0.999;

/// The time that showing a picture takes.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Presenting {
    /// Seconds, newest last; zeros before there are so many.
    late_s: [f64; REMEMBERED],
    known: usize,
    estimate_s: f64,
    /// Work of the newest picture; `None` where that says nothing.
    work_s: Option<f64>,
}

impl Presenting {
    /// The estimate.
    pub fn time(&self) -> Duration {
        Duration::try_from_secs_f64(self.estimate_s).unwrap_or(Duration::ZERO)
    }

    /// Learns what the newest picture took besides being shown; `counts` where it was a picture like others.
    pub fn worked(&mut self, work: Duration, counts: bool) {
        self.work_s = counts.then_some(work.as_secs_f64());
    }

    /// Learns that the next picture started so long after the newest one did, and whether that was late.
    pub fn started(&mut self, interval: Duration, late: bool) {
        let Some(work_s) = self.work_s.take() else { return };
        let left_s = (interval.as_secs_f64() - work_s).max(0.0);
        if late {
            self.late_s.rotate_left(1);
            self.late_s[REMEMBERED - 1] = left_s;
            self.known = (self.known + 1).min(REMEMBERED);
            self.estimate_s = self.median();
        } else {
            self.estimate_s = (FADING * self.estimate_s).min(left_s);
        }
    }

    fn median(&self) -> f64 {
        let mut sorted = self.late_s;
        let known = &mut sorted[REMEMBERED - self.known..];
        known.sort_by(f64::total_cmp);
        known[(self.known - 1) / 2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(time: f64) -> Duration {
        Duration::from_secs_f64(time * 1e-3)
    }

    /// Pictures of `work` on a screen that takes 15 ms to show one, one every 33 ms where that is possible.
    fn play(presenting: &mut Presenting, work: f64, pictures: usize) {
        for _ in 0..pictures {
            presenting.worked(ms(work), true);
            let busy = work + 15.0;
            presenting.started(ms(busy.max(33.0)), busy > 34.0);
        }
    }

    #[test]
    fn late_pictures_tell_how_long_showing_takes_and_those_on_time_do_not_forget_it() {
        let mut presenting = Presenting::default();
        play(&mut presenting, 10.0, 20);
        assert_eq!(presenting.time(), Duration::ZERO);
        play(&mut presenting, 25.0, 5);
        assert!((presenting.time().as_secs_f64() - 0.015).abs() < 1e-9);
        play(&mut presenting, 10.0, 60);
        assert!((0.014..=0.015).contains(&presenting.time().as_secs_f64()), "{:?}", presenting.time());
    }

    #[test]
    fn one_stall_of_the_system_is_not_believed() {
        let mut presenting = Presenting::default();
        play(&mut presenting, 25.0, 9);
        presenting.worked(ms(25.0), true);
        presenting.started(ms(900.0), true);
        assert!((presenting.time().as_secs_f64() - 0.015).abs() < 1e-9);
    }

    #[test]
    fn pictures_unlike_others_teach_nothing() {
        let mut presenting = Presenting::default();
        presenting.worked(ms(25.0), false);
        presenting.started(ms(500.0), true);
        presenting.started(ms(500.0), true);
        assert_eq!(presenting.time(), Duration::ZERO);
    }
}
