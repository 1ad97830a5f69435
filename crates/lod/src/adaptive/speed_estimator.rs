//! How much slower the machine is than its cost table, as one number: a Kalman filter with outlier rejection.
//!
//! In: the time predicted by the table, and the time measured. Out: γ = measured / predicted, and how far it can be trusted.
//! Never here: clocks, or which frame a measurement belongs to ([`super::Adaptive`] knows). Theory: `docs/theory/budget.md`, eq. 34 … 36.

use crate::within;

/// Least and greatest process noise: growth of the variance of γ between measurements. γ may drift by 1.4 to 14 % a frame.
pub(crate) const WANDER: (f64, f64) = (2e-4, 2e-2);
/// Initial process noise, 4.5 % a frame: on an unknown machine measurements count much until they turn out to be noisy.
const WANDER_START: f64 = 2e-3;
/// Rate at which the process noise follows the correlation of consecutive errors, and the correlation that counts as chance: with 0, the
/// process noise itself would drift.
const WANDER_RATE: f64 = 0.1;
const CHANCE_CORRELATION: f64 = 0.1;
/// Initial variance of γ: the table may be 14 % wrong before an error counts as an outlier.
const P_START: f64 = 0.02;
/// Variance of γ after a change of regime: the next measurement is taken in full.
const P_REGIME: f64 = 0.2;
/// Least standard deviation of a measurement, as a fraction of the frame's time.
pub(crate) const SIGMA_LEAST: f64 = 0.01;
/// Memory of σ²: each measurement counts 3 %.
const SIGMA_MEMORY: f64 = 0.97;
/// An error past this many σ is an outlier …
const OUTLIER: f64 = 4.0;
/// … unless this many in a row err on the same side: then the machine has changed.
const IN_A_ROW: i8 = 3;
/// Range of γ whatever is measured: a table wrong by a factor of a thousand is a mistake elsewhere.
const SLOWNESS_RANGE: (f64, f64) = (1e-3, 1e3);

/// The effect of a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FilterUpdate {
    /// γ has moved towards the measurement.
    Accepted,
    /// The measurement was too far off and is ignored, unless more follow on its side.
    Outlier,
    /// The measurement was the third outlier on the same side: γ has jumped.
    NewRegime,
    /// Not a usable measurement: not a valid number, or nothing was predicted.
    Rejected,
}

/// γ of one stage: drawing, culling, or one class of simulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedEstimator {
    slowness: f64,
    variance: f64,
    sigma2: f64,
    /// Q: growth of the variance between measurements.
    wander: f64,
    /// The last error used, and the mean product of consecutive errors.
    last_error: f64,
    error_product: f64,
    /// Consecutive outliers: counts up for too slow, down for too fast.
    outliers_in_a_row: i8,
}

impl Default for SpeedEstimator {
    fn default() -> Self {
        Self {
            slowness: 1.0,
            variance: P_START,
            sigma2: SIGMA_LEAST * SIGMA_LEAST,
            wander: WANDER_START,
            last_error: 0.0,
            error_product: 0.0,
            outliers_in_a_row: 0,
        }
    }
}

impl SpeedEstimator {
    /// Measured ticks per tick of the table, 0.001 … 1000.
    #[must_use]
    pub fn slowness(&self) -> f64 {
        self.slowness
    }

    /// σ̂: standard deviation of the error of a prediction, as a fraction of the frame's time.
    #[must_use]
    pub fn sigma(&self) -> f64 {
        libm::sqrt(self.sigma2)
    }

    /// Variance of the relative error of a prediction of `table`, a fraction of the frame's time, > 0.
    pub(crate) fn variance_of(&self, table: f64) -> f64 {
        let predicted = self.slowness * table;
        (self.sigma2 + (self.variance + self.wander) * table * table) / (predicted * predicted)
    }

    /// The same for a table that predicts `factor` times less for the same work.
    pub(crate) fn rescaled(self, factor: f64) -> Self {
        let slowness = within(factor * self.slowness, SLOWNESS_RANGE.0, SLOWNESS_RANGE.1);
        Self { slowness, variance: factor * factor * self.variance, ..self }
    }

