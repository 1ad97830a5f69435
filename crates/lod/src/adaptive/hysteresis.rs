//! When a choice may change: the miss ladder, the deadline, and the hysteresis of a still picture.
//!
//! In: times of frames. Out: a margin, a verdict. Never here: a clock; the caller measures.
//! Theory: `docs/theory/budget.md`, eq. 37 … 40.

/// A frame that exceeds T by more than this fraction is a miss that the ladder counts.
const MISS: f64 = 0.10;
/// This many in a row raise the margin …
const MISSES: u8 = 2;
/// … for this many frames.
const RAISED_FRAMES: u8 = 30;
/// A still picture is refined where this fraction of T was to spare …
const SPARE: f64 = 0.05;
/// … this often in a row: initially about as long as it takes to see that a machine has calmed down; doubled after each time that the
/// picture had to be coarsened, up to the greatest, some ten seconds.
const SPARE_IN_A_ROW: (u16, u16) = (8, 512);

/// Raises the margin for about half a second after two misses in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MissCounter {
    misses: u8,
    raised_frames: u8,
}

impl MissCounter {
    /// Reports that a frame took `part` of its time.
    pub fn observe(&mut self, part: f64) {
        self.raised_frames = self.raised_frames.saturating_sub(1);
        self.misses = if part > 1.0 + MISS { self.misses.saturating_add(1) } else { 0 };
        if self.misses >= MISSES {
            self.raised_frames = RAISED_FRAMES;
        }
    }

    /// Number added to the σ in the margin: 1 while the margin is raised.
    #[must_use]
    pub fn extra_sigmas(&self) -> f64 {
        if self.raised_frames > 0 { 1.0 } else { 0.0 }
    }
}

/// Whether the rest of a frame must be drawn in its lowest forms: `elapsed` is past 85 % of `target`.
///
/// An invalid time counts as late, which keeps the frame short.
#[must_use]
pub fn is_late(elapsed: f64, target: f64) -> bool {
    let in_time = elapsed <= 0.85 * target;
    !in_time
}

/// Whether the choice for a picture in which nothing moves still holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ChoiceHold {
    /// Consecutive frames with time to spare, and how many it takes to refine.
    spare: u16,
    patience: u16,
}

impl Default for ChoiceHold {
    fn default() -> Self {
        Self { spare: 0, patience: SPARE_IN_A_ROW.0 }
    }
}

impl ChoiceHold {
    /// Whether the last choice may stay: `predicted` is what it would take now, `goal` the budget, both as fractions of T; `can_rise` where
    /// not everything is at its finest.
    pub(crate) fn keeps(&mut self, predicted: f64, goal: f64, can_rise: bool) -> bool {
        self.spare = if can_rise && goal - predicted > SPARE { self.spare.saturating_add(1) } else { 0 };
        let (late, rises) = (predicted > 1.0, self.spare >= self.patience);
        if late {
            self.patience = (2 * self.patience).min(SPARE_IN_A_ROW.1);
        }
        if late || rises {
            self.spare = 0;
        }
        !(late || rises)
    }
}

/// A slow correction of the budget by the time that frames lacked or left over; off by default, since κ does the same sooner.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Trim {
    part: f64,
}

impl Trim {
    /// Reports the time left over of a frame, as a fraction of T; ignored where all was at its finest and time was left, for there was
    /// nothing to spend it on (eq. 40).
    pub fn observe(&mut self, left_over: f64, all_at_most: bool) {
        if left_over.is_finite() && !(all_at_most && left_over > 0.0) {
            self.part = crate::within(self.part + 0.03 * left_over, -0.10, 0.05);
        }
    }

    /// Correction of the budget, as a fraction of T: −0.10 … 0.05.
    #[must_use]
    pub fn part(&self) -> f64 {
        self.part
    }
}
