//! The part z of the faster stage of drawing that the slower does not hide, learned while frames are drawn.
//!
//! In: frames as they were drawn, priced with z = 0 and z = 1. Out: the z that explains them best. Never here: prices, levels.
//! Theory: `docs/theory/budget.md`, eq. 41b … 41d, by competing models (Mag65).

use crate::adaptive::SpeedEstimator;
use crate::cost::fit::SERIAL;

/// Memory of the evidence: each frame counts 3 %, as in the scatter of [`SpeedEstimator`].
const MEMORY: f64 = 0.97;
/// Twice the logarithm of the odds at which another z is taken: 400 to 1.
const SURE: f64 = 12.0;
/// Most that one frame may count, three deviations: less than [`SURE`], so that no single frame, such as a stall, takes another z.
const MOST: f64 = 9.0;

/// Competing values of z, each with a γ of its own.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct SerialPart {
    estimators: [SpeedEstimator; SERIAL.len()],
    /// Squared errors in deviations, with memory.
    misfit: [f64; SERIAL.len()],
}

/// A z that frames speak clearly for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LearnedSerial {
    pub serial: f64,
    /// The γ that goes with it.
    pub estimator: SpeedEstimator,
}

impl SerialPart {
    /// Reports a frame of which the objects took `drawn`, and by the prices `hidden` with z = 0 and `shown` with z = 1, as parts of the target.
    /// Another z than `held`, if the frames speak clearly for it.
    pub fn observe(&mut self, [hidden, shown]: [f64; 2], drawn: f64, held: f64) -> Option<LearnedSerial> {
        if !(hidden > 0.0 && shown > hidden && drawn > 0.0 && shown.max(drawn).is_finite()) {
            return None;
        }
        let at = nearest(held);
        let tables = SERIAL.map(|z| hidden + z * (shown - hidden));
        // one deviation for all: at rest every z fits the same frames, and none may gain by it
        let variance = self.estimators[at].variance_of(tables[at]);
        for ((estimator, misfit), table) in self.estimators.iter_mut().zip(&mut self.misfit).zip(tables) {
            let error = libm::log(drawn / (estimator.slowness() * table));
            *misfit = MEMORY * *misfit + (error * error / variance).min(MOST);
            estimator.observe(table, drawn);
        }
        let best = (0..SERIAL.len()).min_by(|a, b| self.misfit[*a].total_cmp(&self.misfit[*b]))?;
        let learned = LearnedSerial { serial: SERIAL[best], estimator: self.estimators[best] };
        (self.misfit[best] + SURE < self.misfit[at]).then_some(learned)
    }
}

fn nearest(held: f64) -> usize {
    let off = |at: &usize| (SERIAL[*at] - held).abs();
    (0..SERIAL.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames that z = 0 and z = 1 price at these times, each drawn in `drawn`; the z taken last, if any.
    fn taken(part: &mut SerialPart, frames: impl IntoIterator<Item = ([f64; 2], f64)>) -> Option<f64> {
        let taken = frames.into_iter().filter_map(|(table, drawn)| part.observe(table, drawn, 0.0));
        taken.map(|learned| learned.serial).last()
    }

    #[test]
    fn one_stall_takes_no_other_z_however_much_further_it_is_off_by_the_held_one() {
        let mut part = SerialPart::default();
        let at_rest = || (0..100).map(|_| ([0.8, 1.0], 0.8));
        assert_eq!(taken(&mut part, at_rest()), None);
        // every γ fits the frames at rest; then triangles come, which z = 0 hides and z = 1 does not, and the frame stalls: six deviations
        // by z = 0, four by z = 1
        let deviation = part.estimators[0].variance_of(0.8).sqrt();
        let stalled = 0.8 * (6.0 * deviation).exp();
        let shown = 1.0 * (2.0 * deviation).exp();
        let before = part.misfit;
        assert_eq!(taken(&mut part, [([0.8, shown], stalled)]), None, "{before:?} to {:?}", part.misfit);
        assert_eq!(taken(&mut part, at_rest()), None);
        // two such frames are no stall any more
        let mut twice = SerialPart::default();
        taken(&mut twice, at_rest());
        assert!(taken(&mut twice, [([0.8, 1.4], 1.12); 3]).is_some());
    }
}