    /// Updates γ: `took` was measured where the table, without γ, predicted `table`; both as fractions of the frame's time T.
    pub fn observe(&mut self, table: f64, took: f64) -> FilterUpdate {
        if !(table.is_finite() && table > 0.0 && took.is_finite() && took >= 0.0) {
            return FilterUpdate::Rejected;
        }
        let error = took - self.slowness * table;
        let is_outlier = error.abs() > OUTLIER * libm::sqrt(self.sigma2 + self.variance * table * table);
        let update = if is_outlier { self.check_outlier(error) } else { FilterUpdate::Accepted };
        if !is_outlier {
            self.outliers_in_a_row = 0;
        }
        if update == FilterUpdate::Outlier {
            return update;
        }
        // a measurement of γ with standard deviation σ/ŷ₀
        let noise = self.sigma2 / (table * table);
        self.variance += self.wander;
        let gain = self.variance / (self.variance + noise);
        let corrected = self.slowness + gain * (took / table - self.slowness);
        self.slowness = within(corrected, SLOWNESS_RANGE.0, SLOWNESS_RANGE.1);
        self.variance *= 1.0 - gain;
        if update == FilterUpdate::Accepted {
            self.sigma2 =
                (SIGMA_MEMORY * self.sigma2 + (1.0 - SIGMA_MEMORY) * error * error).max(SIGMA_LEAST * SIGMA_LEAST);
            self.follow(error);
        }
        update
    }

    /// Consecutive errors that correlate show that γ follows too slowly; uncorrelated errors, that it follows fast enough (Meh70, eq. 35a).
    fn follow(&mut self, error: f64) {
        self.error_product = SIGMA_MEMORY * self.error_product + (1.0 - SIGMA_MEMORY) * error * self.last_error;
        self.last_error = error;
        let correlation = within(self.error_product / self.sigma2, -1.0, 1.0);
        self.wander =
            within(self.wander * libm::exp(WANDER_RATE * (correlation - CHANCE_CORRELATION)), WANDER.0, WANDER.1);
    }

    fn check_outlier(&mut self, error: f64) -> FilterUpdate {
        let side = if error > 0.0 { 1 } else { -1 };
        self.outliers_in_a_row = if self.outliers_in_a_row * side >= 0 { self.outliers_in_a_row + side } else { side };
        if self.outliers_in_a_row.abs() < IN_A_ROW {
            return FilterUpdate::Outlier;
        }
        self.outliers_in_a_row = 0;
        self.variance = P_REGIME;
        FilterUpdate::NewRegime
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Root-mean-square error of γ as the filter predicts it, over the last half of 4000 measurements with a table of 1.
    fn error_rms(mut next: impl FnMut(usize) -> f64) -> (f64, SpeedEstimator) {
        let mut estimator = SpeedEstimator::default();
        let mut square = 0.0;
        for k in 0..4000 {
            let took = next(k);
            square += if k >= 2000 { (took - estimator.slowness()) * (took - estimator.slowness()) } else { 0.0 };
            estimator.observe(1.0, took);
        }
        (libm::sqrt(square / 2000.0), estimator)
    }

    /// Random numbers of deviation about 1: sums of four uniform ones of a congruential generator.
    fn noise() -> impl FnMut() -> f64 {
        let mut state = 7_u64;
        move || {
            let mut uniform = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
            };
            let four = uniform() + uniform() + uniform() + uniform();
            four * 1.732
        }
    }

    #[test]
    fn noise_of_the_machine_is_not_followed() {
        let mut noise = noise();
        let (rms, estimator) = error_rms(|_| 1.0 + 0.05 * noise());
        assert!(estimator.wander == WANDER.0, "{}", estimator.wander);
        assert!(rms < 0.056, "{rms}: the tremble itself is 0.05");
    }

    #[test]
    fn drift_of_the_machine_is_followed_at_its_own_speed() {
        let (mut noise, mut wandered) = (noise(), 0.0);
        // random walk of 5 % a measurement, mean-reverting, and 2 % of noise: the filter that knows both errs by 0.057
        let (rms, estimator) = error_rms(|_| {
            wandered = 0.98 * wandered + 0.05 * noise();
            1.0 + wandered + 0.02 * noise()
        });
        assert!(estimator.wander > 4.0 * WANDER.0, "{}", estimator.wander);
        assert!(rms < 1.2 * 0.057, "{rms}");
    }
}
