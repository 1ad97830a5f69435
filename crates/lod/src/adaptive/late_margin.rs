//! The margin that keeps late frames rare: an upper quantile of how much longer a frame takes than its neighbours, from
//! the newest frames.
//!
//! In: predicted and measured times of frames. Out: the fraction of T to leave free. Never here: a clock, a choice, how slow the machine is.
//! Theory: `docs/theory/budget.md`, eq. 37, 38, after (Wil41).

/// A frame that exceeds T by more than this fraction is late.
pub const LATE: f64 = 0.05;
/// The share of frames that may be late: of 256 the fourth exceeds the bound. Users are promised 1 of 50, and not all is exchangeable.
pub const LATE_SHARE: f64 = 1.0 / 64.0;
/// Frames whose residuals are stored: nine seconds at 30 Hz. With fewer the bound wanders, with more a machine that calms down waits longer.
const FRAMES: usize = 256;
/// Fewest frames that may exceed the bound: one slow frame is a hiccup.
const EXCEEDING_LEAST: usize = 2;
/// A frame that took more than this many times as long as its neighbours is a stall: no margin that leaves a picture
/// would have prevented it.
const STALL: f64 = 4.0;
/// Frames around a frame, itself among them, whose median stands for the speed of the machine: half of them in a row that are slow are a
/// change of the load, fewer are scatter. With 9 a slow wander of the machine, which γ follows only in part, was half missed; with 25
/// nothing was gained. The residual of a frame is known half of them later.
const AROUND: usize = 17;

/// The margin by the newest frames.
///
/// The residual of a frame is its measured over its predicted time, by the same table for all frames, over the median of that ratio among
/// the frames before and after it: an edge of the load passes a median unchanged, so that a step leaves residuals of 1 on both its sides.
///
/// Of n exchangeable residuals and the next one, that one is the greatest, the second, … with equal probability, whatever their
/// distribution: it exceeds the k-th greatest of the n with probability k/(n + 1) (Wil41).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LateMargin {
    share: f64,
    /// Measured over predicted time of the newest frames, oldest first.
    ratios: [f64; AROUND],
    /// How many of them are known: the last ones.
    known: usize,
    /// Residuals of the newest frames, in a ring: the next one goes to `next`. 0 is none.
    residuals: [f32; FRAMES],
    next: usize,
    margin: f64,
}

impl LateMargin {
    /// One without residuals: its margin is 0. `share` of frames may be late: 0 … 1, where 1 asks for no margin.
    #[must_use]
    pub fn new(share: f64) -> Self {
        let share = crate::within(share, 0.0, 1.0);
        Self { share, ratios: [0.0; AROUND], known: 0, residuals: [0.0; FRAMES], next: 0, margin: 0.0 }
    }

    /// Reports the time of a frame that was predicted by the table alone, without γ, and its measured time, in one unit, > 0; others are
    /// ignored. Frames are reported in the order in which they were drawn.
    pub fn observe(&mut self, predicted: f64, took: f64) {
        let ratio = took / predicted;
        if !(predicted > 0.0 && ratio > 0.0 && ratio.is_finite()) {
            return;
        }
        self.ratios.rotate_left(1);
        self.ratios[AROUND - 1] = ratio;
        self.known = (self.known + 1).min(AROUND);
        if self.known < AROUND {
            return;
        }
        let mut sorted = self.ratios;
        let (_, median, _) = sorted.select_nth_unstable_by(AROUND / 2, f64::total_cmp);
        let residual = self.ratios[AROUND / 2] / *median;
        if residual <= STALL {
            self.residuals[self.next] = residual as f32;
            self.next = (self.next + 1) % FRAMES;
            self.update();
        }
    }

    /// Reports that the next frame does not follow the last one: stored frames whose neighbours are missing are
    /// dropped.
    pub(super) fn interrupt(&mut self) {
        self.known = 0;
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
        let mut sorted = self.residuals;
        let known = sorted.iter().filter(|residual| **residual > 0.0).count();
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
