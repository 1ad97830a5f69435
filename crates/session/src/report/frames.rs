//! Statistics of a run's frames, with the definitions by which all policies are compared.
//!
//! In: one row per frame and the target. Out: spreads, misses, errors on binding frames, settling. Never here: measuring.
//!
//! x is a frame's work in units of the target. *Binding* frames are frames whose full-detail cost exceeds 1.15 of it:
//! the others would be on time without any policy and say nothing about one.

use crate::FrameRecord;
use serde::Serialize;

/// A miss is a frame whose work exceeds this many targets.
pub const MISS: f64 = 1.05;
/// A frame is binding where its full-detail cost exceeds this many targets: the others would be on time under any policy.
pub const BINDING: f64 = 1.15;
/// Frames of the median that has to settle.
pub const SETTLE_MEDIAN: usize = 9;
/// The median must stay this close to the later mean, as a share of it …
pub const SETTLE_BAND: f64 = 0.06;
/// … for so many frames.
pub const SETTLE_HOLD: usize = 20;

/// Mean, spread and percentiles of a measured time, milliseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Statistics {
    /// Mean.
    pub mean: f64,
    /// Standard deviation (of the whole, not of a sample).
    pub stddev: f64,
    /// Least.
    pub min: f64,
    /// Median.
    pub p50: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Greatest.
    pub max: f64,
}

/// Summary of the frames of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrameSummary {
    /// Work of the frames; `None` where there was no frame, or frames were not drawn and have no declared cost.
    pub frame_ms: Option<Statistics>,
    /// The adapter's own time; `None` where it has no time stamps or nothing was drawn.
    pub gpu_ms: Option<Statistics>,
    /// Paced distance between frames; `None` without any.
    pub interval_ms: Option<Statistics>,
    /// Standard deviation of x over binding frames; `None` without any.
    pub binding_stddev: Option<f64>,
    /// Mean of |x − 1| over binding frames; `None` without any.
    pub avg_err: Option<f64>,
    /// Share of frames with x above 1.05; `None` where `frame_ms` is.
    pub missed_share: Option<f64>,
    /// First frame after which the median of 9 frames stays within 6 % of the later mean for 20 frames; `None` if never.
    pub settle_frames: Option<u64>,
}

impl Statistics {
    /// The spread of `values`; `None` where there are none. Values that are not finite are left out.
    #[must_use]
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
        if sorted.is_empty() {
            return None;
        }
        sorted.sort_by(f64::total_cmp);
        let (mean, stddev) = mean_and_stddev(&sorted);
        // nearest rank: the least value that so many percent do not exceed
        let rank = |p: f64| sorted[((p * sorted.len() as f64).ceil() as usize).clamp(1, sorted.len()) - 1];
        Some(Self {
            mean,
            stddev,
            min: sorted[0],
            p50: rank(0.5),
            p95: rank(0.95),
            p99: rank(0.99),
            max: sorted[sorted.len() - 1],
        })
    }
}

fn mean_and_stddev(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count;
    (mean, variance.sqrt())
}

/// The statistics of `frames`, which should each take `target_ms`.
#[must_use]
pub fn summarise(frames: &[FrameRecord], target_ms: f64) -> FrameSummary {
    let x: Vec<f64> = frames.iter().map(|row| row.frame_ms / target_ms).collect();
    let binding: Vec<f64> =
        frames.iter().zip(&x).filter(|(row, _)| row.full_ms > BINDING * target_ms).map(|(_, x)| *x).collect();
    let missed = x.iter().filter(|x| **x > MISS).count();
    let (binding_stddev, avg_err) = if binding.is_empty() {
        (None, None)
    } else {
        let error = binding.iter().map(|x| (x - 1.0).abs()).sum::<f64>() / binding.len() as f64;
        (Some(mean_and_stddev(&binding).1), Some(error))
    };
    FrameSummary {
        frame_ms: Statistics::of(frames.iter().map(|row| row.frame_ms)),
        gpu_ms: Statistics::of(frames.iter().filter_map(|row| row.gpu_ms)),
        interval_ms: Statistics::of(frames.iter().map(|row| row.interval_ms)),
        binding_stddev,
        avg_err,
        missed_share: (!x.is_empty()).then(|| missed as f64 / x.len() as f64),
        settle_frames: settle(&x),
    }
}

/// The same for `frames` that were not drawn and have no declared cost: only their intervals are known.
#[must_use]
pub fn summarise_undrawn(frames: &[FrameRecord]) -> FrameSummary {
    FrameSummary { interval_ms: Statistics::of(frames.iter().map(|row| row.interval_ms)), ..summarise(&[], 1.0) }
}

