//! What a policy's frames come to: the definitions by which every policy is compared.
//!
//! In: frames. Out: a row of numbers. Never here: who chose. The definitions are those of a run's report.

use super::closed_loop::Frame;
use serde::{Deserialize, Serialize};

/// A frame is binding where full detail would take more than this part of T.
const BINDING: f64 = 1.15;
/// A frame that takes more than this part of T is a miss.
const MISS: f64 = 1.05;
/// A choice within this of the best is as good as proven best.
const CERTIFIED: f64 = 0.01;

/// A policy on a scene: times as parts of T; NaN where nothing was to be measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in super::super) struct Row {
    /// Which scene, path or target.
    pub(super) setting: String,
    pub(super) policy: String,
    pub(super) frames: usize,
    pub(super) mean: f64,
    pub(super) min: f64,
    pub(super) max: f64,
    pub(super) stddev: f64,
    /// The part of frames in which full detail takes more than 1.15 T, and the times of those.
    pub(super) binding: f64,
    pub(super) binding_mean: f64,
    pub(super) binding_stddev: f64,
    /// Mean |t − T|/T of binding frames.
    pub(super) avg_err: f64,
    /// The part of frames past 1.05 T.
    pub(super) misses: f64,
    /// Mean |predicted − measured| over measured.
    pub(super) model_error: f64,
    /// Levels that changed, and changed back within three frames, to an object and frame.
    pub(super) changes: f64,
    pub(super) reversals: f64,
    /// Objects left out, to an object and frame.
    pub(super) holes: f64,
    /// Benefit over the bound at the true costs, and the part of frames whose own certificate is within 1 %.
    pub(super) value_over_bound: f64,
    pub(super) certified: f64,
    /// Frames until times stay near their later mean after a step of load.
    pub(super) settled: f64,
    /// Polygons to a frame.
    pub(super) polygons: f64,
}

impl Row {
    /// The row of some frames, of one run or of several.
    pub(super) fn of(setting: &str, policy: &str, frames: &[Frame]) -> Self {
        let times = |keep: fn(&&Frame) -> bool| frames.iter().filter(keep).map(|f| f.time).collect::<Vec<_>>();
        let (all, binding) = (times(|_| true), times(|f| f.full > BINDING));
        let part = |count: usize, of: usize| if of > 0 { count as f64 / of as f64 } else { f64::NAN };
        let things = frames.iter().map(|f| f.things).sum();
        let each = |of: fn(&Frame) -> usize| part(frames.iter().map(of).sum(), things);
        let known = |of: fn(&Frame) -> f64| frames.iter().map(of).filter(|x| x.is_finite()).collect::<Vec<_>>();
        let gaps = known(|f| f.gap);
        let extreme = |pick: fn(f64, f64) -> f64| all.iter().copied().reduce(pick).unwrap_or(f64::NAN);
        Self {
            setting: setting.to_owned(),
            policy: policy.to_owned(),
            frames: frames.len(),
            mean: mean(&all),
            min: extreme(f64::min),
            max: extreme(f64::max),
            stddev: stddev(&all),
            binding: part(binding.len(), all.len()),
            binding_mean: mean(&binding),
            binding_stddev: stddev(&binding),
            avg_err: mean(&binding.iter().map(|x| (x - 1.0).abs()).collect::<Vec<_>>()),
            misses: part(all.iter().filter(|t| **t > MISS).count(), all.len()),
            model_error: mean(&known(|f| (f.predicted - f.time).abs() / f.time)),
            changes: each(|f| f.changes),
            reversals: each(|f| f.reversals),
            holes: each(|f| f.holes),
            value_over_bound: mean(&known(|f| f.quality)),
            certified: part(gaps.iter().filter(|g| **g <= CERTIFIED).count(), gaps.len()),
            settled: f64::NAN,
            polygons: mean(&known(|f| f.polygons)),
        }
    }
}

/// The mean; NaN of nothing.
pub(super) fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

/// The standard deviation; NaN of nothing.
pub(super) fn stddev(x: &[f64]) -> f64 {
    let middle = mean(x);
    (x.iter().map(|x| (x - middle) * (x - middle)).sum::<f64>() / x.len() as f64).sqrt()
}

/// How far, in proportion, the median of nine frames may be from the mean of the later ones, and for how many frames it must
/// stay so.
const NEAR: f64 = 0.06;
const STAYS: usize = 20;
const MEDIAN_OF: usize = 9;

/// Frames after `step` until the median of nine stays within 6 % of the mean of `later` for twenty; NaN where it never does.
pub(super) fn settled(times: &[f64], step: usize, later: std::ops::Range<usize>) -> f64 {
    let goal = mean(&times[later.clone()]);
    let median = |at: usize| {
        let mut near = times[at - MEDIAN_OF / 2..=at + MEDIAN_OF / 2].to_vec();
        near.sort_by(f64::total_cmp);
        near[MEDIAN_OF / 2]
    };
    let calm = |k: &usize| (0..STAYS).all(|j| (median(step + k + j) / goal - 1.0).abs() <= NEAR);
    (0..later.end - step - STAYS - MEDIAN_OF).find(calm).map_or(f64::NAN, |k| k as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(time: f64, full: f64) -> Frame {
        let none = f64::NAN;
        let (things, polygons) = (4, 10.0);
        Frame {
            time,
            full,
            predicted: 1.1 * time,
            gap: none,
            quality: none,
            things,
            holes: 1,
            changes: 2,
            reversals: 0,
            polygons,
        }
    }

    #[test]
    fn only_binding_frames_tell_how_near_a_policy_keeps_to_its_time() {
        let row = Row::of("", "", &[frame(0.9, 2.0), frame(1.1, 3.0), frame(0.2, 0.2), frame(1.0, 1.1)]);
        assert!((row.binding - 0.5).abs() < 1e-15 && (row.avg_err - 0.1).abs() < 1e-12);
        assert!((row.binding_stddev - 0.1).abs() < 1e-12 && (row.mean - 0.8).abs() < 1e-12);
        assert!((row.misses - 0.25).abs() < 1e-15 && (row.model_error - 0.1).abs() < 1e-12);
        assert!((row.holes - 0.25).abs() < 1e-15 && (row.changes - 0.5).abs() < 1e-15 && row.certified.is_nan());
    }

    #[test]
    fn step_that_decays_settles_when_it_is_within_six_parts_in_a_hundred() {
        // 1 + 0.5 · 0.8^k is within 6 % from the tenth frame on: 0.5 · 0.8^10 = 0.054
        let times: Vec<_> = (0..300).map(|k| if k < 100 { 1.0 } else { 1.0 + 0.5 * 0.8_f64.powi(k - 100) }).collect();
        assert_eq!(settled(&times, 100, 150..300), 10.0);
    }
}
