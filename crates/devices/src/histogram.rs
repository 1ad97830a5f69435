//! Quantiles of a number that is taken a thousand times a second, in bounded storage.
//!
//! In: numbers ≥ 0. Out: quantiles to half a bin. Never here: their meaning.

use super::report::Quantiles;

const BINS: usize = 2048;

/// How often a number was in each of equal bins; numbers beyond them count in the last one.
#[derive(Debug, Clone)]
pub struct Histogram {
    width: f64,
    bins: Vec<u32>,
    most: f64,
}

impl Histogram {
    /// Of numbers up to `BINS` times `width`.
    pub fn new(width: f64) -> Self {
        Self { width, bins: vec![0; BINS], most: 0.0 }
    }

    pub fn record(&mut self, value: f64) {
        self.bins[((value / self.width) as usize).min(BINS - 1)] += 1;
        self.most = self.most.max(value);
    }

    pub fn quantiles(&self) -> Quantiles {
        let all: u64 = self.bins.iter().map(|count| u64::from(*count)).sum();
        let at = |share: f64| {
            let (wanted, mut seen) = ((share * all as f64).ceil() as u64, 0);
            let found = self.bins.iter().position(|count| {
                seen += u64::from(*count);
                seen >= wanted
            });
            let middle = (found.unwrap_or(0) as f64 + 0.5) * self.width;
            // nothing was greater, and the last bin has no end
            if found == Some(BINS - 1) { self.most } else { middle.min(self.most) }
        };
        Quantiles { p50: at(0.5), p99: at(0.99), max: self.most }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_sorted_numbers() {
        let mut histogram = Histogram::new(0.01);
        (0..1000).for_each(|at| histogram.record(f64::from(at) * 1e-3));
        let Quantiles { p50, p99, max } = histogram.quantiles();
        assert!((p50 - 0.5).abs() < 0.01 && (p99 - 0.99).abs() < 0.01 && max == 0.999, "{p50} {p99} {max}");
    }
}
