//! The time of a frame that logic takes: before the drawing, what is in view and its choice; beside it, agents that step and the next
//! choice (RH05, §4.2 and 5.3).
//!
//! In: measured frames. Out: seconds that are not left for drawing. Never here: prices of the drawing.
//! Theory: `docs/theory/budget.md`, eq. 50 … 53.
//!
//! How much of it drawing hides follows from frames: z = 0 where a graphics processor draws, 1 where one core does both.

use crate::cost::overlap::{Overlap, OverlapFit};

/// The part of the estimate that a new frame replaces: about twenty frames of memory.
const NEWS: f64 = 0.05;

/// The same of logic before the drawing: about ten frames of memory.
const NEWS_BEFORE: f64 = 0.1;

/// Weight of no time for no objects in a frame's measurements: it decides only where as many objects have been in view all along.
const NOTHING_WEIGHT: f64 = 1e-3;

/// Greatest part of a frame that logic is taken to be: a frame is planned to take no less than its logic (RH05, §5.3).
const MOST: f64 = 0.95;

/// Logic before the drawing: a line over the objects in view, fitted to the last frames, so that a turn of the camera is paid for before its
/// first picture.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct LogicBefore {
    weight: f64,
    /// Weighted sums of objects, seconds, squares of objects, and products.
    sums: [f64; 4],
}

impl LogicBefore {
    /// Reports a frame with so many objects in view.
    pub fn observe(&mut self, objects: usize, seconds: f64) {
        let n = objects as f64;
        self.weight = (1.0 - NEWS_BEFORE) * self.weight + 1.0;
        for (sum, new) in self.sums.iter_mut().zip([n, seconds, n * n, n * seconds]) {
            *sum = (1.0 - NEWS_BEFORE) * *sum + new;
        }
    }

    /// Seconds with so many objects in view.
    pub fn seconds(&self, objects: usize) -> f64 {
        if self.weight == 0.0 {
            return 0.0;
        }
        let [mean_n, mean_s, squares, products] = self.sums.map(|sum| sum / self.weight);
        let all = 1.0 + NOTHING_WEIGHT;
        // with the point of nothing, the means are a little less
        let spread = squares / all - mean_n * mean_n / (all * all);
        let together = products / all - mean_n * mean_s / (all * all);
        // no objects take no less than no time
        let slope = if spread > 0.0 { (together / spread).min(mean_s / mean_n).max(0.0) } else { 0.0 };
        (mean_s + slope * (objects as f64 - mean_n)).max(0.0)
    }
}

/// Logic beside the drawing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Logic {
    /// In a frame, seconds, smoothed.
    beside_s: Option<f64>,
    fit: OverlapFit,
}

impl Logic {
    /// Reports a frame that was drawn in `drawn_s`, of which the prices expected `priced_s`, with `beside_s` of logic meanwhile.
    pub fn observe(&mut self, beside_s: f64, priced_s: f64, drawn_s: f64) {
        self.beside_s = Some(self.beside_s.map_or(beside_s, |held| held + NEWS * (beside_s - held)));
        self.fit.fade(1.0 - NEWS);
        self.fit.add(beside_s, priced_s, drawn_s);
    }

    /// Seconds of `frame_s` that are lost for drawing.
    pub fn lost_s(&self, frame_s: f64) -> f64 {
        match self.beside_s {
            Some(beside_s) if beside_s > 0.0 && frame_s > 0.0 => {
                let overlap: Overlap = self.fit.overlap();
                (frame_s - overlap.drawing(frame_s, beside_s.min(MOST * frame_s))).max(0.0)
            }
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Seconds lost of a frame of 20 ms once frames of a machine with this z were drawn, 10 ms by the prices.
    fn lost_s(serial: f64, beside_s: f64) -> f64 {
        let mut logic = Logic::default();
        for k in 0..100 {
            let priced_s = 10e-3 * (1.0 + 0.1 * f64::from(k % 3));
            logic.observe(beside_s, priced_s, Overlap::frame(serial, beside_s, priced_s));
        }
        logic.lost_s(20e-3)
    }

    #[test]
    fn logic_that_drawing_hides_takes_nothing_and_logic_on_its_core_takes_all_of_it() {
        assert_eq!(Logic::default().lost_s(20e-3), 0.0);
        assert!(lost_s(0.0, 6e-3).abs() < 1e-9);
        assert!((lost_s(0.5, 6e-3) - 3e-3).abs() < 1e-9);
        assert!((lost_s(1.0, 6e-3) - 6e-3).abs() < 1e-9);
    }

    #[test]
    fn logic_before_the_drawing_grows_with_what_comes_into_view() {
        let mut before = LogicBefore::default();
        assert_eq!(before.seconds(100), 0.0);
        // 10 µs an object; nothing but their number has been seen to change the time
        (0..50).for_each(|_| before.observe(20, 200e-6));
        assert!((before.seconds(20) - 200e-6).abs() < 1e-9 && (before.seconds(200) - 2e-3).abs() < 1e-6);
        // a millisecond whatever is in view: the line is found in the first frames that differ
        let mut before = LogicBefore::default();
        (0..50).for_each(|k| {
            before.observe(if k < 40 { 20 } else { 200 }, 1e-3 + 10e-6 * if k < 40 { 20.0 } else { 200.0 })
        });
        for n in [0, 50, 200, 400] {
            let expected = 1e-3 + 10e-6 * n as f64;
            assert!((before.seconds(n) - expected).abs() < 0.02 * expected, "{n}: {}", before.seconds(n));
        }
    }

    #[test]
    fn logic_longer_than_the_frame_leaves_a_little_for_drawing() {
        let lost = lost_s(1.0, 50e-3);
        assert!((lost - 19e-3).abs() < 1e-9, "{lost}");
    }
}
