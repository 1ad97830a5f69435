//! The declared machine of these experiments: the ratio of a frame's time to that of its table.
//!
//! In: a seed, and the machine's faults. Out: for every frame the factor between its time and the table's.
//! Never here: a clock; the same seed gives the same bits. The noise is that of `docs/theory/budget.md`, section 10.

use std::ops::Range;

/// Uniform and normal numbers from a seed: xorshift, and the sum of twelve uniforms.
#[derive(Debug, Clone)]
pub(crate) struct RandomSource(u64);

impl RandomSource {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    /// 0 … 1.
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Mean 0, standard deviation 1.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// Faults of a machine, in addition to the noise that every machine has.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fault {
    /// The machine is this much slower than its table.
    pub(crate) slow: f64,
    /// Frames in which everything takes this much longer.
    pub(crate) load: (Range<usize>, f64),
    /// Probability that a frame takes half as long again.
    pub(crate) spikes: f64,
    /// Standard deviation of the table's error that wanders with the view; nine tenths of it persist from frame to frame.
    pub(crate) wander: f64,
    /// Standard deviation of the error that does not persist.
    pub(crate) tremble: f64,
}

impl Fault {
    /// The table is right, except for the noise.
    pub(crate) const NONE: Self = Self { slow: 1.0, load: (0..0, 1.0), spikes: 0.0, wander: 0.05, tremble: 0.01 };
}

/// The state of a machine during a run.
#[derive(Debug, Clone)]
pub(crate) struct Machine {
    noise: RandomSource,
    wander: f64,
    fault: Fault,
}

/// Share of the wandering error that persists from frame to frame.
const MEMORY: f64 = 0.9;
/// Factor of a spike.
const SPIKE: f64 = 1.5;

impl Machine {
    pub(crate) fn new(seed: u64, fault: Fault) -> Self {
        Self { noise: RandomSource::new(seed), wander: 0.0, fault }
    }

    /// Time of the next frame over that of the table.
    pub(super) fn slower(&mut self, frame: usize) -> f64 {
        self.wander =
            MEMORY * self.wander + libm::sqrt(1.0 - MEMORY * MEMORY) * self.fault.wander * self.noise.normal();
        let spike = if self.noise.uniform() < self.fault.spikes { SPIKE } else { 1.0 };
        let tremble = 1.0 + self.fault.tremble * self.noise.normal();
        let (during, load) = &self.fault.load;
        let load = if during.contains(&frame) { *load } else { 1.0 };
        self.fault.slow * load * spike * (1.0 + self.wander) * tremble
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cost_table_errs_by_five_percent_correlated_over_ten_frames() {
        let mut machine = Machine::new(7, Fault::NONE);
        let errors: Vec<f64> = (0..20_000).map(|frame| machine.slower(frame) - 1.0).collect();
        let product =
            |lag: usize| errors.iter().zip(&errors[lag..]).map(|(a, b)| a * b).sum::<f64>() / errors.len() as f64;
        // √(0.05² + 0.01²), and 0.9 of the part that wanders: 20,000 frames hold 1000 independent ones, so to 5 %
        assert!((product(0).sqrt() - 0.051).abs() < 0.003, "{}", product(0).sqrt());
        assert!((product(1) / product(0) - 0.9 * 25.0 / 26.0).abs() < 0.02, "{}", product(1) / product(0));
    }
}
