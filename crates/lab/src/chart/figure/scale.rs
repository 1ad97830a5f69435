//! An axis as plotters needs it: the place of a value, and the values that are labelled.

use super::Axis;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use std::ops::Range;

/// An axis that chooses its own ticks.
#[derive(Debug, Clone)]
pub(super) struct Scale(pub(super) Axis);

impl Scale {
    /// The place of `value` as a share of the axis; beyond its ends, the end.
    fn share(&self, value: f64) -> f64 {
        let Axis { low, high, log, .. } = self.0;
        let share =
            if log { libm::log(value.max(low) / low) / libm::log(high / low) } else { (value - low) / (high - low) };
        share.clamp(0.0, 1.0)
    }

    /// The values to label, about `most` at most.
    fn ticks(&self, most: usize) -> Vec<f64> {
        let Axis { low, high, log, .. } = self.0;
        if log { decades(low, high, most) } else { round_steps(low, high, most) }
    }
}

/// 1, 2, 5 of every decade where these are not too many, else 1 of every decade, of every second one, and so on.
fn decades(low: f64, high: f64, most: usize) -> Vec<f64> {
    let (first, last) = (libm::floor(libm::log10(low)) as i32, libm::ceil(libm::log10(high)) as i32);
    let within = |list: &[f64], every: i32| -> Vec<f64> {
        let powers = (first..=last).filter(|p| p.rem_euclid(every) == 0);
        let all = powers.flat_map(|p| list.iter().map(move |m| m * libm::exp10(f64::from(p))));
        all.filter(|v| (low * 0.999..=high * 1.001).contains(v)).collect()
    };
    let fine = within(&[1.0, 2.0, 5.0], 1);
    if fine.len() <= most {
        return fine;
    }
    (1..).map(|every| within(&[1.0], every)).find(|ticks| ticks.len() <= most.max(2)).unwrap_or_default()
}

/// Multiples of 1, 2 or 5 times a power of ten.
fn round_steps(low: f64, high: f64, most: usize) -> Vec<f64> {
    let rough = (high - low) / most.max(2) as f64;
    let power = libm::exp10(libm::floor(libm::log10(rough)));
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough).unwrap_or(10.0 * power);
    let (first, last) = (libm::ceil(low / step) as i64, libm::floor(high / step) as i64);
    (first..=last).take(1000).map(|k| k as f64 * step).collect()
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        limit.0 + (self.share(*value) * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        self.ticks(hint.max_num_points().min(9))
    }

    fn range(&self) -> Range<f64> {
        self.0.low..self.0.high
    }
}

impl ValueFormatter<f64> for Scale {
    fn format(value: &f64) -> String {
        written(*value)
    }
}

/// A tick's label: short, and a power of ten where it is far from 1.
fn written(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || size < 1e-12 {
        return "0".to_owned();
    }
    if (1e-3..1e5).contains(&size) {
        let text = format!("{value:.4}");
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    let text = format!("{value:.2e}");
    let Some((mantissa, power)) = text.split_once('e') else { return text };
    format!("{}e{power}", mantissa.trim_end_matches('0').trim_end_matches('.'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_that_differ_are_written_differently() {
        assert_eq!([1e5, 1.5e5, 2e-4, -3e6, 0.25].map(written), ["1e5", "1.5e5", "2e-4", "-3e6", "0.25"]);
    }

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(Scale(Axis::log("", 0.1, 50.0)).ticks(9), [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0]);
        assert_eq!(Scale(Axis::log("", 4e4, 2e9)).ticks(9).len(), 5);
        assert_eq!(Scale(Axis::linear("", -0.02, 1.03)).ticks(6), [0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]);
    }

    #[test]
    fn equal_ratios_are_equal_distances() {
        let scale = Scale(Axis::log("", 1.0, 100.0));
        assert_eq!([0.5, 1.0, 10.0, 100.0, 1e9].map(|v| scale.map(&v, (0, 200))), [0, 0, 100, 200, 200]);
    }

    #[test]
    fn labels_are_short() {
        assert_eq!([0.0, 0.5, 20.0, 1e6, 1e-4].map(written), ["0", "0.5", "20", "1e6", "1e-4"]);
    }
}
