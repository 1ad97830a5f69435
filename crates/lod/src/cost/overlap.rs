//! How much of a frame is left for drawing when logic runs in parallel (RH05, §5.3).
//!
//! In: the time of the frame and of its logic. Out: the time available for drawing. Never here: the measurement of the logic.
//! Theory: `docs/theory/budget.md`, eq. 50 … 52.

/// How the times of logic and drawing combine into the time of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Overlap {
    /// ℓ = (t_l/t_f)², ρ = 1 − ℓ, t_r = ρ² t_f/C (RH05, eq. 5 … 7), with this C, > 0. With C = 1 a balanced frame takes 0.953 of
    /// the sum of both, not the ⅔ that the text says.
    Printed(f64),
    /// t_f = max(t_l, t_r) + z min(t_l, t_r), with this z, 0 (fully parallel) … 1 (one after the other): ours.
    Fitted(f64),
}

impl Overlap {
    /// The time for drawing in a frame of `frame` whose logic takes `logic`; 0 if the logic takes it all or a number is invalid.
    #[must_use]
    pub fn drawing(self, frame: f64, logic: f64) -> f64 {
        let sound = frame.is_finite() && frame > 0.0 && logic < frame;
        let logic = logic.max(0.0);
        if !sound || logic.is_nan() {
            return 0.0;
        }
        match self {
            Self::Printed(c) => {
                let part = logic / frame;
                let rho = 1.0 - part * part;
                rho * rho * frame / c.max(f64::MIN_POSITIVE)
            }
            Self::Fitted(serial) => {
                let serial = crate::within(serial, 0.0, 1.0);
                let longer = frame - serial * logic;
                // if drawing were the shorter of the two, it would lengthen the logic
                if longer >= logic { longer } else { ((frame - logic) / serial).min(logic) }
            }
        }
    }

    /// The time of a frame with these times of logic and drawing, by the fitted form.
    #[must_use]
    pub fn frame(serial: f64, logic: f64, drawing: f64) -> f64 {
        logic.max(drawing) + serial * logic.min(drawing)
    }

    /// z from measured frames (logic, drawing, frame), by least squares over the frames where both matter; 1 where none
    /// does.
    #[must_use]
    pub fn fit(frames: &[(f64, f64, f64)]) -> Self {
        let mut fit = OverlapFit::default();
        frames.iter().for_each(|&(logic, drawing, frame)| fit.add(logic, drawing, frame));
        fit.overlap()
    }
}

/// The least-squares fit of z while frames are measured.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OverlapFit {
    above: f64,
    below: f64,
}

impl OverlapFit {
    /// Adds a frame in which logic and drawing alone would have taken these times; one where neither is hidden by the other does not count.
    pub fn add(&mut self, logic: f64, drawing: f64, frame: f64) {
        let (less, more) = (logic.min(drawing), logic.max(drawing));
        if less > 0.0 && more.is_finite() && frame.is_finite() {
            self.above += less * (frame - more);
            self.below += less * less;
        }
    }

    /// Lets earlier frames count this part of their weight, 0 … 1.
    pub fn fade(&mut self, part: f64) {
        (self.above, self.below) = (part * self.above, part * self.below);
    }

    /// The overlap that fits best.
    #[must_use]
    pub fn overlap(&self) -> Overlap {
        Overlap::Fitted(if self.below > 0.0 { crate::within(self.above / self.below, 0.0, 1.0) } else { 1.0 })
    }
}
