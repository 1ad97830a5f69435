//! When a choice may change: the deadline, the hysteresis of a still picture, and the trim.
//!
//! In: times of frames. Out: a verdict, a correction. Never here: a clock; the caller measures.
//! Theory: `docs/theory/budget.md`, eq. 39, 40.

/// A still picture is coarsened where it is predicted past its budget by as much as the least margin is worth: where that is the margin,
/// past T.
const PAST_BUDGET: f64 = 1.0 / (1.0 - super::DEFAULT_MARGIN);
/// A still picture is refined where this fraction of T was to spare …
const SPARE: f64 = 0.05;
/// … this often in a row: initially about as long as it takes to see that a machine has calmed down; doubled after each time that the
/// picture had to be coarsened, up to the greatest, some ten seconds.
const SPARE_IN_A_ROW: (u16, u16) = (8, 512);

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
    /// Whether the last choice may stay: `predicted` is its time now, `goal` the budget, both as fractions of T;
    /// `can_rise` where not everything is at its finest.
    pub(crate) fn keeps(&mut self, predicted: f64, goal: f64, can_rise: bool) -> bool {
        self.spare = if can_rise && goal - predicted > SPARE { self.spare.saturating_add(1) } else { 0 };
        let (late, rises) = (predicted > (PAST_BUDGET * goal).min(1.0), self.spare >= self.patience);
        if late {
            self.patience = (2 * self.patience).min(SPARE_IN_A_ROW.1);
        }
        if late || rises {
            self.spare = 0;
        }
        !(late || rises)
    }
}

/// A slow correction of the budget by the time that frames lacked or left over; off by default, since γ does the same sooner.
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
