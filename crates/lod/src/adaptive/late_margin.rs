//! The margin that keeps late frames rare: an upper quantile of measured over predicted time, taken from the newest frames.
//!
//! In: predicted and measured times of frames. Out: the fraction of T to leave free. Never here: a clock, a choice.
//! Theory: `docs/theory/budget.md`, eq. 37, 38, after (Wil41).

use super::speed_estimator::IN_A_ROW;

/// A frame that exceeds T by more than this fraction is late.
pub const LATE: f64 = 0.05;
/// The share of frames that may be late: of [`FRAMES`] the fourth exceeds the bound. Users are promised 1 of 50, and not all is exchangeable.
pub const LATE_SHARE: f64 = 1.0 / 64.0;
/// Frames whose ratios are stored: nine seconds at 30 Hz. With fewer the bound wanders, with more a machine that calms down waits longer.
const FRAMES: usize = 256;
/// Fewest frames that may exceed the bound: one slow frame is a hiccup.
const EXCEEDING_LEAST: usize = 2;
/// A frame that took more than this many times its predicted time is a stall: no margin that leaves a picture would have prevented it.
const STALL: f64 = 4.0;

/// The margin by the newest frames.
///
/// Of n exchangeable ratios and the next one, that one is the greatest, the second, … with equal probability, whatever their distribution:
/// it exceeds the k-th greatest of the n with probability k/(n + 1) (Wil41).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LateMargin {
    share: f64,
    /// Measured over predicted time of the newest frames, in a ring: the next one goes to `next`. 0 is none.
    ratios: [f32; FRAMES],
    next: usize,
    /// Frames since a step of the load was forgiven, [`FRAMES`] at most.
    since_step: usize,
    margin: f64,
}

impl LateMargin {
    /// A margin of 0 for now. `share` of frames may be late: 0 … 1, where 1 asks for no margin.
    #[must_use]
    pub fn new(share: f64) -> Self {
        let share = crate::within(share, 0.0, 1.0);
        Self { share, ratios: [0.0; FRAMES], next: 0, since_step: FRAMES, margin: 0.0 }
    }

    /// Reports predicted and measured time of a frame, in one unit, > 0; others are ignored, and so is a stall.
    pub fn observe(&mut self, predicted: f64, took: f64) {
        self.since_step = (self.since_step + 1).min(FRAMES);
        let ratio = took / predicted;
        if !(predicted > 0.0 && ratio > 0.0 && ratio <= STALL) {
            return;
        }
        self.ratios[self.next] = ratio as f32;
        self.next = (self.next + 1) % FRAMES;
        self.update();
    }

    /// Reports that the machine is slower from now on, and that predictions know it: the slow frames that showed it are forgotten.
    ///
    /// `false` where it did so before within as many frames as are stored: such a machine scatters, and its slow frames count.
    pub(super) fn forgive(&mut self) -> bool {
        let forgiven = self.since_step == FRAMES;
        self.since_step = 0;
        if forgiven {
            for _ in 1..IN_A_ROW {
                self.next = (self.next + FRAMES - 1) % FRAMES;
                self.ratios[self.next] = 0.0;
            }
            self.update();
        }
        forgiven
    }

    /// Takes another share of frames that may be late.
    pub(super) fn set_share(&mut self, share: f64) {
        self.share = crate::within(share, 0.0, 1.0);
        self.update();
    }

    /// The fraction of T to leave free, 0 … 0.74, so that the predicted time is late in no more than the share of frames.
    #[must_use]
    pub fn margin(&self) -> f64 {
        self.margin
    }

    fn update(&mut self) {
        let mut sorted = self.ratios;
        let known = sorted.iter().filter(|ratio| **ratio > 0.0).count();
        // a cast of floats truncates
        let exceeding = ((self.share * (known + 1) as f64) as usize).max(EXCEEDING_LEAST);
        self.margin = match known.checked_sub(exceeding) {
            Some(_) => {
                let (_, bound, _) = sorted.select_nth_unstable_by(FRAMES - exceeding, f32::total_cmp);
                (1.0 - (1.0 + LATE) / f64::from(*bound)).max(0.0)
            }
            None => 0.0,
        };
    }
}
