//! Estimate of the presentation time where it cannot be measured: the part of the interval between two pictures that was neither work nor
//! idle waiting.
//!
//! In: the work of a picture, and the start of the next one. Out: a time. Never here: a clock.
//!
//! A picture that starts late was delayed by the one before, so that the whole interval since that one began was spent, and all that was
//! not work was presentation. A picture that starts on time only gives an upper bound: presentation took no longer than the rest of the
//! interval.

use std::time::Duration;

/// Late starts stored; their median counts, so that a single hiccup of the system does not.
const REMEMBERED: usize = 9;

/// Decay of the estimate with every picture on time: a tenth in three seconds at 30 Hz; the next late start corrects it.
const FADING: f64 = 0.999;

/// Estimator of the presentation time.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Presenting {
    /// Seconds, newest last; zeros in unused entries.
    late_s: [f64; REMEMBERED],
    known: usize,
    estimate_s: f64,
    /// Work of the newest picture; `None` where it does not count.
    work_s: Option<f64>,
}

impl Presenting {
    /// The estimate.
    pub fn time(&self) -> Duration {
        Duration::try_from_secs_f64(self.estimate_s).unwrap_or(Duration::ZERO)
    }

    /// Stores the work of the newest picture, without presentation; `counts` is false for an unusual picture (warm-up, resized, …).
    pub fn worked(&mut self, work: Duration, counts: bool) {
        self.work_s = counts.then_some(work.as_secs_f64());
    }

    /// Updates the estimate when the next picture starts `interval` after the newest one; `late` if after its due time.
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

    /// Pictures of `work` with a presentation time of 15 ms, one every 33 ms where possible.
    fn play(presenting: &mut Presenting, work: f64, pictures: usize) {
        for _ in 0..pictures {
            presenting.worked(ms(work), true);
            let busy = work + 15.0;
            presenting.started(ms(busy.max(33.0)), busy > 34.0);
        }
    }

    #[test]
    fn late_pictures_measure_the_present_time_and_punctual_ones_keep_it() {
        let mut presenting = Presenting::default();
        play(&mut presenting, 10.0, 20);
        assert_eq!(presenting.time(), Duration::ZERO);
        play(&mut presenting, 25.0, 5);
        assert!((presenting.time().as_secs_f64() - 0.015).abs() < 1e-9);
        play(&mut presenting, 10.0, 60);
        assert!((0.014..=0.015).contains(&presenting.time().as_secs_f64()), "{:?}", presenting.time());
    }

    #[test]
    fn a_single_stall_does_not_change_the_estimate() {
        let mut presenting = Presenting::default();
        play(&mut presenting, 25.0, 9);
        presenting.worked(ms(25.0), true);
        presenting.started(ms(900.0), true);
        assert!((presenting.time().as_secs_f64() - 0.015).abs() < 1e-9);
    }

    #[test]
    fn unusual_pictures_do_not_change_the_estimate() {
        let mut presenting = Presenting::default();
        presenting.worked(ms(25.0), false);
        presenting.started(ms(500.0), true);
        presenting.started(ms(500.0), true);
        assert_eq!(presenting.time(), Duration::ZERO);
    }
}