/// The first frame after which the running median stays close to the later mean.
fn settle(x: &[f64]) -> Option<u64> {
    let medians: Vec<f64> = x.windows(SETTLE_MEDIAN).map(median).collect();
    let mut sum = 0.0;
    let mut later_means: Vec<f64> = x
        .iter()
        .rev()
        .zip(1_u32..)
        .map(|(x, count)| {
            sum += x;
            sum / f64::from(count)
        })
        .collect();
    later_means.reverse();
    let near = |median: f64, mean: f64| (median - mean).abs() <= SETTLE_BAND * mean;
    let stays = |k: &usize| medians[*k..*k + SETTLE_HOLD].iter().all(|m| near(*m, later_means[*k]));
    (0..(medians.len() + 1).saturating_sub(SETTLE_HOLD)).find(stays).map(|k| k as u64)
}

fn median(window: &[f64]) -> f64 {
    let mut sorted = [0.0; SETTLE_MEDIAN];
    sorted.copy_from_slice(window);
    sorted.sort_by(f64::total_cmp);
    sorted[SETTLE_MEDIAN / 2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rows(work: impl IntoIterator<Item = f64>, full_ms: f64) -> Vec<FrameRecord> {
        work.into_iter().map(|frame_ms| FrameRecord { frame_ms, full_ms, ..FrameRecord::default() }).collect()
    }

    #[test]
    fn percentiles_are_values_that_were_measured() {
        let spread = Statistics::of((1..=100).map(f64::from)).unwrap();
        assert_eq!((spread.min, spread.p50, spread.p95, spread.p99, spread.max), (1.0, 50.0, 95.0, 99.0, 100.0));
        assert_eq!(spread.mean, 50.5);
        // of 1 … n: sqrt((n² - 1)/12); sums of a hundred terms round in the last digits
        assert!((spread.stddev - (9999.0_f64 / 12.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn a_miss_is_more_than_five_percent_over() {
        let summary = summarise(&rows([10.0, 10.5, 10.51, 20.0], 0.0), 10.0);
        assert_eq!(summary.missed_share, Some(0.5));
    }

    #[test]
    fn only_binding_frames_judge_a_policy() {
        let mut frames = rows([9.0, 11.0], 12.0);
        frames.extend(rows([2.0, 2.0], 11.0));
        let summary = summarise(&frames, 10.0);
        assert!((summary.avg_err.unwrap() - 0.1).abs() < 1e-12);
        assert!((summary.binding_stddev.unwrap() - 0.1).abs() < 1e-12);
        assert_eq!(summarise(&frames[2..], 10.0).binding_stddev, None);
    }

    #[test]
    fn a_decay_settles_when_its_median_comes_within_the_band() {
        let steady = summarise(&rows([10.0; 40], 0.0), 10.0);
        assert_eq!(steady.settle_frames, Some(0));
        // halves each frame: 10 (1 + 2^-k); the median of k … k + 8 is that of k + 4, within 6 % of the mean from there
        let decay = summarise(&rows((0..200).map(|k| 10.0 + 80.0 * 0.5_f64.powi(k)), 0.0), 10.0);
        let k = decay.settle_frames.unwrap();
        assert!((2..=4).contains(&k), "{k}"); // 80/2^(k+4) <= 0.6 gives k >= 3.06 for a later mean of 10, 3 with its own tail
        let ramp = summarise(&rows((0..200).map(|k| 1.2_f64.powi(k)), 0.0), 10.0);
        assert_eq!(ramp.settle_frames, None);
    }

    #[test]
    fn a_single_spike_does_not_unsettle() {
        let spiky = (0..100).map(|k| if k == 10 { 50.0 } else { 10.0 });
        assert_eq!(summarise(&rows(spiky, 0.0), 10.0).settle_frames, Some(0));
    }

    #[test]
    fn an_unmeasured_statistic_is_none() {
        let summary = summarise(&[], 10.0);
        assert_eq!((summary.frame_ms, summary.interval_ms, summary.missed_share), (None, None, None));
        let undrawn = summarise_undrawn(&[FrameRecord { interval_ms: 20.0, ..FrameRecord::default() }]);
        assert_eq!((undrawn.frame_ms, undrawn.missed_share, undrawn.settle_frames), (None, None, None));
        assert_eq!(undrawn.interval_ms.map(|s| s.max), Some(20.0));
    }

    proptest! {
        #[test]
        fn the_order_of_percentiles_holds_for_any_values(values in proptest::collection::vec(any::<f64>(), 0..60)) {
            if let Some(s) = Statistics::of(values.iter().copied()) {
                prop_assert!(s.min <= s.p50 && s.p50 <= s.p95 && s.p95 <= s.p99 && s.p99 <= s.max);
            }
            let _ = summarise(&rows(values, 1.0), 1.0);
        }
    }
}
